"""The mapper's section of the configuration."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import ClassVar

from pydantic import Field

from onemap_mapper.params import (
    CheckpointParams,
    ObjectParams,
    RegionParams,
    SubmapParams,
    VerdictParams,
)


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
