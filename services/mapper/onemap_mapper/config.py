"""The mapper's section of the configuration."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, ClassVar

from pydantic import Field, model_validator

from onemap_mapper.params import (
    CheckpointParams,
    ObjectParams,
    RegionParams,
    SubmapParams,
    VerdictParams,
)
from onemap_shared.keys import NAMESPACE

Namespace = Annotated[str, Field(pattern=NAMESPACE)]


class MapperConfig(SubmapParams, ObjectParams, VerdictParams, RegionParams, CheckpointParams):
    """How the map is built, queried and kept."""

    former_keys: ClassVar[Mapping[str, str]] = {
        "forgetting_per_s": "process_noise_per_s",
    }

    threads: int = Field(
        default=1,
        ge=1,
        le=64,
        description="CPU threads of torch. One, because the other services share the cores and "
        "torch's threads wait for each other at every step: measured on two cores under a load "
        "of seven, a 640 x 480 frame took 28 ms with one thread and 770 ms with two.",
    )
    map_quota_mb: int = Field(
        default=10_000,
        ge=1,
        description="MB that the saved maps may take together; beyond it saving is refused. A flat "
        "of 5,200 cells takes 16 MB with 768 channels.",
    )
    map_folder: Path = Field(
        default=Path("maps"),
        description="Where maps are saved to and loaded from, and where checkpoints and the found "
        "objects are kept for a restart of the mapper.",
    )
    robots: tuple[Namespace, ...] = Field(
        default=(),
        max_length=16,
        description="The bus.namespace of every robot whose frames go into this map, for example "
        "[fleet/r1, fleet/r2], the mapper's own among them or not: one map for robots whose poses "
        "are in one frame. Empty: the mapper's own robot alone. Frames of all are fused one after "
        "the other on one core, so 16 at 4 Hz are as much as it can do.",
    )

    @model_validator(mode="after")
    def _one_clock(self) -> MapperConfig:
        if len(set(self.robots)) < len(self.robots):
            raise ValueError(f"robots names {', '.join(self.robots)}: each robot once")
        if self.robots and self.process_noise_per_s > 0:
            raise ValueError(
                "process_noise_per_s needs one clock, and each of several robots has its own: set "
                "it to 0, or leave robots empty"
            )
        return self
