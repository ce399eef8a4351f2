"""What was spent on a goal counts when the robot comes back to it."""

from __future__ import annotations

from dataclasses import replace

import pytest

from onemap_planner.policy.goals import Goal, GoalKind, GoalUtility
from onemap_planner.policy.left_goals import MAX_LEFT, RETURN_PART, spent_before_s, with_left
from onemap_planner.policy.state import ActiveGoal, LeftGoal, PlannerState, TargetState
from tests.planner.drawn_maps import PARAMS
from tests.planner.one_room import SEARCH

PAUSE_S = RETURN_PART * PARAMS.explore.goal_base_s


def goal(x: float, kind: GoalKind = GoalKind.FRONTIER) -> Goal:
    return Goal(kind, (x, 0.0), (x, 0.5), GoalUtility.of(0.2, 1.0, PARAMS.goal), "test")


def state_with(active: Goal | None, *left: LeftGoal, now_s: float = 10.0) -> PlannerState:
    active_goal = None if active is None else ActiveGoal(active, 4.0, 20.0, active.look_xy)
    return PlannerState(
        SEARCH, TargetState(active_goal=active_goal, left=left), active_time_s=now_s
    )


def left_after(state: PlannerState, wanted: Goal) -> tuple[LeftGoal, ...]:
    return with_left(state, ActiveGoal(wanted, 10.0, 20.0, wanted.look_xy), PARAMS.goal)


def test_a_goal_that_another_is_preferred_to_is_kept_with_its_seconds() -> None:
    assert left_after(state_with(goal(0.0)), goal(5.0)) == (LeftGoal(goal(0.0), 6.0),)
    assert left_after(state_with(goal(0.0)), goal(0.2)) == ()  # the same, elsewhere
    assert left_after(state_with(None), goal(5.0)) == ()


def test_a_goal_is_kept_once_and_few_are() -> None:
    again = left_after(state_with(goal(0.0), LeftGoal(goal(0.1), 2.0)), goal(5.0))
    assert again == (LeftGoal(goal(0.0), 6.0),)
    many = tuple(LeftGoal(goal(10.0 + 2 * i), 1.0) for i in range(MAX_LEFT))
    assert left_after(state_with(goal(0.0), *many), goal(5.0)) == (
        *many[1:],
        LeftGoal(goal(0.0), 6.0),
    )


@pytest.mark.parametrize(
    ("wanted", "spent_s"),
    [
        (goal(0.3), 6.0 + PAUSE_S),
        (goal(3.0), 0.0),
        (goal(0.0, GoalKind.REGION), 0.0),
    ],
)
def test_coming_back_costs_what_was_spent_and_a_part_more(wanted: Goal, spent_s: float) -> None:
    state = state_with(goal(5.0), LeftGoal(goal(0.0), 6.0))
    assert spent_before_s(state, wanted, PARAMS) == pytest.approx(spent_s)


def test_two_goals_that_take_turns_are_over_after_a_few_returns() -> None:
    state, turns = state_with(goal(0.0), now_s=5.0), 0
    budget_s = PARAMS.explore.goal_base_s
    while turns < 20:
        turns += 1
        wanted = goal(5.0 * (turns % 2))
        spent_s = spent_before_s(state, wanted, PARAMS)
        if spent_s > budget_s:
            break
        active = ActiveGoal(wanted, state.active_time_s - spent_s, budget_s, wanted.look_xy)
        left = with_left(state, active, PARAMS.goal)
        target_state = replace(state.target_state, active_goal=active, left=left)
        state = replace(state, target_state=target_state, active_time_s=state.active_time_s + 1.0)
    assert turns < 10
