"""Ways through the unknown, and what closes the ways over known floor."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from onemap_planner.motion.path import CostToGo, cost_to_go_from, cost_to_go_from_any
from onemap_planner.policy.context import PlanningContext
from onemap_planner.policy.goals import GIVEN_UP_RADIUS_M, Goal, GoalKind, GoalUtility
from onemap_planner.policy.viewpoints import NO_CELLS, SightTarget, first_visible, viewpoints_around
from onemap_planner.search.state_machine import Destination
from onemap_planner.sentences import OBSTACLE, ONWARD, onward
from onemap_planner.world.costmap import IMPASSABLE, RETURN_FACTOR
from onemap_planner.world.distances import distance_cells, distances_to_edge_m
from onemap_planner.world.map_view import components
from onemap_shared.geometry import F64, I64, Bool
from onemap_shared.messages import Occupancy, SearchKind, subject_of

# Metres from a place where the robot cannot stand that still count as there: from its centre to
# what an arm or a voice reaches.
PLACE_TOLERANCE_M = 0.5
# Metres from which a place is looked at, at most: farther, the floor is seen at less than 20
# degrees from a camera at 1 m.
PLACE_FARTHEST_M = 3.0
# Cost of a metre of unknown floor, in metres of known floor, when the way is planned: a known way
# is preferred if it is at most half as long again. The robot drives on known floor only.
UNKNOWN_COST = 1.5

PAD_CELLS = 10  # unknown cells around the map, so that a way may lead around what is known
LOOK_AHEAD_M = 0.5  # the robot faces the way this far beyond the last known cell
SAME_WAY_M = 0.1  # cells whose way is at most this much longer lie on the best one


@dataclass(frozen=True, slots=True)
class FrontierOnWay:
    """Where a way leaves the known floor.

    cell (2,): the last known one; ahead (2,): on the way beyond it, inside the grid; left_m: cost
    of the rest of the way.
    """

    cell: I64
    ahead: I64
    left_m: float


def frontier_on_way(
    xy: tuple[float, float],
    context: PlanningContext,
    closed: Bool,
    *,
    within_m: float,
    unknown_cost: float,
) -> FrontierOnWay | None:
    """The frontier on the cheapest way to ``within_m`` of a place (metres).

    None if no way leads there, or if it leads over known floor only. closed (nx, ny): floor that
    the robot could not see into, impassable unless it is known to be free.
    """
    way = _way_from(np.asarray(xy), context, closed, within_m, unknown_cost)
    if way is None:
        return None
    grid = context.costmap.grid
    left_m = way.cost_m[PAD_CELLS:-PAD_CELLS, PAD_CELLS:-PAD_CELLS]
    total_m = np.where(_candidates(context), context.cost_to_go.cost_m + left_m, np.inf)
    if not np.isfinite(total_m).any():
        return None
    on_way = total_m <= total_m.min() + SAME_WAY_M
    cell = np.array(np.unravel_index(np.argmin(np.where(on_way, left_m, np.inf)), left_m.shape))
    if left_m[tuple(cell)] == 0:
        return None
    padded = cell + PAD_CELLS
    steps = way.path_to((int(padded[0]), int(padded[1])))[::-1] - PAD_CELLS
    ahead = steps[min(int(LOOK_AHEAD_M / grid.cell_size_m), len(steps) - 1)]
    inside = np.clip(ahead, 0, np.array(grid.shape) - 1)
    return FrontierOnWay(cell, inside, float(left_m[tuple(cell)]))


def visit_counts(context: PlanningContext, visited_xy: Iterable[tuple[float, float]]) -> I64:
    """(nx, ny): how many of the frontiers that were visited, metres, were near each cell."""
    grid = context.costmap.grid
    counts = np.zeros(grid.shape, np.int64)
    for cell in grid.cells(np.array([*visited_xy], np.float64).reshape(-1, 2)):
        counts += distance_cells(grid, cell) * grid.cell_size_m <= GIVEN_UP_RADIUS_M
    return counts


def _candidates(context: PlanningContext) -> Bool:
    """Mask (nx, ny) of where the known part of a way may end.

    Reachable floor that the camera saw, and where the robot stands. Floor that is free only
    because the robot stands on it would let it creep into the unknown.
    """
    mask: Bool = context.costmap.navigable & (context.map_view.occupancy == Occupancy.FREE)
    mask[tuple(context.cell_at(context.pose.xy))] = True
    return mask


def _way_from(
    xy: F64, context: PlanningContext, closed: Bool, within_m: float, unknown_cost: float
) -> CostToGo | None:
    """Costs and ways (nx + 2 pad, ny + 2 pad) from the place; None if nothing leads there."""
    costmap = context.costmap
    unknown = ~costmap.navigable & ~costmap.occupied & ~closed
    unknown &= costmap.clearance_m >= context.params.min_clearance_m
    cost = np.where(unknown, unknown_cost, IMPASSABLE)
    cost = np.where(costmap.passable, costmap.cost, cost)
    cost[closed & ~_candidates(context)] = IMPASSABLE  # the robot's own trail too
    cost = np.pad(cost, PAD_CELLS, constant_values=unknown_cost)
    ends = _ends(xy, context, cost > 0, within_m)
    if len(ends) == 0:
        return None
    return cost_to_go_from_any(cost, ends, cell_size_m=costmap.grid.cell_size_m)


def _ends(xy: F64, context: PlanningContext, passable: Bool, within_m: float) -> I64:
    """Cells (N, 2) of the padded grid: the place's own if it is passable, else the nearest ones.

    None farther than ``within_m``; but a place beyond the padding stands for the nearest cell of
    its rim.
    """
    grid = context.costmap.grid
    place = np.asarray(grid.cells(xy)) + PAD_CELLS
    nearest = np.clip(place, 0, np.array(passable.shape) - 1)
    if passable[tuple(nearest)]:
        return nearest[None]
    cells = np.argwhere(passable)
    away_m = np.hypot(*(cells - place).T) * grid.cell_size_m
    ends: I64 = cells[away_m <= min(float(away_m.min()) + grid.cell_size_m, within_m)]
    return ends


MAX_VISITS = 2  # after the second one, floor that could not be seen counts as impassable
MAX_UNREACHED = 2  # places whose ways are planned, the most similar ones: each costs a path


@dataclass(frozen=True, slots=True)
class UnreachedPlace:
    """A place without a viewpoint, metres, and its score in units of similarity."""

    xy: tuple[float, float]
    score: float


def frontier_goal(destination: Destination, context: PlanningContext, visits: I64) -> Goal | None:
    """The frontier on the way; None if the way is known, or none leads there.

    On the second visit the robot looks from farther away, because the camera does not see the
    floor before its feet.
    """
    look = destination.kind is SearchKind.LOOK_AT
    frontier = frontier_on_way(
        destination.xy,
        context,
        visits >= MAX_VISITS,
        within_m=PLACE_FARTHEST_M if look else PLACE_TOLERANCE_M,
        unknown_cost=UNKNOWN_COST,
    )
    if frontier is None:
        return None
    viewpoint: I64 | None = None
    if visits[tuple(frontier.ahead)]:
        viewpoint = _view_of(frontier.ahead[None], context)
    xy = context.xy_of(frontier.cell if viewpoint is None else viewpoint)
    utility = utility_at(xy, context)
    doing = onward(subject_of("", destination.xy))
    return Goal(GoalKind.FRONTIER, xy, context.xy_of(frontier.ahead), utility, doing)


def ways_to_unreached(
    places: Iterable[UnreachedPlace], context: PlanningContext, visits: I64
) -> list[Goal]:
    """The frontiers on the ways to the most similar places, as if unknown floor were free.

    visits (nx, ny): how often the robot looked beyond a frontier near each cell without result.
    What is known around a frontier says little of a place several metres beyond it; so that
    place's own score counts here, over the whole way to it.
    """
    best = sorted(places, key=lambda place: (-place.score, place.xy))[:MAX_UNREACHED]
    goals = []
    for place in best:
        there = Destination(SearchKind.LOOK_AT, place.xy)
        goal = frontier_goal(there, context, visits)
        if goal is None:
            continue
        left_m = float(np.hypot(*np.subtract(goal.look_xy, place.xy)))
        utility = GoalUtility.of(place.score, goal.utility.travel_m + left_m)
        goals.append(replace(goal, utility=utility, doing=ONWARD))
    return goals


def _view_of(cells: I64, context: PlanningContext, tried: I64 = NO_CELLS) -> I64 | None:
    """The nearest view (2,) of cells (K, 2) from where the floor before them is seen."""
    band_m = (context.params.escape_radius_m, PLACE_FARTHEST_M)
    return first_visible(viewpoints_around(SightTarget(cells), context, band_m, tried=tried))


def utility_at(viewpoint_xy: tuple[float, float], context: PlanningContext) -> GoalUtility:
    """The utility of a place (metres), which is the way to it."""
    cell = context.cell_at(viewpoint_xy)
    return GoalUtility.of_place(float(context.cost_to_go.cost_m[tuple(cell)]))


LEAST_CLOSED_M2 = 1.0  # less floor out of reach is the rim of furniture


def looks_at_closed_ways(context: PlanningContext, tried_xy: F64) -> Iterator[Goal]:
    """Views of what closes the ways to floor that no path leads to, the largest part first.

    From where the camera sees the floor there, so that the map follows what it shows; tried_xy
    (T, 2): metres, where the robot looked from before.
    """
    parts = components(context.cut_off())
    size_m2 = context.map_view.cell_area_m2
    tried = context.costmap.grid.cells(tried_xy)
    for part in sorted(parts, key=len, reverse=True):
        if len(part) * size_m2 < LEAST_CLOSED_M2:
            return
        obstacle = _closing_obstacle(context, part)
        goal = _look_at(obstacle, context, tried) if len(obstacle) else None
        if goal is not None:
            yield goal


def _look_at(obstacle: I64, context: PlanningContext, tried: I64) -> Goal | None:
    """The nearest view of an obstacle's cells (K, 2), not from tried ones (T, 2); None without."""
    cell = _view_of(obstacle, context, tried)
    if cell is None:
        return None
    x, y = context.costmap.grid.centres(obstacle).mean(axis=0)
    there, look_xy = context.xy_of(cell), (float(x), float(y))
    return Goal(GoalKind.LOOK_AT, there, look_xy, utility_at(there, context), OBSTACLE)


