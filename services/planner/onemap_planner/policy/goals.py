"""Goals: where to go next, why, and when to change one's mind."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import ClassVar

import numpy as np
from pydantic import Field, PositiveFloat
from scipy import ndimage

from onemap_planner.motion.path import CostToGo, line_is_clear
from onemap_planner.policy.viewpoints import (
    first_visible,
    least_occluded,
    reachable,
    viewpoints_around,
)
from onemap_planner.world.costmap import Costmap
from onemap_planner.world.frontiers import Frontier
from onemap_planner.world.regions import SimilarRegion
from onemap_shared.geometry import F64, I64
from onemap_shared.params import Params


class GoalKind(str, Enum):
    """What a goal is for; the words travel in ``PlannedPath.goal_kind``."""

    FRONTIER = "frontier"
    REGION = "region"
    DETECTION = "detection"

    def __str__(self) -> str:
        return self.value


class GoalParams(Params):
    """How goals are weighed against each other."""

    former_keys: ClassVar[Mapping[str, str]] = {
        "keep_margin": "hysteresis",
        "stand_within_m": "viewpoint_within_m",
    }

    travel_weight_per_m: float = Field(
        default=0.04,
        ge=0,
        description="Similarity that a metre of way must be worth: 10 m for 0.4, the difference "
        "between a hint and none.",
    )
    size_weight_per_m: float = Field(
        default=0.04, ge=0, description="Bonus per metre of frontier: wide openings show more."
    )
    hysteresis: float = Field(
        default=0.1,
        ge=0,
        description="Utility by which another goal must exceed the current one to replace it.",
    )
    same_goal_m: PositiveFloat = Field(
        default=0.8, description="Metres a goal may shift between two maps and still be the same."
    )
    viewpoint_within_m: PositiveFloat = Field(
        default=0.8, description="Metres from which a frontier counts as reached."
    )
    view_nearest_m: PositiveFloat = Field(
        default=0.8, description="Metres; nearer, the camera looks over low things."
    )
    view_farthest_m: PositiveFloat = Field(
        default=1.5, description="Metres; farther, small things are too few pixels."
    )


@dataclass(frozen=True, slots=True)
class GoalUtility:
    """What a goal is worth: similarity plus a little for size, less the way there."""

    score: float
    size_bonus: float
    travel_m: float
    travel_penalty: float

    @property
    def total(self) -> float:
        """What goals are ranked by."""
        return self.score + self.size_bonus - self.travel_penalty


@dataclass(frozen=True, slots=True)
class Goal:
    """Stand at viewpoint_xy and look at look_xy, (2,) metres each."""

    kind: GoalKind
    viewpoint_xy: tuple[float, float]
    look_xy: tuple[float, float]
    utility: GoalUtility
    reason: str

    def looks_at(self, xy: tuple[float, float], within_m: float) -> bool:
        """Whether what the goal looks at lies within ``within_m`` of a place."""
        return float(np.hypot(self.look_xy[0] - xy[0], self.look_xy[1] - xy[1])) <= within_m


def frontier_goals(
    frontiers: tuple[Frontier, ...], costmap: Costmap, cost_to_go: CostToGo, *, params: GoalParams
) -> list[Goal]:
    """A goal for each frontier that can be walked up to."""
    reachable_mask = reachable(costmap, cost_to_go)
    if not reachable_mask.any():
        return []
    size = costmap.grid.cell_size_m
    away, nearest = ndimage.distance_transform_edt(~reachable_mask, return_indices=True)
    goals = []
    for frontier in frontiers:
        cells = frontier.cells
        near = away[cells[:, 0], cells[:, 1]] * size <= params.viewpoint_within_m
        viewpoint = _frontier_viewpoint(cells[near], nearest, costmap)
        if viewpoint is None:
            continue
        length_m = len(cells) * size
        utility = _utility(frontier.score, length_m, cost_to_go.cost_m[tuple(viewpoint)], params)
        what = "unknown space" if frontier.unknown else "a place seen only from afar"
        reason = (
            f"frontier: {what} {utility.travel_m:.1f} m away, "
            f"similarity {frontier.score:.2f} expected beyond"
        )
        goals.append(
            Goal(
                GoalKind.FRONTIER,
                _xy(costmap, viewpoint),
                _pair(frontier.beyond_xy),
                utility,
                reason,
            )
        )
    return goals


def region_goals(
    regions: tuple[SimilarRegion, ...],
    costmap: Costmap,
    cost_to_go: CostToGo,
    *,
    tried_xy: F64,
    params: GoalParams,
) -> list[Goal]:
    """A goal for each region that can be looked at from a stand not tried (T, 2) in vain."""
    goals = []
    band_m = (params.view_nearest_m, params.view_farthest_m)
    tried = costmap.grid.cells(tried_xy)
    nobody = tried[:0]
    for region in regions:
        around = viewpoints_around(region.cells, costmap, cost_to_go, band_m=band_m, tried=tried)
        viewpoint = first_visible(around, nobody)
        if viewpoint is None:
            viewpoint = least_occluded(around)
        if viewpoint is None:
            continue
        utility = _utility(region.score, 0.0, cost_to_go.cost_m[tuple(viewpoint)], params)
        reason = f"region: similarity {region.score:.2f} on the map, {utility.travel_m:.1f} m away"
        goals.append(
            Goal(GoalKind.REGION, _xy(costmap, viewpoint), _pair(region.peak_xy), utility, reason)
        )
    return goals


def select_goal(options: Iterable[Goal], current: Goal | None, params: GoalParams) -> Goal | None:
    """The best option, or today's version of the current goal unless the best is clearly better."""
    ranked = sorted(options, key=lambda goal: (-goal.utility.total, goal.look_xy))
    if not ranked:
        return None
    best = ranked[0]
    if current is None:
        return best
    same = [
        goal
        for goal in ranked
        if goal.kind is current.kind and goal.looks_at(current.look_xy, params.same_goal_m)
    ]
    if same and best.utility.total < same[0].utility.total + params.hysteresis:
        return same[0]
    return best


def _frontier_viewpoint(cells: I64, nearest: I64, costmap: Costmap) -> I64 | None:
    """The reachable cell nearest to the middle of the frontier and in sight of it."""
    if len(cells) == 0:
        return None
    away = np.hypot(*(cells - cells.mean(axis=0)).T)
    for cell in cells[np.argsort(away, kind="stable")][:5]:
        viewpoint: I64 = nearest[:, cell[0], cell[1]].astype(np.int64)
        if line_is_clear(~costmap.occupied, viewpoint, cell):
            return viewpoint
    return None


def _utility(score: float, length_m: float, travel_m: float, params: GoalParams) -> GoalUtility:
    return GoalUtility(
        score=score,
        size_bonus=params.size_weight_per_m * length_m,
        travel_m=float(travel_m),
        travel_penalty=params.travel_weight_per_m * float(travel_m),
    )


def _xy(costmap: Costmap, cell: I64) -> tuple[float, float]:
    return _pair(costmap.grid.centres(cell))


def _pair(xy: F64) -> tuple[float, float]:
    return float(xy[0]), float(xy[1])
