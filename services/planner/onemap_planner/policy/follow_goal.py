"""Following a goal between two comparisons of all goals.

Comparing goals takes time in proportion to the known area. Beyond the size of a flat it is
therefore done less often, and the steps between look at the map around the way only: planning
takes about the same share of a processor in a hall as in a flat.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from onemap_planner.motion.motions import Motion, Rest
from onemap_planner.motion.pure_pursuit import arrived
from onemap_planner.policy.context import PlanningContext
from onemap_planner.policy.goals import GoalCandidates
from onemap_planner.policy.params import PlannerParams
from onemap_planner.policy.state import ActiveGoal, GoalComparison, Observation, PlannerState
from onemap_planner.search.phases import Exploring
from onemap_shared.geometry import F64

EVERY_STEP_M2 = 200.0  # known area up to which every step compares all goals: a large flat
COMPARE_S_PER_M2 = 0.0025  # beyond it: 2 s for 1000 m2, in which a robot drives a metre
AROUND_M = 3.0  # of the way; obstacles farther than the inflation radius cost it nothing


def follow_window(
    state: PlannerState, observation: Observation, params: PlannerParams
) -> F64 | None:
    """Corners (2, 2) in metres of the part of the map that this step needs; None: all of it.

    All of it is needed to compare goals, for detections, and to approach a candidate.
    """
    active_goal = state.target_state.active_goal
    if active_goal is None or active_goal.comparison is None or observation.pose is None:
        return None
    if active_goal.arrived_s is not None or not isinstance(state.search.phase, Exploring):
        return None
    if _is_over(state, active_goal, active_goal.comparison):
        return None
    least = params.consensus.min_sightings
    if any(found.names for found in observation.detections) or any(
        candidate.sightings >= least for candidate in state.target_state.candidates
    ):
        return None
    here = (*observation.pose.xy, 0.0)
    if any(candidate.distance_m(here) <= AROUND_M for candidate in state.target_state.disputed):
        return None  # a frame without a detection of it counts against it
    corners = np.vstack([active_goal.comparison.corners_xy, observation.pose.xy])
    return np.stack([corners.min(axis=0) - AROUND_M, corners.max(axis=0) + AROUND_M])


def can_follow(state: PlannerState, context: PlanningContext) -> bool:
    """Whether a path leads to the active goal within this part of the map."""
    active_goal = state.target_state.active_goal
    if active_goal is None:
        return False
    grid = context.costmap.grid
    cell = grid.cells(np.asarray(active_goal.goal.viewpoint_xy))
    inside = bool(grid.contains(cell))
    return inside and bool(np.isfinite(context.cost_to_go.cost_m[cell[0], cell[1]]))


def follow_goal(
    state: PlannerState, context: PlanningContext, params: PlannerParams
) -> tuple[PlannerState, Motion, GoalCandidates]:
    """Drive on to the active goal, which ``can_follow``."""
    active_goal = state.target_state.active_goal
    if active_goal is None or active_goal.comparison is None:
        return state, Rest(), GoalCandidates()
    goal, comparison = active_goal.goal, active_goal.comparison
    motion = context.drive_to(goal.viewpoint_xy, goal.look_xy)
    if arrived(motion, context.pose, params.drive):
        active_goal = replace(active_goal, arrived_s=state.active_time_s)
    target_state = replace(state.target_state, active_goal=active_goal)
    return replace(state, target_state=target_state), motion, comparison.candidates


def _is_over(state: PlannerState, active_goal: ActiveGoal, comparison: GoalComparison) -> bool:
    """Whether the goals are to be compared again, or the time for this one is over."""
    now_s = state.active_time_s
    period_s = COMPARE_S_PER_M2 * max(state.known_m2 - EVERY_STEP_M2, 0.0)
    return now_s - comparison.at_s >= period_s or now_s - active_goal.since_s > active_goal.budget_s