def _closing_obstacle(context: PlanningContext, beyond: I64) -> I64:
    """Cells (K, 2) of the first obstacle on the way to the cells (N, 2) beyond; empty if there is
    no way, over floor that was seen once."""
    costmap = context.costmap
    size = costmap.grid.cell_size_m
    x, y = context.cell_at(context.pose.xy).tolist()
    way = cost_to_go_from(_cost_without_passers_by(context), (x, y), cell_size_m=size)
    nearest = beyond[np.argmin(way.cost_m[tuple(beyond.T)])]
    if not np.isfinite(way.cost_m[tuple(nearest)]):
        return beyond[:0]
    path = way.path_to((int(nearest[0]), int(nearest[1])))
    passable = costmap.passable[tuple(path.T)]
    first = int(np.argmin(passable))
    closed = path[first : first + max(int(np.argmax(passable[first:])), 1)]
    occupied = np.argwhere(costmap.occupied & context.map_view.floor_seen)
    away = np.hypot(*(occupied[:, None] - closed[None]).transpose(2, 0, 1)).min(axis=1, initial=1e9)
    obstacle: I64 = occupied[away * size <= context.params.min_clearance_m + size / 2]
    return obstacle


def _cost_without_passers_by(context: PlanningContext) -> F64:
    """Costs (nx, ny) as if nothing stood where floor was seen once; dear where something does."""
    costmap, size = context.costmap, context.costmap.grid.cell_size_m
    seen = context.map_view.floor_seen
    away_m = distances_to_edge_m(costmap.occupied & ~seen, size)
    open_once = (seen | costmap.free) & (away_m >= context.params.min_clearance_m)
    dear = RETURN_FACTOR * context.params.dearest
    cost: F64 = np.where(
        costmap.passable, costmap.cost, np.where(open_once, dear, IMPASSABLE)
    ).astype(np.float64)
    if costmap.keep_out is not None:
        cost[costmap.keep_out.closed & ~costmap.passable] = IMPASSABLE
    return cost
