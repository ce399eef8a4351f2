"""The mapper's section of the configuration."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, ClassVar

from pydantic import Field, field_validator

from onemap_mapper.params import MapParams
from onemap_shared.keys import NAMESPACE
from onemap_shared.params import Params

Namespace = Annotated[str, Field(pattern=NAMESPACE)]


class MapperConfig(Params):
    """Where the map lives, what robot and camera it is of, and where it is kept."""

    former_keys: ClassVar[Mapping[str, str]] = {
        "max_feature_range_m": "depth_range_m",
        "occupancy_range_m": "depth_range_m",
    }

    device: str = Field(
        default="auto",
        pattern=r"^(auto|cpu|cuda(:\d+)?)$",
        description="Where features live, are fused and compared with texts: cpu, cuda, or auto "
        "for the GPU if torch can use one. All else of a frame is computed on the CPU.",
    )
    cell_size_m: float = Field(
        default=0.1, ge=0.05, le=1, description="m; the paper's 10 cells per metre."
    )
    obstacle_max_height_m: float = Field(
        default=1.2, ge=0.2, description="m; the robot's height, it passes under what is higher."
    )
    depth_range_m: float = Field(
        default=10.0,
        gt=0,
        le=100,
        description="m; what the depth camera measures well. Pixels further away carry no feature, "
        "and beyond 8 m no depth makes obstacles or floor.",
    )
    depth_noise_m: float = Field(
        default=0.0,
        ge=0,
        le=0.1,
        description="m; standard deviation of the depth at 1 m, growing with its square, as a "
        "stereo camera's. Where it exceeds a cell, depth neither makes nor clears obstacles: "
        "0.005 beyond 4.5 m. 0: no such limit; searches were measured without one.",
    )
    found_score: float = Field(
        default=0.3,
        ge=0,
        le=1,
        description="Score of the best region from which a query's verdict is found: above "
        "mini's floor, 0.25, where one unrelated word in twenty is answered. With an encoder whose "
        "floor is fitted to the map, that floor counts.",
    )
    map_folder: Path = Field(
        default=Path("maps"),
        description="Where maps are saved to and loaded from, and where checkpoints and the found "
        "objects are kept for a restart of the mapper.",
    )
    map_quota_mb: int = Field(
        default=10_000,
        ge=1,
        description="MB that the saved maps may take together; beyond it saving is refused. A flat "
        "of 5,200 cells takes 16 MB with 768 channels.",
    )
    resume: bool | None = Field(
        default=None,
        description="Whether the map, with found objects and places, outlives the robot's driver. "
        "false: where the frame of its poses begins anew with each start; then they are set aside "
        "when another driver process sends frames, and a mapper that alone was restarted goes on "
        "with them. null: false in a frame of ROS 2 whose name begins with odom, else true.",
    )
    robots: tuple[Namespace, ...] = Field(
        default=(),
        max_length=16,
        description="The bus.namespace of every robot whose frames go into this map, for example "
        "[fleet/r1, fleet/r2], the mapper's own among them or not: one map for robots whose poses "
        "are in one frame. Empty: the mapper's own robot alone. Frames of all are fused one after "
        "the other on one core, so 16 at 4 Hz are as much as it can do.",
    )

    @field_validator("robots")
    @classmethod
    def _each_once(cls, robots: tuple[str, ...]) -> tuple[str, ...]:
        if len(set(robots)) < len(robots):
            raise ValueError(f"robots names {', '.join(robots)}: each robot once")
        return robots

    @property
    def map(self) -> MapParams:
        return MapParams(
            device="cpu" if self.device == "auto" else self.device,  # resolved at the start
            cell_size_m=self.cell_size_m,
            max_feature_range_m=self.depth_range_m,
            obstacle_max_height_m=self.obstacle_max_height_m,
            occupancy_range_m=min(MapParams.occupancy_range_m, self.depth_range_m),
            depth_noise_m=self.depth_noise_m,
        )
