"""Drive to a place, or to where it can be seen, on known floor only."""

from __future__ import annotations

from dataclasses import replace
from math import cos, hypot, sin

import numpy as np

from onemap_planner.motion.motions import Motion, Pose2d, Rest
from onemap_planner.motion.pure_pursuit import arrived
from onemap_planner.policy.context import PlanningContext
from onemap_planner.policy.goals import Goal, GoalKind, explain_goal
from onemap_planner.policy.state import (
    BLACKLIST_RADIUS_M,
    GOAL_BASE_S,
    GOAL_S_PER_M,
    LINGER_S,
    SETTLE_S,
    ActiveGoal,
    PlannerState,
    abandon_finished,
    is_blacklisted,
    is_new_goal,
)
from onemap_planner.policy.ways import nearest_reachable_m, place_goals, visit_counts
from onemap_planner.search.events import DestinationReached, Event, Exhausted
from onemap_planner.search.phases import Destination
from onemap_shared.messages import SearchKind, subject_of

SAME_VIEWPOINT_M = 0.3  # a viewpoint that moves less between two maps, by three cells, is the same
FACED_FROM_M = 0.25  # nearer to the place the robot stands on it and faces nothing


def drive_to_place(
    state: PlannerState, destination: Destination, context: PlanningContext
) -> tuple[PlannerState, Motion, Event | None]:
    """Drive to the best goal; without one for ``settle_s`` the drive has failed."""
    state = abandon_finished(state, LINGER_S)
    goal = _select(state, destination, context)
    if goal is None:
        return _without_goal(state, destination, context)
    motion = context.drive_to(goal.viewpoint_xy, _look_xy(goal, context.pose))
    active_goal = _activate(state, goal)
    if is_new_goal(state, active_goal):
        state = replace(state, search=explain_goal(state.search, goal, [goal]))
    event: Event | None = None
    if arrived(motion, context.pose):
        if goal.kind is not GoalKind.FRONTIER:
            event = DestinationReached(_arrival(destination, context.pose))
        elif active_goal.arrived_s is None:
            active_goal = replace(active_goal, arrived_s=state.active_time_s)
    target_state = replace(state.target_state, active_goal=active_goal, idle_since_s=None)
    return replace(state, target_state=target_state), motion, event


def _select(state: PlannerState, destination: Destination, context: PlanningContext) -> Goal | None:
    """The best goal that was not given up; a frontier is given up by its visits."""
    visited_xy = np.array(state.blacklisted_frontiers, np.float64).reshape(-1, 2)
    visits = visit_counts(context, visited_xy, BLACKLIST_RADIUS_M)
    for goal in place_goals(destination, context, visits):
        given_up = is_blacklisted(state, goal, BLACKLIST_RADIUS_M)
        if goal.kind is GoalKind.FRONTIER or not given_up:
            return goal
    return None


def _look_xy(goal: Goal, pose: Pose2d) -> tuple[float, float]:
    """What the robot faces at the goal: it keeps its heading where it stands on the place."""
    if goal.kind is GoalKind.GO_TO and goal.looks_at(goal.viewpoint_xy, FACED_FROM_M):
        return pose.x_m + cos(pose.yaw_rad), pose.y_m + sin(pose.yaw_rad)
    return goal.look_xy


def _activate(state: PlannerState, goal: Goal) -> ActiveGoal:
    """The active goal: the present one while its viewpoint stays, else a new one."""
    active_goal = state.target_state.active_goal
    if active_goal is not None and active_goal.goal.kind is goal.kind:
        (x, y), (old_x, old_y) = goal.viewpoint_xy, active_goal.goal.viewpoint_xy
        if hypot(x - old_x, y - old_y) <= SAME_VIEWPOINT_M:
            return active_goal
    budget_s = GOAL_BASE_S + GOAL_S_PER_M * goal.utility.travel_m
    return ActiveGoal(goal, state.active_time_s, budget_s, goal.look_xy)


def _without_goal(
    state: PlannerState, destination: Destination, context: PlanningContext
) -> tuple[PlannerState, Motion, Event | None]:
    since_s = state.target_state.idle_since_s
    if since_s is None:
        since_s = state.active_time_s
    target_state = replace(state.target_state, active_goal=None, idle_since_s=since_s)
    state = replace(state, target_state=target_state)
    if state.active_time_s - since_s < SETTLE_S:
        return state, Rest(), None
    return state, Rest(), Exhausted(_failure(destination, context))


def _arrival(destination: Destination, pose: Pose2d) -> str:
    away_m, place = pose.distance_to(destination.xy), subject_of("", destination.xy)
    if destination.kind is SearchKind.LOOK_AT:
        return f"looking at {place} from {away_m:.2f} m"
    return f"standing {away_m:.2f} m from {place}"


def _failure(destination: Destination, context: PlanningContext) -> str:
    away_m = nearest_reachable_m(destination.xy, context)
    done = "seen" if destination.kind is SearchKind.LOOK_AT else "reached"
    nearest = (
        f"the nearest reachable point is {away_m:.1f} m from it"
        if np.isfinite(away_m)
        else "no floor around the robot is known to be free"
    )
    text = f"{subject_of('', destination.xy)} cannot be {done}: no way leads there; {nearest}"
    return text
