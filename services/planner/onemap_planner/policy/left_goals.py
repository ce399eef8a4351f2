"""Goals that were left for others before their time was over.

Two goals may take turns for ever: one that is seen only from some places is preferred there and
gone elsewhere. What was spent on a goal is therefore kept when another one is preferred, and each
return costs a part of its time.
"""

from __future__ import annotations

from onemap_planner.policy.goals import Goal, GoalParams, successor
from onemap_planner.policy.params import PlannerParams
from onemap_planner.policy.state import ActiveGoal, LeftGoal, PlannerState

MAX_LEFT = 8  # goals; more do not take turns
RETURN_PART = 1 / 3  # of the base time: a goal that comes and goes has three visits


def with_left(
    state: PlannerState, active_goal: ActiveGoal, params: GoalParams
) -> tuple[LeftGoal, ...]:
    """The goals that were left, with the present one if ``active_goal`` replaces it."""
    left, before = state.target_state.left, state.target_state.active_goal
    if before is None or successor([active_goal.goal], before.goal, params) is not None:
        return left
    others = tuple(each for each in left if not _same(each.goal, before.goal, params))
    return (*others, LeftGoal(before.goal, state.active_time_s - before.since_s))[-MAX_LEFT:]


def spent_before_s(state: PlannerState, goal: Goal, params: PlannerParams) -> float:
    """Seconds that count as spent on a goal that is taken up (again)."""
    for each in state.target_state.left:
        if _same(each.goal, goal, params.goal):
            return each.spent_s + RETURN_PART * params.explore.goal_base_s
    return 0.0


def _same(a: Goal, b: Goal, params: GoalParams) -> bool:
    return a.kind is b.kind and a.looks_at(b.look_xy, params.same_goal_m)
