"""What a map and the update of a frame depend on.

``MapperConfig`` holds what the owner of a robot sets; the rest has a reason here, beside its value,
and is an argument so that tests and benchmarks can vary it.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, sqrt
from typing import Literal

import torch

OBSTACLE_MIN_HEIGHT_M = 0.10  # lower things are driven over: carpets, noise


@dataclass(frozen=True, kw_only=True)
class MapParams:
    """The numbers of one map; lengths in metres, heights above z = 0."""

    device: str = "cpu"
    # Whether features on the CPU are fused and read by compiled loops; else by torch, as on a GPU.
    compiled: bool = True
    cell_size_m: float = 0.1  # the paper's 10 cells per metre
    # Side of the largest map, and how far from the origin it may begin: a pose that jumps further
    # is refused, instead of a grid that fills the memory.
    max_extent_m: float = 200.0

    # Pixels beyond this z-depth carry no feature: the released variance ends here too.
    max_feature_range_m: float = 10.0
    max_feature_height_m: float = 2.2  # the ceiling would cover what stands under it
    # Location uncertainty, metres per metre of distance (Eq. depthvariance); the released value.
    depth_factor: float = 0.01
    # Window of that blur to each side, the released one; 0 keeps features where they were seen.
    blur_half_width_cells: int = 3

    obstacle_max_height_m: float = 1.2  # the robot's height, it passes under what is higher
    occupancy_range_m: float = 8.0  # further depth makes neither obstacle nor floor
    # Standard deviation of the depth at 1 m, growing with its square, as a stereo camera's. Where
    # it exceeds a cell, depth neither makes nor clears obstacles. 0: no such limit.
    depth_noise_m: float = 0.0
    # Larger images are thinned to this height: at 240 a 3 cm leg is still seen at 5 m, at a quarter
    # of the time of 480.
    occupancy_max_rows: int = 240

    # float16 halves the memory and its traffic, rounded by chance so that small changes add up;
    # sums are float32. float32 for comparisons to the last digit.
    feature_dtype: Literal["float32", "float16"] = "float16"
    # What is known of a cell counts for at most this when a view is fused: older views fade, so
    # that the map follows a world that changes. Some 350 frames at 2 m, a minute and a half at
    # 4 Hz: noise is averaged to a twentieth.
    max_prior_confidence: float = 300.0
    # And for this once something stands there that did not, or has gone: one view. No difference is
    # made at max_prior_confidence.
    changed_confidence: float = 1.0
    # A cell is explored (and searched) once 1/c falls below this. The released model gives a pixel
    # s = 0.86 at 2 m, 0.55 at 3 m and 0.26 at 4 m: three views at 2 m, eight at 4 m.
    explored_variance: float = 0.5

    @property
    def torch_device(self) -> torch.device:
        return torch.device(self.device)

    @property
    def torch_dtype(self) -> torch.dtype:
        return torch.float32 if self.feature_dtype == "float32" else torch.float16

    @property
    def max_cells(self) -> int:
        return ceil(self.max_extent_m / self.cell_size_m) ** 2

    @property
    def obstacle_range_m(self) -> float:
        """Depth up to which points are obstacles: its deviation is at most a cell."""
        if self.depth_noise_m == 0:
            return self.occupancy_range_m
        return min(self.occupancy_range_m, sqrt(self.cell_size_m / self.depth_noise_m))

    @property
    def levels(self) -> int:
        """Voxels per column, each about as high as a cell is wide."""
        return max(
            1, round((self.obstacle_max_height_m - OBSTACLE_MIN_HEIGHT_M) / self.cell_size_m)
        )

    @property
    def voxel_height_m(self) -> float:
        return (self.obstacle_max_height_m - OBSTACLE_MIN_HEIGHT_M) / self.levels

    @property
    def grid(self) -> tuple[float, float, float]:
        """Cell size and heights of obstacles: maps of another grid cannot be loaded or merged."""
        return self.cell_size_m, OBSTACLE_MIN_HEIGHT_M, self.obstacle_max_height_m
