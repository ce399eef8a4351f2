"""Which goal is the best, which candidate is approached, and when goals are compared again.

Comparing goals takes time in proportion to the known area. Beyond the size of a flat it is
therefore done less often, and the steps between look at the map around the way only: planning
takes about the same share of a processor in a hall as in a flat.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from onemap_planner.motion.motions import Drive
from onemap_planner.policy.arrival import ArrivalState, arrive
from onemap_planner.policy.context import PlanningContext
from onemap_planner.policy.evidence import agreed
from onemap_planner.policy.goals import SAME_GOAL_M, Goal, successor
from onemap_planner.policy.outcome import Observation
from onemap_planner.policy.state import ActiveGoal, GoalComparison, PlannerState
from onemap_planner.policy.tell import explain_goal
from onemap_planner.search.state_machine import CandidateSelected, Exploring
from onemap_planner.world.candidates import MIN_SIGHTINGS
from onemap_shared.geometry import F64

# Part of the current goal's utility by which another must exceed it to replace it: what turning
# round costs, and borders change with every view.
HYSTERESIS = 0.3
EVERY_STEP_M2 = 200.0  # known area up to which every step compares all goals: a large flat
COMPARE_S_PER_M2 = 0.0025  # beyond it: 2 s for 1000 m2, in which a robot drives a metre
AROUND_M = 3.0  # of the way; obstacles farther than the inflation radius cost it nothing


def select_candidate(state: PlannerState, context: PlanningContext) -> CandidateSelected | None:
    """The event that selects a candidate seen often enough and reachable, if there is one.

    One that was more often detected under another name does not count.
    """
    for candidate in agreed(state):
        often = candidate.sightings >= candidate.contradictions
        if often and state.ledger.next_viewpoint(candidate, context) is not None:
            return CandidateSelected(candidate)
    return None


def choose(options: Iterable[Goal], current: Goal | None) -> Goal | None:
    """The best option; the current goal's new version unless the best exceeds it by hysteresis."""
    ranked = sorted(options, key=lambda goal: (-goal.utility.total, goal.look_xy))
    if not ranked:
        return None
    best = ranked[0]
    if current is None:
        return best
    same = successor(ranked, current)
    if same is not None and best.utility.total < same.utility.total * (1 + HYSTERESIS):
        return same
    return best


def activated(state: PlannerState, goal: Goal) -> ActiveGoal:
    """The active goal: the present one if the goal is the same, else a new one.

    A goal that recedes, as the end of a corridor does, gets a new budget once it is elsewhere.
    """
    active = state.active_goal
    if (
        active is not None
        and successor([goal], active.goal) is not None
        and goal.looks_at(active.budget_xy, 2 * SAME_GOAL_M)
    ):
        return replace(active, goal=goal)
    return state.new_goal(goal)


def head_for(
    state: PlannerState,
    goal: Goal,
    options: Sequence[Goal],
    context: PlanningContext,
    look_xy: tuple[float, float],
) -> tuple[ArrivalState, Drive]:
    """Drive to the goal chosen among the options, face ``look_xy`` (metres) there, and say why.

    A goal that the robot comes no nearer to, without the view, is given up: the next step takes
    another.
    """
    at, motion = arrive(context.drive_to(goal.viewpoint_xy, look_xy), context)
    if at is ArrivalState.NO_VIEW:
        state.give_up(goal)
        return at, motion
    active, around = activated(state, goal), state.landmarks(context)
    state.search = explain_goal(state.search, goal, options, around, new=state.is_new(active))
    state.active_goal = active.at(state.active_time_s, arrived=at is ArrivalState.THERE)
    state.idle_since_s = None
    return at, motion


def follow_window(state: PlannerState, observation: Observation) -> F64 | None:
    """Corners (2, 2) in metres of the part of the map that this step needs; None: all of it.

    All of it is needed to compare goals, for detections, and to approach a candidate.
    """
    active = state.active_goal
    if active is None or active.comparison is None or observation.pose is None:
        return None
    if active.arrived_s is not None or not isinstance(state.search.phase, Exploring):
        return None
    if _is_over(state, active, active.comparison):
        return None
    if any(found.names for found in observation.detections) or any(
        candidate.sightings >= MIN_SIGHTINGS for candidate in state.evidence.candidates
    ):
        return None
    here = (*observation.pose.xy, 0.0)
    if any(candidate.distance_m(here) <= AROUND_M for candidate in state.evidence.unsupported):
        return None  # a frame without a detection of it counts against it
    corners = np.vstack([active.comparison.corners_xy, observation.pose.xy])
    return np.stack([corners.min(axis=0) - AROUND_M, corners.max(axis=0) + AROUND_M])


def _is_over(state: PlannerState, active: ActiveGoal, comparison: GoalComparison) -> bool:
    """Whether the goals are to be compared again, or the time for this one is over."""
    now_s = state.active_time_s
    period_s = COMPARE_S_PER_M2 * max(state.known_m2 - EVERY_STEP_M2, 0.0)
    return now_s - comparison.at_s >= period_s or now_s - active.since_s > active.budget_s


def can_follow(state: PlannerState, context: PlanningContext) -> bool:
    """Whether a path leads to the active goal within this part of the map."""
    active = state.active_goal
    if active is None:
        return False
    cell = context.cell_at(active.goal.viewpoint_xy)
    inside = bool(context.costmap.grid.contains(cell))
    return inside and bool(np.isfinite(context.cost_to_go.cost_m[tuple(cell)]))
