"""What the robot does in each phase of a search, and what that says of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import radians

import numpy as np

from onemap_planner.motion.motions import Rotate
from onemap_planner.policy.arrival import ArrivalState, arrive
from onemap_planner.policy.choose import choose, head_for, select_candidate
from onemap_planner.policy.context import PlanningContext
from onemap_planner.policy.displaced import stand_if_displaced
from onemap_planner.policy.drive_to_place import drive_to_place
from onemap_planner.policy.goals import GoalKind
from onemap_planner.policy.last_resorts import without_goal
from onemap_planner.policy.limits import is_trapped, stuck_failure
from onemap_planner.policy.offer import offer, search_areas
from onemap_planner.policy.outcome import Move
from onemap_planner.policy.state import ActiveGoal, PlannerState
from onemap_planner.policy.take_in import TakenIn
from onemap_planner.policy.verify import approach, confirm
from onemap_planner.search import state_machine as sm
from onemap_planner.sentences import leaving_zone
from onemap_planner.world.candidates import MERGE_M
from onemap_shared.messages import SearchState

# Known part of the 1 m circle below which the robot first looks around: one view shows 22 percent,
# in a corner 45 percent can be known.
KNOWN_AROUND = 0.4
OVERLAP_DEG = 10.0  # of the first and the last view of a look around: the error of the heading
# Chooses where to drive while no candidate is approached, as ``explore`` does.
Exploration = Callable[[PlannerState, PlanningContext], Move]


def next_move(state: PlannerState, taken: TakenIn, exploration: Exploration) -> Move:
    """What the robot does now: stand where it was put, leave a zone, or what the phase says."""
    context = taken.context
    move = stand_if_displaced(state) or leave_zone(state, context)
    if move is not None:
        return move
    move = _move_of_phase(state, taken, exploration)
    ends = isinstance(move.event, sm.Ending) and move.event.outcome is not SearchState.ARRIVED
    if ends and is_trapped(state, context.pose):  # nothing was searched: no goal could be reached
        return replace(move, event=stuck_failure(state))
    return move


def _move_of_phase(  # noqa: PLR0911
    state: PlannerState, taken: TakenIn, exploration: Exploration
) -> Move:
    context = taken.context
    match state.search.phase:
        case sm.Starting():
            seen_rad = radians(max(context.bands.camera.across_deg - OVERLAP_DEG, 0.0))
            return Move(event=sm.MapReady(context.known_fraction_around() < KNOWN_AROUND, seen_rad))
        case sm.LookingAround():
            return Move(Rotate(), select_candidate(state, context) or sm.Rotated(taken.turned_rad))
        case sm.Exploring() if not context.whole:
            return follow_goal(state, context)
        case sm.Exploring():
            selected = select_candidate(state, context)
            return Move(event=selected) if selected else exploration(state, context)
        case sm.Approaching() as phase:
            return approach(state, phase, context)
        case sm.Confirming() as phase:
            return confirm(state, phase, context)
        case sm.Driving(destination):
            return drive_to_place(state, destination, context)
        case _:
            return Move()


def explore(state: PlannerState, context: PlanningContext) -> Move:
    """Drive to the best goal; without one, look around, try once more, or end."""
    state.give_up_finished()
    areas = search_areas(context)
    options = offer(state, context, areas)
    goal = choose(options, state.active_goal.goal if state.active_goal else None)
    if goal is None:
        return replace(without_goal(state, context), areas=areas)
    at, motion = head_for(state, goal, options, context, goal.look_xy)
    if at is ArrivalState.NO_VIEW or state.active_goal is None:
        return Move(areas=areas)
    state.active_goal = state.active_goal.compared(motion, areas, state.active_time_s)
    return Move(motion, _unsupported_reached(state, state.active_goal), areas)


def _unsupported_reached(state: PlannerState, active: ActiveGoal) -> sm.CandidateSelected | None:
    """Selects the candidate without the map's support that the robot has come to look at."""
    if active.goal.kind is not GoalKind.DETECTION or active.arrived_s is None:
        return None
    there = (c for c in state.evidence.unsupported if active.goal.looks_at(c.xyz[:2], MERGE_M))
    return next((sm.CandidateSelected(candidate) for candidate in there), None)


def follow_goal(state: PlannerState, context: PlanningContext) -> Move:
    """Drive on to the active goal, which ``can_follow``."""
    active = state.active_goal
    if active is None or active.comparison is None:
        return Move()
    areas, goal = active.comparison.areas, active.goal
    at, motion = arrive(context.drive_to(goal.viewpoint_xy, goal.look_xy), context)
    if at is ArrivalState.NO_VIEW:
        state.give_up(goal)
        return Move(areas=areas)
    there = at is ArrivalState.THERE
    state.active_goal = active.at(state.active_time_s, arrived=there)
    return Move(motion, areas=areas)


WITHIN_M = 0.005  # a robot that reaches less far into a zone has not entered it: rounding


def leave_zone(state: PlannerState, context: PlanningContext) -> Move | None:
    """Drive out of the zone that the robot stands in, by the shortest way; None if it is in none.

    Without a known way out it goes on as usual, where it stands: it may have to look around first.
    """
    keep_out, here = context.costmap.keep_out, np.array([context.pose.xy])
    radius_m = context.params.radius_m
    if keep_out is None or keep_out.distances_m(here, radius_m)[0] >= radius_m - WITHIN_M:
        return None
    name = context.zones.at(context.pose.xy, radius_m, keep_out.grid.cell_size_m)
    cost_m = np.where(keep_out.closed, np.inf, context.cost_to_go.cost_m)
    end = np.array(np.unravel_index(int(np.argmin(cost_m)), cost_m.shape))
    known = bool(np.isfinite(cost_m[tuple(end)]))
    state.search = replace(sm.without_choice(state.search), slow=leaving_zone(name, known=known))
    if not known:
        return None
    state.active_goal = None
    end_xy = context.xy_of(end)
    ahead_xy = 2 * np.asarray(end_xy) - here[0]
    return Move(context.drive_to(end_xy, (float(ahead_xy[0]), float(ahead_xy[1]))))
