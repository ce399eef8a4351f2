"""Section ``planner`` of the configuration."""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar

from pydantic import Field

from onemap_planner.policy.params import PlannerParams


class PlannerConfig(PlannerParams):
    """Parameters of the policy, and of the process around it."""

    state_dir: Path | None = Field(
        default=Path("searches"),
        description="Folder for the last 50 searches, step by step, which 'onemap search replay' "
        "shows and 'onemap search --again' goes on with. None: nothing is recorded.",
    )

    plan_hz: ClassVar[float] = 4.0  # plans per second: as often as the map changes
    control_hz: ClassVar[float] = 20.0  # well within the validity of commands, 300 ms
