"""Parameters of the map, in groups as the modules use them.

``MapperConfig`` inherits them all, so each is declared here once, under the name that people write
in the mapper's section of the configuration.
"""

from __future__ import annotations

from math import ceil, sqrt
from typing import Literal

import torch
from pydantic import Field, model_validator

from onemap_shared.grid import MAX_CELLS
from onemap_shared.messages import MAX_LISTED_OBJECTS
from onemap_shared.params import Params


class GridParams(Params):
    """The grid of the map, and how loops over its cells are computed."""

    compiled: bool = Field(
        default=True,
        description="Whether loops over pixels and cells are compiled, where numba is installed "
        "and device is cpu: a frame takes a quarter of the time. The first start compiles, "
        "minutes on a busy machine, and says so in log and status; the result is kept in "
        "NUMBA_CACHE_DIR, else beside the program or in the user's cache folder. false: numpy and "
        "torch only, where a process must not generate code.",
    )

    cell_size_m: float = Field(
        default=0.1, gt=0, le=1, description="m; the paper's 10 cells per metre."
    )
    max_extent_m: float = Field(
        default=200.0,
        ge=10,
        le=2000,
        description="m; side of the largest map, and how far from the origin it may begin. A pose "
        "that jumps further is refused, instead of a grid that fills the memory; 409 m at the "
        "default cell size is the most that is allowed.",
    )

    @property
    def max_cells(self) -> int:
        """Cells of the largest map."""
        return ceil(self.max_extent_m / self.cell_size_m) ** 2

    @model_validator(mode="after")
    def _check_extent(self) -> GridParams:
        cells = self.max_extent_m / self.cell_size_m
        if cells**2 > MAX_CELLS:
            most_m = MAX_CELLS**0.5 * self.cell_size_m
            raise ValueError(
                f"max_extent_m is {self.max_extent_m:g}, but cells of {self.cell_size_m:g} m allow "
                f"{most_m:.0f} m: make the map smaller or its cells larger"
            )
        return self


class ProjectionParams(GridParams):
    """Which pixels carry a feature."""

    max_feature_range_m: float = Field(
        default=10.0,
        gt=0,
        le=100,
        description="m of z-depth; further pixels carry no feature. The released variance ends "
        "here too.",
    )
    max_feature_height_m: float = Field(
        default=2.2,
        description="m above the floor; higher pixels carry no feature: the ceiling would cover "
        "what stands under it.",
    )


class BlurParams(GridParams):
    """Location uncertainty, Eq. depthvariance."""

    depth_factor: float = Field(
        default=0.01,
        ge=0,
        le=1,
        description="Location uncertainty, metres per metre of distance (Eq. depthvariance); the "
        "released code's value. Raise it for noisy depth.",
    )
    blur_half_width_cells: int = Field(
        default=3,
        ge=0,
        le=10,
        description="Window of the location blur in cells to each side; the released code's. "
        "0 keeps features in the cells where they were seen.",
    )


