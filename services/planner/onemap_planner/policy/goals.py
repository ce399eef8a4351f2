"""Goals: where to go next and why; selection by utility, with hysteresis, and its reasons."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np

from onemap_planner.motion.path import lengths_over
from onemap_planner.policy.context import PlanningContext
from onemap_planner.policy.viewpoints import (
    SightTarget,
    first_visible,
    least_occluded,
    viewpoints_around,
)
from onemap_planner.sentences import AFAR, ALIKE, DOUBTED, SEEN, UNEXPLORED
from onemap_planner.world.candidates import ObjectCandidate
from onemap_planner.world.frontiers import Frontier
from onemap_planner.world.map_view import WorldCells
from onemap_planner.world.regions import SimilarRegion
from onemap_shared.geometry import F64, I64, Bool

GROWTH_CELLS = 2  # by which a border recedes between two plans: 0.2 m at most


class GoalKind(str, Enum):
    """What a goal is for; the values are those of ``PlannedPath.goal_kind``."""

    FRONTIER = "frontier"  # a border of what is known, or where an optimistic way crosses one
    REGION = "region"
    DETECTION = "detection"
    OUTLINE = "outline"  # the walls of a room
    GO_TO = "go_to"
    LOOK_AT = "look_at"

    def __str__(self) -> str:
        return self.value


# Metres of path at which a goal is worth half as much as here: a room. Far goals go by likeness per
# metre, whatever the encoder's scores are.
HALF_VALUE_M = 4.0
GIVEN_UP_RADIUS_M = 0.5  # metres around a goal viewed without result in which no other is taken
SAME_GOAL_M = 0.8  # metres a goal may shift between two maps and still be the same
VIEWPOINT_WITHIN_M = 0.8  # metres from which a frontier counts as reached
ROUNDING = 1e-9  # of a distance in cells
VIEW_NEAREST_M = 0.8  # nearer, the camera looks over low things
VIEW_FARTHEST_M = 1.5  # farther, small things are too few pixels
VIEW_BAND_M = (VIEW_NEAREST_M, VIEW_FARTHEST_M)


@dataclass(frozen=True, slots=True)
class GoalUtility:
    """What a goal is worth: its score, in units of similarity (0: a place), and the path to it."""

    score: float
    travel_m: float

    @property
    def travel_share(self) -> float:
        """The part of the score that the path leaves: 1 here, 1/2 at ``HALF_VALUE_M``."""
        return 1.0 / (1.0 + self.travel_m / HALF_VALUE_M)

    @property
    def total(self) -> float:
        """The number that goals are ranked by."""
        return self.score * self.travel_share


@dataclass(frozen=True, slots=True)
class Goal:
    """Drive to viewpoint_xy and face look_xy, (2,) metres each.

    doing: what the robot does then, for ``goal_sentence``. cells: what it is about, by which it is
    recognised on the next map; empty for a place.
    """

    kind: GoalKind
    viewpoint_xy: tuple[float, float]
    look_xy: tuple[float, float]
    utility: GoalUtility
    doing: str
    cells: WorldCells = frozenset()

    def looks_at(self, xy: tuple[float, float], within_m: float) -> bool:
        """Whether ``look_xy`` lies within ``within_m`` of a point (metres)."""
        return float(np.hypot(self.look_xy[0] - xy[0], self.look_xy[1] - xy[1])) <= within_m


@dataclass(frozen=True, slots=True)
class SearchAreas:
    """Where the map of one planning step asks for a look: frontiers and regions."""

    frontiers: tuple[Frontier, ...] = ()
    regions: tuple[SimilarRegion, ...] = ()


NO_AREAS = SearchAreas()


def successor(goals: Iterable[Goal], earlier: Goal) -> Goal | None:
    """Which of the goals is the earlier one on a newer map; None if it is gone.

    The goal of its kind that shares the most cells with it, since the middle of a border jumps
    when a part of it was seen or it is cut elsewhere; cells up to ``GROWTH_CELLS`` away count,
    because a border recedes. Without any such, the first within ``SAME_GOAL_M``.
    """
    alike = [goal for goal in goals if goal.kind is earlier.kind]
    around = grown(earlier.cells)
    shared = [len(goal.cells & around) for goal in alike]
    if max(shared, default=0) > 0:
        return alike[shared.index(max(shared))]
    near = (goal for goal in alike if goal.looks_at(earlier.look_xy, SAME_GOAL_M))
    return next(near, None)


def grown(cells: WorldCells) -> WorldCells:
    """The cells and all within ``GROWTH_CELLS`` of them, diagonals included."""
    steps = range(-GROWTH_CELLS, GROWTH_CELLS + 1)
    return frozenset((x + dx, y + dy) for x, y in cells for dx in steps for dy in steps)


MAX_FRONTIER_CELLS = 5  # lines of sight tried per frontier, from its middle outwards


def frontier_goals(frontiers: tuple[Frontier, ...], context: PlanningContext) -> list[Goal]:
    """A goal for each frontier with a reachable viewpoint."""
    if not frontiers or not context.reachable.any():
        return []
    chosen, viewpoints = _frontier_viewpoints([each.cells for each in frontiers], context)
    ways_m = context.cost_to_go.lengths_m(viewpoints)
    return [
        _frontier_goal(frontiers[index], viewpoint, travel_m, context)
        for index, viewpoint, travel_m in zip(chosen, viewpoints, ways_m.tolist(), strict=True)
    ]


def _frontier_goal(
    frontier: Frontier, viewpoint: I64, travel_m: float, context: PlanningContext
) -> Goal:
    utility = GoalUtility(frontier.score, travel_m)
    look_xy, viewpoint_xy = _pair(frontier.beyond_xy), context.xy_of(viewpoint)
    cells = context.map_view.world_cells(frontier.cells)
    doing = UNEXPLORED if frontier.unknown else AFAR
    return Goal(GoalKind.FRONTIER, viewpoint_xy, look_xy, utility, doing, cells)


def region_goal(region: SimilarRegion, context: PlanningContext, *, tried_xy: F64) -> Goal | None:
    """A goal for a region that has a viewpoint not tried before (T, 2), metres."""
    tried = context.costmap.grid.cells(tried_xy)
    around = viewpoints_around(SightTarget(region.cells), context, VIEW_BAND_M, tried=tried)
    viewpoint = first_visible(around)
    if viewpoint is None:
        viewpoint = least_occluded(around)
    if viewpoint is None:
        return None
    utility = GoalUtility(region.score, _travel_m(viewpoint, context))
    cells = context.map_view.world_cells(region.cells)
    there = context.xy_of(viewpoint)
    return Goal(GoalKind.REGION, there, _pair(region.peak_xy), utility, ALIKE, cells)


def most_worth(region: SimilarRegion, context: PlanningContext) -> float:
    """The utility that no viewpoint of a region exceeds: there is none nearer by air."""
    size_m = context.costmap.grid.cell_size_m
    away_m = size_m * float(np.hypot(*(region.cells - context.cell_at(context.pose.xy)).T).min())
    return GoalUtility(region.score, max(away_m - VIEW_FARTHEST_M - size_m, 0.0)).total


def detection_goal(
    candidate: ObjectCandidate,
    score: float,
    viewpoint_xy: tuple[float, float],
    context: PlanningContext,
) -> Goal:
    """A look at a candidate from a viewpoint, metres; score: in units of similarity."""
    utility = GoalUtility(score, _travel_m(context.cell_at(viewpoint_xy), context))
    doing, there = SEEN if candidate.supported else DOUBTED, candidate.xyz[:2]
    return Goal(GoalKind.DETECTION, viewpoint_xy, there, utility, doing, candidate.cells)


def _frontier_viewpoints(segments: Sequence[I64], context: PlanningContext) -> tuple[I64, I64]:
    """Which segments (K_i, 2) have a viewpoint (V,), and those (V, 2).

    It is the reachable cell nearest to the middle of the segment and in sight of it, if there is
    one where the robot does not creep: the last steps to a border took longer than the way to it.
    """
    cells = np.concatenate(segments)
    owner = np.repeat(np.arange(len(segments)), [*map(len, segments)])
    within = VIEWPOINT_WITHIN_M / context.costmap.grid.cell_size_m + ROUNDING
    near, nearest = _nearest(context.reachable & ~context.costmap.creeping, cells, within)
    left = np.flatnonzero(~near)
    near[left], nearest[left] = _nearest(context.reachable, cells[left], within)
    cells, owner, nearest = cells[near], owner[near], nearest[near]
    sizes = np.bincount(owner, minlength=len(segments))
    middles = np.stack([np.bincount(owner, axis, len(segments)) for axis in cells.T], axis=-1)
    off = np.hypot(*(cells - (middles / np.maximum(sizes, 1)[:, None])[owner]).T)
    order = np.lexsort((off, owner))
    cells, owner, nearest = cells[order], owner[order], nearest[order]
    tried = np.arange(len(owner)) - (np.cumsum(sizes) - sizes)[owner] < MAX_FRONTIER_CELLS
    cells, owner, viewpoints = cells[tried], owner[tried], nearest[tried]
    in_sight = lengths_over(context.costmap.occupied, viewpoints, cells) == 0
    chosen, first = np.unique(owner[in_sight], return_index=True)
    return chosen, viewpoints[in_sight][first]


def _nearest(mask: Bool, cells: I64, within: float) -> tuple[Bool, I64]:
    """Which of the cells (N, 2) have a true one of the mask ``within`` that many cells, (N,), and
    the nearest (N, 2), the first by y of several."""
    reach = int(within)
    around = np.argwhere(np.ones((2 * reach + 1, 2 * reach + 1), bool)) - reach
    away = np.hypot(*around.T)
    around = around[np.lexsort((*around.T, away))][: np.count_nonzero(away <= within)]
    padded = np.pad(mask, reach)
    strides = np.array([padded.shape[1], 1])
    found = padded.ravel()[((cells + reach) @ strides)[:, None] + around @ strides]
    first = found.argmax(axis=1)
    return found[np.arange(len(cells)), first], cells + around[first]


def _travel_m(cell: I64, context: PlanningContext) -> float:
    """Metres of path: its cost would make a way along a wall count up to fourfold."""
    return context.cost_to_go.length_m((int(cell[0]), int(cell[1])))


def _pair(xy: F64) -> tuple[float, float]:
    return float(xy[0]), float(xy[1])
