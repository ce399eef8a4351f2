"""All the numbers the planner goes by, as plain values; ``config.py`` gives them."""

from __future__ import annotations

from dataclasses import dataclass

from onemap_planner.motion.progress import RecoveryParams
from onemap_planner.motion.pure_pursuit import DriveParams
from onemap_planner.motion.staleness import StalenessParams
from onemap_planner.policy.goals import GoalParams
from onemap_planner.world.candidates import ConsensusParams
from onemap_planner.world.costmap import CostmapParams
from onemap_planner.world.frontiers import FrontierParams
from onemap_planner.world.regions import SimilarRegionParams


@dataclass(frozen=True, slots=True)
class ExploreParams:
    """Times and distances of the search itself; see ``PlannerConfig`` for the values."""

    approach_nearest_m: float
    approach_farthest_m: float
    approach_last_resort_m: float
    confirm_sightings: int
    confirm_s: float
    linger_s: float
    settle_s: float
    goal_base_s: float
    goal_s_per_m: float
    blacklist_radius_m: float
    known_around: float
    object_limit_s: float
    patience_s: float


@dataclass(frozen=True, slots=True)
class PlannerParams:
    """One group for each subject."""

    costmap: CostmapParams
    frontier: FrontierParams
    region: SimilarRegionParams
    goal: GoalParams
    consensus: ConsensusParams
    explore: ExploreParams
    drive: DriveParams
    recovery: RecoveryParams
    staleness: StalenessParams
