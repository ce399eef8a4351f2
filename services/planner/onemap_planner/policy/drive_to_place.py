"""The drive to a place, or to where it can be seen: over known floor, else to where that ends."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from math import cos, sin

import numpy as np

from onemap_planner.motion.motions import Pose2d
from onemap_planner.motion.path import line_is_clear
from onemap_planner.policy.arrival import ArrivalState
from onemap_planner.policy.choose import head_for
from onemap_planner.policy.context import PlanningContext
from onemap_planner.policy.goals import Goal, GoalKind, GoalUtility
from onemap_planner.policy.ledger import Ledger
from onemap_planner.policy.outcome import Move
from onemap_planner.policy.state import SETTLE_S, PlannerState
from onemap_planner.policy.viewpoints import (
    BLUR_CELLS,
    NO_CELLS,
    SightTarget,
    Viewpoints,
    first_visible,
    least_occluded,
    viewpoints_around,
)
from onemap_planner.policy.ways import FLOOR_FARTHEST_M, end_near, option_on_way
from onemap_planner.search.state_machine import Destination, Ending, without_choice
from onemap_planner.sentences import driving, no_way, onward, outside
from onemap_planner.world.distances import distance_cells
from onemap_shared.geometry import F64, I64
from onemap_shared.messages import FailureCode, SearchKind, SearchState, subject_of

# Metres from which a place is looked at, at least: nearer, the camera looks over low things.
PLACE_NEAREST_M = 0.8
INTO_M = 1.5  # from which a place inside an obstacle is looked at, at most
# Metres from a place where the robot cannot stand that still count as there: from its centre to
# what an arm or a voice reaches.
PLACE_TOLERANCE_M = 0.5
# Metres outside of the map from which a place is none to explore the way to: what no camera at its
# edge could show as floor.
OUTSIDE_M = 8.0
FACED_FROM_M = 0.25  # nearer to the place the robot stands on it and faces nothing


def drive_to_place(state: PlannerState, destination: Destination, context: PlanningContext) -> Move:
    """Drive to the best goal; without one for ``SETTLE_S`` the drive has failed.

    It fails at once where the place is far outside of the map.
    """
    away_m = _outside_m(destination.xy, context)
    if away_m > OUTSIDE_M:
        place = subject_of("", destination.xy)
        why = outside(place, away_m, context.map_view.grid.bounds_m)
        return Move(event=Ending(SearchState.FAILED, why, FailureCode.UNREACHABLE))
    state.give_up_finished()
    goal = _select(state, destination, context)
    if goal is None:
        state.active_goal, state.search = None, without_choice(state.search)
        waits = state.idle_s() < SETTLE_S
        return Move(event=None if waits else _failure(destination, context))
    at, motion = head_for(state, goal, [goal], context, _look_xy(goal, context.pose))
    if at is ArrivalState.NO_VIEW:
        return Move()
    there = at is ArrivalState.THERE and goal.kind is not GoalKind.FRONTIER
    return Move(motion, _arrival(destination, context.pose) if there else None)


def _select(state: PlannerState, destination: Destination, context: PlanningContext) -> Goal | None:
    """The best goal that was not given up; on the way, a place is closed by looks at it."""
    goals = place_goals(destination, context, state.ledger)
    fresh = (g for g in goals if g.kind is GoalKind.FRONTIER or not state.ledger.is_given_up(g))
    return next(fresh, None)


def _look_xy(goal: Goal, pose: Pose2d) -> tuple[float, float]:
    """What the robot faces at the goal: it keeps its heading where it stands on the place."""
    if goal.kind is GoalKind.GO_TO and goal.looks_at(goal.viewpoint_xy, FACED_FROM_M):
        return pose.x_m + cos(pose.yaw_rad), pose.y_m + sin(pose.yaw_rad)
    return goal.look_xy


def _arrival(destination: Destination, pose: Pose2d) -> Ending:
    away_m, place = pose.distance_to(destination.xy), subject_of("", destination.xy)
    look = destination.kind is SearchKind.LOOK_AT
    told = f"looking at {place} from {away_m:.2f} m"
    return Ending(SearchState.ARRIVED, told if look else f"standing {away_m:.2f} m from {place}")


def _failure(destination: Destination, context: PlanningContext) -> Ending:
    away_m = nearest_reachable_m(destination.xy, context)
    done = "seen" if destination.kind is SearchKind.LOOK_AT else "reached"
    nearest = (
        f"the nearest reachable point is {away_m:.1f} m from it"
        if np.isfinite(away_m)
        else "no floor around the robot is known to be free"
    )
    zones = context.zones.names if context.costmap.keep_out is not None else ()
    reason = f"{subject_of('', destination.xy)} cannot be {done}: {no_way(zones)}; {nearest}"
    return Ending(SearchState.FAILED, reason, FailureCode.UNREACHABLE)


def place_goals(
    destination: Destination, context: PlanningContext, ledger: Ledger
) -> Iterator[Goal]:
    """The goals of a drive to a place, the best first; none near the views of the ledger.

    A place that the map knows is reached or seen from known floor; otherwise the way to it is
    explored. A place that stays unknown, such as the inside of a cupboard, is reached or seen as
    well as possible.
    """
    look, tried_xy = destination.kind is SearchKind.LOOK_AT, ledger.tried_xy(GoalKind.LOOK_AT)
    final: I64 | None = None
    if _known(destination.xy, context):
        seen = _seeing(destination.xy, context, tried_xy) if look else None
        final = seen if look else _standing(destination.xy, context)
    if final is not None:
        yield _goal(destination, final, context)
    end_xy = end_near(destination.xy, context, FLOOR_FARTHEST_M if look else PLACE_TOLERANCE_M)
    if end_xy is not None:
        doing = onward(subject_of("", destination.xy))
        option = option_on_way(end_xy, context, ledger.looked_xy, doing=doing)
        if option is not None:
            yield option
    if final is None:
        final = (_seeing_into if look else _standing)(destination.xy, context)
        if final is not None:
            yield _goal(destination, final, context)


def nearest_reachable_m(xy: tuple[float, float], context: PlanningContext) -> float:
    """Distance in metres from a place to the nearest reachable cell, infinity without any."""
    cells = np.argwhere(context.reachable)
    away = np.hypot(*(context.costmap.grid.centres(cells) - np.asarray(xy)).T)
    return float(away.min(initial=np.inf))


def _outside_m(xy: tuple[float, float], context: PlanningContext) -> float:
    """Metres from a place to the box around what the map knows; 0 inside."""
    x_min, y_min, x_max, y_max = context.map_view.grid.bounds_m
    x, y = xy
    return float(np.hypot(max(x_min - x, x - x_max, 0.0), max(y_min - y, y - y_max, 0.0)))


def _known(xy: tuple[float, float], context: PlanningContext) -> bool:
    costmap, cell = context.costmap, context.cell_at(xy)
    if not costmap.grid.contains(cell):
        return False
    return bool(costmap.free[tuple(cell)] | costmap.occupied[tuple(cell)])


def _standing(xy: tuple[float, float], context: PlanningContext) -> I64 | None:
    """The reachable cell (2,) nearest to a place, within the tolerance; None without any.

    No obstacle lies between, so that the robot does not stop behind a wall; except for the
    obstacle that a place is in.
    """
    costmap, grid, cell = context.costmap, context.costmap.grid, context.cell_at(xy)
    if not grid.contains(cell):
        return None
    own = (distance_cells(grid, cell) <= BLUR_CELLS) & ~costmap.free[tuple(cell)]
    cells = np.argwhere(context.reachable)
    away_m = np.hypot(*(grid.centres(cells) - np.asarray(xy)).T)
    near = np.flatnonzero(away_m <= PLACE_TOLERANCE_M)
    for index in near[np.argsort(away_m[near], kind="stable")]:
        if line_is_clear(~costmap.occupied | own, cells[index], cell):
            found: I64 = cells[index]
            return found
    return None


def _seeing(xy: tuple[float, float], context: PlanningContext, tried_xy: F64) -> I64 | None:
    """The cheapest reachable cell (2,) from which a known place is in sight; None without any."""
    if not _known(xy, context):
        return None
    tried = context.costmap.grid.cells(tried_xy)
    return first_visible(_around(xy, context, (PLACE_NEAREST_M, FLOOR_FARTHEST_M), tried))


def _seeing_into(xy: tuple[float, float], context: PlanningContext) -> I64 | None:
    """The reachable cell (2,) near a place from which the least hides it; None without any."""
    if not context.costmap.grid.contains(context.cell_at(xy)):
        return None
    return least_occluded(_around(xy, context, (PLACE_NEAREST_M, INTO_M)))


def _around(
    xy: tuple[float, float],
    context: PlanningContext,
    band_m: tuple[float, float],
    tried: I64 = NO_CELLS,
) -> Viewpoints:
    """Viewpoints around a place, not near tried ones (T, 2).

    What is unknown hides it, except around the robot.
    """
    costmap, grid = context.costmap, context.costmap.grid
    here_m = distance_cells(grid, context.cell_at(context.pose.xy)) * grid.cell_size_m
    beneath = here_m <= context.params.escape_radius_m
    opaque = replace(costmap, occupied=costmap.occupied | ~(costmap.free | beneath))
    target = SightTarget(context.cell_at(xy)[None])
    return viewpoints_around(target, replace(context, costmap=opaque), band_m, tried=tried)


def _goal(destination: Destination, cell: I64, context: PlanningContext) -> Goal:
    viewpoint_xy = context.xy_of(cell)
    x, y = cell.tolist()
    utility = GoalUtility(0.0, context.cost_to_go.length_m((x, y)))
    look = destination.kind is SearchKind.LOOK_AT
    doing = driving(subject_of("", destination.xy), look=look, where="{where}")
    kind = GoalKind.LOOK_AT if look else GoalKind.GO_TO
    return Goal(kind, viewpoint_xy, destination.xy, utility, doing)
