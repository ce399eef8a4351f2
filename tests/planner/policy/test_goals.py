"""The goal of the highest utility is selected; the current one is kept within hysteresis."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from onemap_planner.policy.goals import Goal, GoalKind, GoalUtility, select_goal
from tests.planner.drawn_maps import PARAMS


def goal(total: float, x: float = 0.0, kind: GoalKind = GoalKind.FRONTIER) -> Goal:
    return Goal(kind, (x, 0.0), (x, 0.0), GoalUtility(total, 0.0, 0.0, 0.0), "")


def test_the_best_is_chosen() -> None:
    assert select_goal([goal(0.1), goal(0.4, 5.0), goal(0.2, 9.0)], None, PARAMS.goal) == goal(
        0.4, 5.0
    )
    assert select_goal([], goal(1.0), PARAMS.goal) is None


def test_the_current_goal_is_kept_unless_another_is_clearly_better() -> None:
    current = goal(0.3, 1.0)
    today = goal(0.3, 1.2)
    assert select_goal([today, goal(0.38, 5.0)], current, PARAMS.goal) == today
    assert select_goal([today, goal(0.45, 5.0)], current, PARAMS.goal) == goal(0.45, 5.0)
    assert select_goal([goal(0.1, 5.0)], current, PARAMS.goal) == goal(0.1, 5.0)  # it is gone


@given(st.lists(st.tuples(st.floats(0, 1), st.floats(-9, 9)), min_size=1, max_size=8), st.data())
def test_the_choice_does_not_depend_on_the_order(
    values: list[tuple[float, float]], data: st.DataObject
) -> None:
    goals = [goal(u, x) for u, x in values]
    shuffled = data.draw(st.permutations(goals))
    assert select_goal(goals, None, PARAMS.goal) == select_goal(shuffled, None, PARAMS.goal)


def test_utility_adds_up() -> None:
    utility = GoalUtility(score=0.5, size_bonus=0.1, travel_m=5.0, travel_penalty=0.2)
    assert utility.total == pytest.approx(0.4)
