"""The mapper's section of the configuration."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import torch
from pydantic import Field, model_validator

from onemap_mapper.frame_update import MapParams
from onemap_mapper.occupancy import OccupancyParams
from onemap_mapper.projection import ProjectionParams
from onemap_shared.params import Params


class MapperConfig(Params):
    """How the map is built, queried and kept."""

    cell_size_m: float = Field(
        default=0.1, gt=0, le=1, description="m; the paper's 10 cells per metre."
    )
    max_extent_m: float = Field(
        default=200.0,
        ge=10,
        le=2000,
        description="m; side of the largest map. A pose that jumps further is refused, instead of "
        "a grid that fills the memory.",
    )
    device: str = Field(
        default="cpu",
        pattern=r"^(cpu|cuda(:\d+)?)$",
        description="Where features live. One frame takes a few ms on two CPU cores; cuda frees "
        "them on a Jetson.",
    )
    threads: int = Field(
        default=1,
        ge=1,
        le=64,
        description="CPU threads of torch. One, because the other services share the cores and "
        "torch's threads wait for each other at every step: measured on two cores under a load "
        "of seven, a 640 x 480 frame took 28 ms with one thread and 770 ms with two.",
    )
    feature_dtype: Literal["float32", "float16"] = Field(
        default="float32",
        description="How features are stored; sums are always float32. float16 halves the memory, "
        "but loses updates smaller than 1/2000 of a value: what a cell learns after it was seen "
        "some thousand times.",
    )
    max_feature_range_m: float = Field(
        default=10.0,
        gt=0,
        le=100,
        description="m; further pixels carry no feature. The released variance ends here too.",
    )
    max_feature_height_m: float = Field(
        default=2.2,
        description="m above the floor; higher pixels carry no feature: the ceiling would cover "
        "what stands under it.",
    )
    depth_factor: float = Field(
        default=0.01,
        ge=0,
        le=1,
        description="Location uncertainty, metres per metre of distance (Eq. depthvariance); the "
        "released code's value. Raise it for noisy depth.",
    )
    blur_half_width_cells: int = Field(
        default=3, ge=0, le=10, description="Window of the location blur; the released code's."
    )
    explored_variance: float = Field(
        default=0.5,
        gt=0,
        description="A cell is explored (and searched) once 1/c falls below this. The released "
        "model gives a pixel s = 0.86 at 2 m, 0.55 at 3 m and 0.26 at 4 m, so 0.5 takes three "
        "frames at 2 m, four at 3 m, eight at 4 m: seen for a second or two, not in passing.",
    )
    process_noise_per_s: float = Field(
        default=0.0,
        ge=0,
        description="Variance added per second (process noise); 0 never forgets, as the paper.",
    )
    floor_tolerance_m: float = Field(
        default=0.08, ge=0, description="m; points this near to z = 0 are floor or carpet."
    )
    obstacle_min_height_m: float = Field(
        default=0.10, ge=0, description="m; lower things are driven over: carpets, noise."
    )
    obstacle_max_height_m: float = Field(
        default=1.2, gt=0, description="m; the robot's height, it passes under what is higher."
    )
    clearing_height_m: float = Field(
        default=0.30,
        gt=0,
        description="m; a ray lower than this shows that a cell is free even where the floor "
        "itself gives no depth: dark, glossy or seen at a grazing angle.",
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
    clearing_range_m: float = Field(
        default=5.0,
        gt=0,
        le=50,
        description="m; rays free cells up to here. A 3 cm table leg is still a pixel wide.",
    )
    occupancy_max_rows: int = Field(
        default=240,
        ge=30,
        le=2160,
        description="Larger depth images are thinned to this height for the occupancy: at 240 a "
        "3 cm leg is still seen at 5 m, at a quarter of the time of 480.",
    )
    initially_free_radius_m: float = Field(
        default=0.35,
        ge=0,
        le=2,
        description="m around the camera at first sight that count as free: the robot stands "
        "there, its camera cannot see its own feet, and unknown is not free.",
    )
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
    map_folder: Path = Field(
        default=Path("maps"), description="Where maps are saved to and loaded from."
    )

    @model_validator(mode="after")
    def _heights_in_order(self) -> MapperConfig:
        if not self.floor_tolerance_m <= self.obstacle_min_height_m < self.obstacle_max_height_m:
            raise ValueError(
                "floor_tolerance_m <= obstacle_min_height_m < obstacle_max_height_m must hold"
            )
        return self

    def settings(self) -> MapParams:
        """What the pure modules need."""
        return MapParams(
            projection=ProjectionParams(
                self.cell_size_m, self.max_feature_range_m, self.max_feature_height_m
            ),
            occupancy=OccupancyParams(
                cell_size_m=self.cell_size_m,
                floor_tolerance_m=self.floor_tolerance_m,
                min_height_m=self.obstacle_min_height_m,
                max_height_m=self.obstacle_max_height_m,
                clearing_height_m=self.clearing_height_m,
                height_error_per_m=self.height_error_per_m,
                max_range_m=self.occupancy_range_m,
                clear_range_m=self.clearing_range_m,
                max_image_rows=self.occupancy_max_rows,
            ),
            depth_factor=self.depth_factor,
            blur_half_width=self.blur_half_width_cells,
            explored_variance=self.explored_variance,
            process_noise_per_s=self.process_noise_per_s,
            initially_free_radius_m=self.initially_free_radius_m,
            max_extent_m=self.max_extent_m,
            feature_dtype=torch.float32 if self.feature_dtype == "float32" else torch.float16,
            device=torch.device(self.device),
        )
