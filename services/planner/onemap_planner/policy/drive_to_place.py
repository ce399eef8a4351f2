"""Drive to a place, or to where it can be seen, on known floor only."""

from __future__ import annotations

from math import cos, hypot, sin

import numpy as np

from onemap_planner.motion.motions import Pose2d
from onemap_planner.motion.pure_pursuit import arrived
from onemap_planner.policy.context import PlanningContext
from onemap_planner.policy.goals import Goal, GoalKind, explain_goal
from onemap_planner.policy.memory import SETTLE_S, ActiveGoal, PlannerState
from onemap_planner.policy.outcome import Move
from onemap_planner.policy.ways import nearest_reachable_m, place_goals, visit_counts
from onemap_planner.search.events import DestinationReached, Exhausted
from onemap_planner.search.phases import Destination
from onemap_shared.messages import SearchKind, subject_of

SAME_VIEWPOINT_M = 0.3  # a viewpoint that moves less between two maps, by three cells, is the same
FACED_FROM_M = 0.25  # nearer to the place the robot stands on it and faces nothing


def drive_to_place(state: PlannerState, destination: Destination, context: PlanningContext) -> Move:
    """Drive to the best goal; without one for ``SETTLE_S`` the drive has failed."""
    memory, now_s = state.memory, state.active_time_s
    state.give_up_finished()
    goal = _select(state, destination, context)
    if goal is None:
        memory.active_goal = None
        waits = now_s - memory.idle_from_s(now_s) < SETTLE_S
        return Move(event=None if waits else Exhausted(_failure(destination, context)))
    motion = context.drive_to(goal.viewpoint_xy, _look_xy(goal, context.pose))
    active = _activated(state, goal)
    if memory.is_new(active):
        state.search = explain_goal(state.search, goal, [goal])
    there = arrived(motion, context.pose)
    final = there and goal.kind is not GoalKind.FRONTIER
    memory.active_goal = active.at(now_s, arrived=there and not final)
    memory.idle_since_s = None
    event = DestinationReached(_arrival(destination, context.pose)) if final else None
    return Move(motion, event)


def _select(state: PlannerState, destination: Destination, context: PlanningContext) -> Goal | None:
    """The best goal that was not given up; a frontier is given up by its visits."""
    goals = place_goals(destination, context, visit_counts(context, state.visited_frontiers))
    fresh = (g for g in goals if g.kind is GoalKind.FRONTIER or not state.is_given_up(g))
    return next(fresh, None)


def _look_xy(goal: Goal, pose: Pose2d) -> tuple[float, float]:
    """What the robot faces at the goal: it keeps its heading where it stands on the place."""
    if goal.kind is GoalKind.GO_TO and goal.looks_at(goal.viewpoint_xy, FACED_FROM_M):
        return pose.x_m + cos(pose.yaw_rad), pose.y_m + sin(pose.yaw_rad)
    return goal.look_xy


def _activated(state: PlannerState, goal: Goal) -> ActiveGoal:
    """The active goal: the present one while its viewpoint stays, else a new one."""
    active = state.memory.active_goal
    if active is not None and active.goal.kind is goal.kind:
        (x, y), (old_x, old_y) = goal.viewpoint_xy, active.goal.viewpoint_xy
        if hypot(x - old_x, y - old_y) <= SAME_VIEWPOINT_M:
            return active
    return state.new_goal(goal)


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
    return f"{subject_of('', destination.xy)} cannot be {done}: no way leads there; {nearest}"
