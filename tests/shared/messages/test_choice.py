"""What a choice of goals may hold."""

from __future__ import annotations

import dataclasses

import pytest

from onemap_shared.messages import MAX_GOAL_OPTIONS, GoalChoice, GoalOption

OPTION = GoalOption("frontier", (1.0, 2.0), 0.4, 2.5, 0.3, chosen=True)


def test_the_numbers_of_an_option_are_finite() -> None:
    with pytest.raises(ValueError, match="all must be finite"):
        dataclasses.replace(OPTION, utility=float("nan"))


def test_a_choice_is_bounded() -> None:
    assert GoalChoice(options=(OPTION,) * MAX_GOAL_OPTIONS).left_out == 0
    with pytest.raises(ValueError, match="6 options; at most 5"):
        GoalChoice(options=(OPTION,) * (MAX_GOAL_OPTIONS + 1))
