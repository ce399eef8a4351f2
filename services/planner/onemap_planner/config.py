"""Section ``planner`` of the configuration. Every default says its unit and its reason."""

from __future__ import annotations

from pathlib import Path

from pydantic import Field, PositiveFloat, PositiveInt

from onemap_planner.motion.progress import RecoveryParams
from onemap_planner.motion.pure_pursuit import DriveParams
from onemap_planner.motion.staleness import StalenessParams
from onemap_planner.policy.goals import GoalParams
from onemap_planner.policy.params import ExploreParams, PlannerParams
from onemap_planner.world.candidates import ConsensusParams
from onemap_planner.world.costmap import CostmapParams
from onemap_planner.world.frontiers import FrontierParams
from onemap_planner.world.regions import SimilarRegionParams
from onemap_shared.params import Params


class RecoveryConfig(Params):
    """What to do when the robot does not get on."""

    stuck_s: PositiveFloat = Field(
        default=3.0,
        description="Seconds without moving although commanded: well above any start-up.",
    )
    back_up_m: PositiveFloat = Field(default=0.2, description="Metres to back up: one radius.")
    back_up_s: PositiveFloat = Field(
        default=2.5, description="Seconds after which backing up ends anyway."
    )
    virtual_obstacle_s: PositiveFloat = Field(
        default=60.0, description="Seconds an obstacle that only the bumper knows is believed."
    )
    max_stuck_count: PositiveInt = Field(
        default=3,
        description="Bumps in one place after which the goal is given up; twice that: stuck.",
    )
    stuck_radius_m: PositiveFloat = Field(
        default=1.0, description="Metres that make it another place."
    )


class PlannerConfig(Params):
    """Everything the planner can be told."""

    state_dir: Path | None = Field(
        default=None,
        description="Folder for the active search, so that it survives a restart; none: it does "
        "not.",
    )
    plan_hz: PositiveFloat = Field(
        default=4.0, description="Plans per second: as often as the map changes."
    )
    control_hz: PositiveFloat = Field(
        default=20.0, description="Commands per second: well within their validity of 300 ms."
    )
    costmap: CostmapParams = Field(
        default=CostmapParams(),
        description="Where the robot may drive: its size, in metres, against the map.",
    )
    frontier: FrontierParams = Field(
        default=FrontierParams(),
        description="What counts as a border of the explored that is worth a visit.",
    )
    region: SimilarRegionParams = Field(
        default=SimilarRegionParams(),
        description="What counts as a place on the map that is worth a second look.",
    )
    goal: GoalParams = Field(
        default=GoalParams(),
        description="How places to go to are weighed against each other and the way there.",
    )
    consensus: ConsensusParams = Field(
        default=ConsensusParams(),
        description="When a detection and the map agree, so that it is believed.",
    )
    explore: ExploreParams = Field(
        default=ExploreParams(),
        description="Times in seconds and distances in metres of the search itself.",
    )
    drive: DriveParams = Field(
        default=DriveParams(),
        description="Speeds, accelerations and tolerances of driving along a path.",
    )
    staleness: StalenessParams = Field(
        default=StalenessParams(),
        description="How old, in seconds, what the robot drives by may be: older stops it.",
    )
    recovery: RecoveryConfig = Field(
        default=RecoveryConfig(),
        description="What to do when the robot does not move as it should.",
    )

    def params(self) -> PlannerParams:
        """The same as the plain values that the pure modules take."""
        return PlannerParams(
            costmap=self.costmap,
            frontier=self.frontier,
            region=self.region,
            goal=self.goal,
            consensus=self.consensus,
            explore=self.explore,
            drive=self.drive,
            recovery=RecoveryParams(
                **self.recovery.model_dump(),
                bumper_m=self.costmap.radius_m + self.costmap.margin_m,
            ),
            staleness=self.staleness,
        )