class OccupancyParams(GridParams):
    """Heights above z = 0 and ranges from the camera, for the occupancy."""

    floor_tolerance_m: float = Field(
        default=0.08, ge=0, description="m; points this near to z = 0 are floor or carpet."
    )
    obstacle_min_height_m: float = Field(
        default=0.10, ge=0, description="m; lower things are driven over: carpets, noise."
    )
    obstacle_max_height_m: float = Field(
        default=1.2, gt=0, description="m; the robot's height, it passes under what is higher."
    )
    drop_min_depth_m: float = Field(
        default=0.06,
        gt=0,
        le=0.5,
        description="m; a surface this much lower than the floor before it is a drop, and a cell "
        "where floor is missing is occupied. Lower thresholds are driven over.",
    )
    drop_range_m: float = Field(
        default=4.0,
        ge=0,
        le=20,
        description="m from the camera to the place where floor is missing; 0: no drop is ever "
        "concluded. Further edges are found when the robot comes nearer.",
    )
    missing_floor_range_m: float = Field(
        default=3.0,
        ge=0,
        le=20,
        description="m; where seen floor ends nearer than this at a large hole without depth, "
        "as at the top of stairs, its end is an edge. 0 for a camera that sees no dark floor.",
    )
    tilt_error_per_m: float = Field(
        default=0.035,
        ge=0,
        le=0.2,
        description="m of height per m of distance that an error of the camera's pitch explains: "
        "2 degrees. Lower things are drops even if the edge before them was not in view; a ramp "
        "that falls more steeply is one.",
    )
    floor_gap_m: float = Field(
        default=0.4,
        gt=0,
        le=2,
        description="m; floor between two points of it that are neighbours in the image counts "
        "as seen: at a grazing angle the image samples the floor sparsely.",
    )
    height_error_per_m: float = Field(
        default=0.01,
        ge=0,
        le=0.2,
        description="m of height per m of distance; half a degree of pitch error must not raise "
        "a far floor into an obstacle.",
    )
    occupancy_range_m: float = Field(
        default=8.0, gt=0, le=50, description="m; further depth makes neither obstacle nor floor."
    )
    depth_noise_m: float = Field(
        default=0.0,
        ge=0,
        le=0.1,
        description="m; standard deviation of the depth at 1 m, growing with its square, as a "
        "stereo camera's. Where it exceeds a cell, depth neither makes nor clears obstacles: "
        "0.005 beyond 4.5 m. 0: no such limit; searches were measured without one.",
    )
    clearing_range_m: float = Field(
        default=5.0,
        gt=0,
        le=50,
        description="m; rays clear obstacles up to here, as far as depth_noise_m allows. A 3 cm "
        "table leg is still a pixel wide.",
    )
    occupancy_max_rows: int = Field(
        default=240,
        ge=30,
        le=2160,
        description="Larger depth images are thinned to this height for the occupancy: at 240 a "
        "3 cm leg is still seen at 5 m, at a quarter of the time of 480.",
    )

    @property
    def obstacle_range_m(self) -> float:
        """Depth up to which points are obstacles: its deviation is at most a cell, metres."""
        if self.depth_noise_m == 0:
            return self.occupancy_range_m
        return min(self.occupancy_range_m, sqrt(self.cell_size_m / self.depth_noise_m))

    @model_validator(mode="after")
    def _heights_in_order(self) -> OccupancyParams:
        if not self.floor_tolerance_m <= self.obstacle_min_height_m < self.obstacle_max_height_m:
            raise ValueError(
                "floor_tolerance_m <= obstacle_min_height_m < obstacle_max_height_m must hold"
            )
        return self

    @property
    def levels(self) -> int:
        """Voxels per column, each about as high as a cell is wide."""
        height_m = self.obstacle_max_height_m - self.obstacle_min_height_m
        return max(1, round(height_m / self.cell_size_m))


class RegionParams(Params):
    """Which cells make a region of a query's answer."""

    region_best_share: float = Field(
        default=0.5,
        gt=0,
        le=1,
        description="Cells of at least this share of the best score make regions.",
    )
    region_top_share: float = Field(
        default=0.05,
        gt=0,
        le=1,
        description="Uncalibrated encoders only: and among this share of the highest, the paper's "
        "top 5 percentile.",
    )


class VerdictParams(Params):
    """When a query's answer is ``found``, ``not_here`` or ``not_looked_yet``."""

    found_score: float = Field(
        default=0.3,
        ge=0,
        le=1,
        description="Score of the best region from which the answer is found: above mini's floor, "
        "0.25, where one unrelated word in twenty is answered. "
        "An encoder without calibration scores every text above 0.5: raise it.",
    )
    looked_share: float = Field(
        default=0.85,
        gt=0,
        le=1,
        description="Share of the reachable area that was looked at from which what was not found "
        "is not here; a camera that has seen all floor of an apartment reaches 0.89 to 0.95, the "
        "rest is the far side of furniture.",
    )
    frontier_view_m: float = Field(
        default=3.0,
        gt=0,
        le=10,
        description="m; unknown area in sight from a border of the known floor up to here counts "
        "as not looked at.",
    )
    frontier_min_m2: float = Field(
        default=1.0,
        ge=0,
        description="Square metres of unknown area in sight from which a border is a frontier: a "
        "door shows 5 and more, a pocket behind a chair 0.3.",
    )


class ObjectParams(Params):
    """Which found objects are kept with the map."""

    same_object_m: float = Field(
        default=1.0,
        gt=0,
        le=10,
        description="m along the floor; a find of the same name within this distance is the same "
        "object seen again. The middle of what is seen of a bed moves by up to half its size with "
        "the side it is seen from; two objects of one name that stand closer are one entry.",
    )
    max_objects: int = Field(
        default=100,
        ge=1,
        le=MAX_LISTED_OBJECTS,
        description="Found objects that are kept; the one found longest ago makes room. Their "
        "pictures, some 30 kB each, lie in memory and are written again with every find.",
    )


class SubmapParams(Params):
    """Parts of the map that follow corrections of the pose; kept once SLAM publishes any."""

    submap_distance_m: float = Field(
        default=1.0,
        gt=0,
        le=20,
        description="m of way after which the next submap begins. A submap is rigid: at an "
        "odometry error of 2 % its ends are 2 cm off, less than half a cell. Shorter ones need "
        "more memory for the same rooms.",
    )
    submap_turn_deg: float = Field(
        default=45.0,
        gt=0,
        le=360,
        description="Degrees that the camera turns from a submap's first frame until the next "
        "submap begins: half a camera's view.",
    )
    max_submaps: int = Field(
        default=500,
        ge=2,
        le=10_000,
        description="Submaps that can still be moved, some 500 m of way. The oldest become fixed "
        "first: their poses were corrected most often, and SLAM holds on to where it began.",
    )
    submap_memory_mb: int = Field(
        default=256,
        ge=1,
        le=65_536,
        description="MB of memory for submaps; beyond it the oldest become fixed too. A submap of "
        "an apartment takes 0.3 MB with 64 channels and 2.4 MB with 768, in float16.",
    )


