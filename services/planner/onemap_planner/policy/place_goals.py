"""Goals of a drive to a place: where to stand, from where to see it, or what to explore first.

A search drives to a place too, where it saw the object beyond the known floor.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from onemap_planner.motion.path import line_is_clear
from onemap_planner.policy.context import PlanningContext
from onemap_planner.policy.goals import Goal, GoalKind, GoalParams, GoalUtility
from onemap_planner.policy.place_params import PlaceParams
from onemap_planner.policy.unknown_way import frontier_on_way
from onemap_planner.policy.viewpoints import (
    BLUR_CELLS,
    SightTarget,
    Viewpoints,
    first_visible,
    least_occluded,
    reachable,
    viewpoints_around,
)
from onemap_planner.search.phases import Destination
from onemap_planner.world.costmap import distance_cells
from onemap_shared.geometry import I64
from onemap_shared.messages import SearchKind, subject_of

MAX_VISITS = 2  # after the second one, floor that could not be seen counts as impassable
MAX_UNREACHED = 2  # places whose ways are planned, the most similar ones: each costs a path
INTO_M = 1.5  # from which a place inside an obstacle is looked at, at most


@dataclass(frozen=True, slots=True)
class UnreachedPlace:
    """A place without a viewpoint, metres, and its score in units of similarity."""

    xy: tuple[float, float]
    score: float


def place_goals(
    destination: Destination, context: PlanningContext, visits: I64, params: PlaceParams
) -> Iterator[Goal]:
    """The goals of a drive to a place, the best first.

    A place that the map knows is reached or seen from known floor; otherwise the way to it is
    explored. visits (nx, ny): how often the robot looked beyond a frontier near each cell without
    result. A place that stays unknown, such as the inside of a cupboard, is reached or seen as
    well as possible.
    """
    look = destination.kind is SearchKind.LOOK_AT
    final = _seeing(destination.xy, context, params) if look else None
    if not look and _known(destination.xy, context):
        final = _standing(destination.xy, context, params)
    if final is not None:
        yield _goal(destination, final, context)
    frontier = frontier_goal(destination, context, visits, params)
    if frontier is not None:
        yield frontier
    if final is None:
        find = _seeing_into if look else _standing
        final = find(destination.xy, context, params)
        if final is not None:
            yield _goal(destination, final, context)


def frontier_goal(
    destination: Destination, context: PlanningContext, visits: I64, params: PlaceParams
) -> Goal | None:
    """The frontier on the way; None if the way is known, or none leads there.

    On the second visit the robot looks from farther away, because the camera does not see the
    floor before its feet.
    """
    look = destination.kind is SearchKind.LOOK_AT
    frontier = frontier_on_way(
        destination.xy,
        context,
        visits >= MAX_VISITS,
        within_m=params.view_farthest_m if look else params.tolerance_m,
        unknown_cost=params.unknown_cost,
    )
    if frontier is None:
        return None
    viewpoint: I64 | None = None
    if visits[tuple(frontier.ahead)]:
        band_m = (context.params.escape_radius_m, params.view_farthest_m)
        around = viewpoints_around(
            SightTarget(frontier.ahead[None]),
            context.costmap,
            context.cost_to_go,
            band_m=band_m,
            tried=frontier.ahead[None][:0],
        )
        viewpoint = first_visible(around)
    xy = _xy(frontier.cell if viewpoint is None else viewpoint, context)
    utility = _utility(xy, context)
    reason = (
        f"on the way to {subject_of('', destination.xy)}: unknown space {utility.travel_m:.1f} m "
        f"away, {frontier.left_m:.1f} m still to go from there"
    )
    return Goal(GoalKind.FRONTIER, xy, _xy(frontier.ahead, context), utility, reason)


def ways_to_unreached(
    places: Iterable[UnreachedPlace],
    context: PlanningContext,
    visits: I64,
    *,
    place_params: PlaceParams,
    goal_params: GoalParams,
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
        goal = frontier_goal(there, context, visits, place_params)
        if goal is None:
            continue
        left_m = float(np.hypot(*np.subtract(goal.look_xy, place.xy)))
        utility = GoalUtility.of(place.score, goal.utility.travel_m + left_m, goal_params)
        reason = f"{goal.reason}, similarity {place.score:.2f} there"
        goals.append(replace(goal, utility=utility, reason=reason))
    return goals


def nearest_reachable_m(xy: tuple[float, float], context: PlanningContext) -> float:
    """Distance in metres from a place to the nearest reachable cell, infinity without any."""
    cells = np.argwhere(reachable(context.costmap, context.cost_to_go))
    away = np.hypot(*(context.costmap.grid.centres(cells) - np.asarray(xy)).T)
    return float(away.min(initial=np.inf))


def _known(xy: tuple[float, float], context: PlanningContext) -> bool:
    costmap = context.costmap
    cell = costmap.grid.cells(np.asarray(xy))
    if not costmap.grid.contains(cell):
        return False
    return bool(costmap.free[tuple(cell)] | costmap.occupied[tuple(cell)])


def _standing(xy: tuple[float, float], context: PlanningContext, params: PlaceParams) -> I64 | None:
    """The reachable cell (2,) nearest to a place, within the tolerance; None without any.

    No obstacle lies between, so that the robot does not stop behind a wall; except for the
    obstacle that a place is in.
    """
    costmap, grid = context.costmap, context.costmap.grid
    cell = grid.cells(np.asarray(xy))
    if not grid.contains(cell):
        return None
    own = (distance_cells(grid, cell) <= BLUR_CELLS) & ~costmap.free[tuple(cell)]
    cells = np.argwhere(reachable(costmap, context.cost_to_go))
    away_m = np.hypot(*(grid.centres(cells) - np.asarray(xy)).T)
    near = np.flatnonzero(away_m <= params.tolerance_m)
    for index in near[np.argsort(away_m[near], kind="stable")]:
        if line_is_clear(~costmap.occupied | own, cells[index], cell):
            found: I64 = cells[index]
            return found
    return None


def _seeing(xy: tuple[float, float], context: PlanningContext, params: PlaceParams) -> I64 | None:
    """The cheapest reachable cell (2,) from which a known place is in sight; None without any."""
    if not _known(xy, context):
        return None
    around = _around(xy, context, (params.view_nearest_m, params.view_farthest_m))
    return first_visible(around)


def _seeing_into(
    xy: tuple[float, float], context: PlanningContext, params: PlaceParams
) -> I64 | None:
    """The reachable cell (2,) near a place from which the least hides it; None without any."""
    if not context.costmap.grid.contains(context.costmap.grid.cells(np.asarray(xy))):
        return None
    return least_occluded(_around(xy, context, (params.view_nearest_m, INTO_M)))


def _around(
    xy: tuple[float, float], context: PlanningContext, band_m: tuple[float, float]
) -> Viewpoints:
    """Viewpoints around a place; what is unknown hides it, except around the robot."""
    costmap, grid = context.costmap, context.costmap.grid
    here = grid.cells(np.asarray(context.pose.xy))
    beneath = distance_cells(grid, here) * grid.cell_size_m <= context.params.escape_radius_m
    opaque = replace(costmap, occupied=costmap.occupied | ~(costmap.free | beneath))
    cell = grid.cells(np.asarray(xy))[None]
    return viewpoints_around(
        SightTarget(cell), opaque, context.cost_to_go, band_m=band_m, tried=cell[:0]
    )


def _goal(destination: Destination, cell: I64, context: PlanningContext) -> Goal:
    viewpoint_xy = _xy(cell, context)
    utility = _utility(viewpoint_xy, context)
    look = destination.kind is SearchKind.LOOK_AT
    view = "a view of " if look else ""
    reason = f"{view}{subject_of('', destination.xy)}, {utility.travel_m:.1f} m away"
    kind = GoalKind.LOOK_AT if look else GoalKind.GO_TO
    return Goal(kind, viewpoint_xy, destination.xy, utility, reason)


def _utility(viewpoint_xy: tuple[float, float], context: PlanningContext) -> GoalUtility:
    cell = context.costmap.grid.cells(np.asarray(viewpoint_xy))
    return GoalUtility.of_place(float(context.cost_to_go.cost_m[tuple(cell)]))


def _xy(cell: I64, context: PlanningContext) -> tuple[float, float]:
    x, y = context.costmap.grid.centres(cell)
    return float(x), float(y)
