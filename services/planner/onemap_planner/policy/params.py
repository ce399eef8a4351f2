"""All the numbers the planner goes by, as plain values; ``config.py`` gives them."""

from __future__ import annotations

from dataclasses import dataclass

from onemap_planner.motion.progress import RecoveryRules
from onemap_planner.motion.pure_pursuit import DriveRules
from onemap_planner.motion.staleness import FreshnessRules
from onemap_planner.policy.goals import GoalRules
from onemap_planner.world.candidates import ConsensusRules
from onemap_planner.world.costmap import TerrainRules
from onemap_planner.world.frontiers import FrontierRules
from onemap_planner.world.regions import RegionRules


@dataclass(frozen=True, slots=True)
class ExploreRules:
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
    shun_m: float
    known_around: float
    object_limit_s: float
    patience_s: float


@dataclass(frozen=True, slots=True)
class Rules:
    """One group for each subject."""

    terrain: TerrainRules
    frontier: FrontierRules
    region: RegionRules
    goal: GoalRules
    consensus: ConsensusRules
    explore: ExploreRules
    drive: DriveRules
    recovery: RecoveryRules
    freshness: FreshnessRules