class MapParams(OccupancyParams, BlurParams, ProjectionParams):
    """All that a belief map depends on."""

    device: str = Field(
        default="cpu",
        pattern=r"^(cpu|cuda(:\d+)?)$",
        description="Where the map lives and frames are fused. One frame takes a few ms on two "
        "CPU cores; cuda frees them on a Jetson.",
    )
    feature_dtype: Literal["float32", "float16"] = Field(
        default="float16",
        description="How features are stored; sums are always float32. float16 halves the memory "
        "and its traffic. It is rounded up or down by chance, so that small changes add up: over "
        "a simulated hour no cosine with a thing that a cell shows or "
        "showed was off by 0.001. float32 for comparisons to the last digit.",
    )
    max_prior_confidence: float = Field(
        default=300.0,
        gt=0,
        description="Confidence that what is known of a cell counts for at most when a view is "
        "fused: older views fade, so that the map follows a world that changes. 300 are some 350 "
        "frames at 2 m, a minute and a half at 4 Hz: noise is averaged to a twentieth, and a cell "
        "shows what replaced a thing after as long. Variance, explored and searched count every "
        "view; a map that follows a pose graph keeps all of them.",
    )
    changed_confidence: float = Field(
        default=1.0,
        gt=0,
        description="Confidence that what is known of a cell counts for at most once something "
        "stands there that did not, or has gone, by the occupancy: then it is of another thing. "
        "1 is one view. max_prior_confidence: no difference is made. A map that follows a pose "
        "graph makes none.",
    )
    explored_variance: float = Field(
        default=0.5,
        gt=0,
        description="A cell is explored (and searched) once 1/c falls below this. The released "
        "model gives a pixel s = 0.86 at 2 m, 0.55 at 3 m and 0.26 at 4 m, so 0.5 takes three "
        "views at 2 m, four at 3 m, eight at 4 m: seen for a second or two, not in passing.",
    )
    keyframe_m: float = Field(
        default=0.1,
        gt=0,
        le=10,
        description="m that the camera has to move before another frame counts for explored and "
        "searched: a cell, less shows nothing new. Twice as much counts as one view.",
    )
    keyframe_deg: float = Field(
        default=5.0,
        gt=0,
        le=90,
        description="Degrees that the camera has to turn before another frame counts for explored "
        "and searched: a sixteenth of its view. Twice as much counts as one view.",
    )
    process_noise_per_s: float = Field(
        default=0.0,
        ge=0,
        description="Variance added per second (process noise); 0: none, as in the paper.",
    )
    initially_free_radius_m: float = Field(
        default=0.35,
        ge=0,
        le=2,
        description="m around the camera's first position that count as free: the robot stands "
        "there, its camera does not see that floor, and unknown is not free.",
    )

    @property
    def torch_device(self) -> torch.device:
        """``device`` for torch."""
        return torch.device(self.device)

    @property
    def torch_dtype(self) -> torch.dtype:
        """``feature_dtype`` for torch."""
        return torch.float32 if self.feature_dtype == "float32" else torch.float16


class CheckpointParams(MapParams):
    """When the map in memory is written, so that a restarted mapper resumes it."""

    checkpoint_interval_s: float = Field(
        default=15.0,
        ge=0,
        le=3600,
        description="s after which a changed map is written to the folder 'checkpoints' of "
        "map_folder, and what a crash loses at most, with the time of one write; also written "
        "when the mapper is stopped. 0: never.",
    )
    checkpoint_cells: int = Field(
        default=20_000,
        ge=1,
        description="Cells changed since the last checkpoint after which the next is written "
        "sooner, after a third of the interval: as many as ten frames of new floor change.",
    )
    resume: bool = Field(
        default=True,
        description="Whether a started mapper goes on with the map of its newest checkpoint. Set "
        "to false where the frame of the robot's poses begins anew with each start.",
    )

    def may_be_due(self, since_s: float) -> bool:
        """Whether a checkpoint can be due this long after the last."""
        return since_s >= self.checkpoint_interval_s / 3

    def is_due(self, since_s: float, changed_cells: int) -> bool:
        """Whether the map, of which so many cells changed, is to be written."""
        if changed_cells == 0 or not self.may_be_due(since_s):
            return False
        return since_s >= self.checkpoint_interval_s or changed_cells >= self.checkpoint_cells
