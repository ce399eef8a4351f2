"""Goals: where to go next, why, and when to change one's mind."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum

import numpy as np
from scipy import ndimage

from onemap_planner.motion.path import Reach, line_is_clear
from onemap_planner.policy.viewpoints import (
    least_hidden_stand,
    reachable,
    seeing_stand,
    stands_around,
)
from onemap_planner.world.costmap import Terrain
from onemap_planner.world.frontiers import Frontier
from onemap_planner.world.regions import Region
from onemap_shared.geometry import F64, I64


class GoalKind(str, Enum):
    """What a goal is for; the words travel in ``PlannedPath.goal_kind``."""

    FRONTIER = "frontier"
    REGION = "region"
    DETECTION = "detection"

    def __str__(self) -> str:
        return self.value


@dataclass(frozen=True, slots=True)
class GoalRules:
    """How goals are weighed; see ``PlannerConfig`` for the values."""

    travel_weight_per_m: float
    size_weight_per_m: float
    keep_margin: float
    same_goal_m: float
    stand_within_m: float
    view_nearest_m: float
    view_farthest_m: float


@dataclass(frozen=True, slots=True)
class Worth:
    """What a goal is worth: similarity plus a little for size, less the way there."""

    score: float
    size_bonus: float
    travel_m: float
    travel_penalty: float

    @property
    def utility(self) -> float:
        """What goals are ranked by."""
        return self.score + self.size_bonus - self.travel_penalty


@dataclass(frozen=True, slots=True)
class Goal:
    """Stand at stand_xy and look at look_xy, (2,) metres each."""

    kind: GoalKind
    stand_xy: tuple[float, float]
    look_xy: tuple[float, float]
    worth: Worth
    reason: str

    def is_about(self, xy: tuple[float, float], within_m: float) -> bool:
        """Whether what the goal looks at lies within ``within_m`` of a place."""
        return float(np.hypot(self.look_xy[0] - xy[0], self.look_xy[1] - xy[1])) <= within_m


def frontier_goals(
    frontiers: tuple[Frontier, ...], terrain: Terrain, reach: Reach, *, rules: GoalRules
) -> list[Goal]:
    """A goal for each frontier that can be walked up to."""
    can_stand = reachable(terrain, reach)
    if not can_stand.any():
        return []
    size = terrain.grid.cell_size_m
    away, nearest = ndimage.distance_transform_edt(~can_stand, return_indices=True)
    goals = []
    for frontier in frontiers:
        cells = frontier.cells
        near = away[cells[:, 0], cells[:, 1]] * size <= rules.stand_within_m
        stand = _frontier_stand(cells[near], nearest, terrain)
        if stand is None:
            continue
        length_m = len(cells) * size
        worth = _worth(frontier.score, length_m, reach.cost_m[tuple(stand)], rules)
        what = "unknown space" if frontier.unknown else "a place seen only from afar"
        reason = (
            f"frontier: {what} {worth.travel_m:.1f} m away, "
            f"similarity {frontier.score:.2f} expected beyond"
        )
        goals.append(
            Goal(GoalKind.FRONTIER, _xy(terrain, stand), _pair(frontier.beyond_xy), worth, reason)
        )
    return goals


def region_goals(
    regions: tuple[Region, ...],
    terrain: Terrain,
    reach: Reach,
    *,
    tried_xy: F64,
    rules: GoalRules,
) -> list[Goal]:
    """A goal for each region that can be looked at from a stand not tried (T, 2) in vain."""
    goals = []
    band_m = (rules.view_nearest_m, rules.view_farthest_m)
    tried = terrain.grid.cells(tried_xy)
    nobody = tried[:0]
    for region in regions:
        around = stands_around(region.cells, terrain, reach, band_m=band_m, tried=tried)
        stand = seeing_stand(around, nobody)
        if stand is None:
            stand = least_hidden_stand(around)
        if stand is None:
            continue
        worth = _worth(region.score, 0.0, reach.cost_m[tuple(stand)], rules)
        reason = f"region: similarity {region.score:.2f} on the map, {worth.travel_m:.1f} m away"
        goals.append(
            Goal(GoalKind.REGION, _xy(terrain, stand), _pair(region.peak_xy), worth, reason)
        )
    return goals


def choose(options: Iterable[Goal], current: Goal | None, rules: GoalRules) -> Goal | None:
    """The best option, or today's version of the current goal unless the best is clearly better."""
    ranked = sorted(options, key=lambda goal: (-goal.worth.utility, goal.look_xy))
    if not ranked:
        return None
    best = ranked[0]
    if current is None:
        return best
    same = [
        goal
        for goal in ranked
        if goal.kind is current.kind and goal.is_about(current.look_xy, rules.same_goal_m)
    ]
    if same and best.worth.utility < same[0].worth.utility + rules.keep_margin:
        return same[0]
    return best


def _frontier_stand(cells: I64, nearest: I64, terrain: Terrain) -> I64 | None:
    """The reachable cell nearest to the middle of the frontier and in sight of it."""
    if len(cells) == 0:
        return None
    away = np.hypot(*(cells - cells.mean(axis=0)).T)
    for cell in cells[np.argsort(away, kind="stable")][:5]:
        stand: I64 = nearest[:, cell[0], cell[1]].astype(np.int64)
        if line_is_clear(~terrain.occupied, stand, cell):
            return stand
    return None


def _worth(score: float, length_m: float, travel_m: float, rules: GoalRules) -> Worth:
    return Worth(
        score=score,
        size_bonus=rules.size_weight_per_m * length_m,
        travel_m=float(travel_m),
        travel_penalty=rules.travel_weight_per_m * float(travel_m),
    )


def _xy(terrain: Terrain, cell: I64) -> tuple[float, float]:
    return _pair(terrain.grid.centres(cell))


def _pair(xy: F64) -> tuple[float, float]:
    return float(xy[0]), float(xy[1])
