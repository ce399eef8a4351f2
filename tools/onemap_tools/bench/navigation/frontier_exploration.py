"""Exploration of the baselines: drive to frontiers, ranked by a rule.

A frontier counts as visited when the robot stood there for ``linger_s`` or needed too long, as in
OneMap's own exploration. Without any left for ``settle_s`` all of them, and rejected candidates,
are tried once more; then the object counts as not found.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from onemap_planner.motion.pure_pursuit import arrived
from onemap_planner.policy.context import PlanningContext
from onemap_planner.policy.goals import SAME_GOAL_M, Goal, GoalCandidates, frontier_goals
from onemap_planner.policy.memory import (
    LINGER_S,
    SETTLE_S,
    ActiveGoal,
    PlannerState,
    TargetMemory,
)
from onemap_planner.policy.outcome import Move
from onemap_planner.search.phases import Event, Exhausted
from onemap_planner.world.costmap import distance_cells
from onemap_planner.world.frontiers import find_frontiers

VALUE_RADIUS_M = 0.5  # as the authors' code


@dataclass(frozen=True, slots=True)
class FrontierExploration:
    """rank: the higher, the better a goal; margin: by how much another goal must rank higher than
    the present one to replace it."""

    rank: Callable[[Goal, PlanningContext], float]
    margin: float

    def __call__(self, state: PlannerState, context: PlanningContext) -> Move:
        """See ``Exploration``."""
        memory, now_s = state.memory, state.active_time_s
        _give_up_finished(state)
        candidates = GoalCandidates(find_frontiers(context.map_view, context.costmap))
        goals = [
            goal
            for goal in frontier_goals(candidates.frontiers, context.costmap, context.cost_to_go)
            if not state.is_given_up(goal)
        ]
        if not goals:
            return Move(event=_idle(state), candidates=candidates)
        goal = self._choose(goals, state, context)
        motion = context.drive_to(goal.viewpoint_xy, goal.look_xy)
        there = arrived(motion, context.pose)
        memory.active_goal = _active(state, goal).at(now_s, arrived=there)
        memory.idle_since_s = None
        return Move(motion, candidates=candidates)

    def _choose(self, goals: list[Goal], state: PlannerState, context: PlanningContext) -> Goal:
        ranks = [self.rank(goal, context) for goal in goals]
        best = int(np.argmax(ranks))
        active = state.memory.active_goal
        if active is None:
            return goals[best]
        place = active.goal.look_xy
        same = [i for i, g in enumerate(goals) if g.looks_at(place, SAME_GOAL_M)]
        if not same:
            return goals[best]
        kept = max(same, key=lambda i: ranks[i])
        return goals[kept] if ranks[best] <= ranks[kept] + self.margin else goals[best]


def nearness(goal: Goal, _: PlanningContext) -> float:
    """Rank by the path to the goal, metres: the nearest first."""
    return -goal.utility.travel_m


def frontier_value(goal: Goal, context: PlanningContext) -> float:
    """Rank by the highest value within ``VALUE_RADIUS_M`` of the frontier, as VLFM; 0: none."""
    grid = context.map_view.grid
    away = distance_cells(grid, grid.cells(np.asarray(goal.look_xy))) * grid.cell_size_m
    values = context.map_view.similarity[away <= VALUE_RADIUS_M]
    return float(np.nan_to_num(values, nan=0.0).max(initial=0.0))


NEAREST_FRONTIER = FrontierExploration(nearness, margin=float("inf"))
VLFM = FrontierExploration(frontier_value, margin=0.005)  # 0.01 of the cosine, as the authors'


def _give_up_finished(state: PlannerState) -> None:
    active, now_s = state.memory.active_goal, state.active_time_s
    if active is None:
        return
    visited = active.arrived_s is not None and now_s - active.arrived_s >= LINGER_S
    if visited or now_s - active.since_s > active.budget_s:
        state.give_up(active.goal)


def _active(state: PlannerState, goal: Goal) -> ActiveGoal:
    active = state.memory.active_goal
    if active is not None and goal.looks_at(active.goal.look_xy, SAME_GOAL_M):
        return replace(active, goal=goal)
    return state.new_goal(goal)


def _idle(state: PlannerState) -> Event | None:
    memory, now_s = state.memory, state.active_time_s
    memory.active_goal = None
    if now_s - memory.idle_from_s(now_s) < SETTLE_S:
        return None
    if not memory.reconsidered:
        state.memory, state.visited_frontiers = TargetMemory(reconsidered=True), ()
        return None
    return Exhausted(f"no frontier is left on {state.known_m2:.0f} m²")
