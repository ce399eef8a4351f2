from __future__ import annotations

from dataclasses import replace

import pytest

from onemap_ros2.drive.driver import GoalPose
from onemap_ros2.drive.nav2 import ANSWER_S, RETRY_S, GoalPhase, GoalResult, Heard, NavGoal, Order

A, B = GoalPose(1.0, 0.0, 0.0), GoalPose(5.0, 0.0, 0.0)
QUIET = Heard()


def driving(target: GoalPose = A) -> NavGoal:
    goal, order = NavGoal().step(0.0, target, QUIET)
    assert order is Order.SEND
    goal, order = goal.step(0.1, target, Heard(accepted=True))
    assert (goal.phase, order) == (GoalPhase.DRIVING, Order.NOTHING)
    return goal


def test_nothing_is_sent_without_a_wish_or_a_server() -> None:
    assert NavGoal().step(0.0, None, QUIET) == (NavGoal(), Order.NOTHING)
    assert NavGoal().step(0.0, A, Heard(served=False)) == (NavGoal(), Order.NOTHING)


def test_a_goal_that_holds_is_sent_once() -> None:
    goal = driving()
    for step in range(100):
        goal, order = goal.step(0.2 + step, A, QUIET)
        assert order is Order.NOTHING


def test_a_goal_that_moves_is_replaced_but_not_more_often_than_the_period() -> None:
    goal = driving()
    assert goal.step(0.5, B, QUIET)[1] is Order.NOTHING
    goal, order = goal.step(1.1, B, QUIET)
    assert (order, goal.phase, goal.replaces) == (Order.SEND, GoalPhase.ASKING, True)


def test_no_wish_cancels_until_nav2_says_that_it_ended() -> None:
    goal, order = driving().step(1.0, None, QUIET)
    assert (goal.phase, order) == (GoalPhase.CANCELLING, Order.CANCEL)
    assert goal.step(1.1, A, Heard(cancel_code=0)) == (goal, Order.NOTHING)
    again, order = goal.step(1.1 + ANSWER_S, A, QUIET)
    assert (again.phase, order) == (GoalPhase.CANCELLING, Order.CANCEL)
    ended, order = again.step(3.2, None, Heard(result=GoalResult(5)))
    assert (ended.phase, order) == (GoalPhase.NONE, Order.NOTHING)


@pytest.mark.parametrize("code", [2, 3])
def test_what_nav2_does_not_know_needs_no_cancelling(code: int) -> None:
    goal, _ = driving().step(1.0, None, QUIET)
    assert goal.step(1.1, None, Heard(cancel_code=code))[0].phase is GoalPhase.NONE


def test_a_cancellation_that_is_rejected_is_asked_for_again() -> None:
    goal, _ = driving().step(1.0, None, QUIET)
    goal, order = goal.step(1.1, None, Heard(cancel_code=1))
    assert (goal.phase, order) == (GoalPhase.CANCELLING, Order.NOTHING)
    assert goal.step(3.2, None, QUIET)[1] is Order.CANCEL


def test_while_it_cancels_nothing_is_sent_even_without_a_link() -> None:
    goal, _ = driving().step(1.0, None, QUIET)
    for step in range(50):
        goal, order = goal.step(1.1 + step, B, Heard(served=False))
        assert order is not Order.SEND
        assert goal.phase is GoalPhase.CANCELLING


@pytest.mark.parametrize("heard", [Heard(accepted=False), Heard(accepted=True)])
def test_a_goal_that_was_refused_or_ended_is_sent_again_later(heard: Heard) -> None:
    goal, _ = NavGoal().step(0.0, A, QUIET)
    goal, order = goal.step(0.1, A, heard)
    if heard.accepted:
        goal, order = goal.step(0.2, A, Heard(result=GoalResult(6)))
    assert (goal.phase, order) == (GoalPhase.NONE, Order.NOTHING)
    assert goal.step(2.0, A, QUIET)[1] is Order.NOTHING
    assert goal.step(0.3 + RETRY_S, A, QUIET)[1] is Order.SEND
    assert goal.step(1.3, B, QUIET)[1] is Order.SEND  # another one need not wait


def test_a_goal_without_an_answer_is_cancelled() -> None:
    goal, _ = NavGoal().step(0.0, A, QUIET)
    assert goal.step(1.0, A, QUIET)[1] is Order.NOTHING
    goal, order = goal.step(ANSWER_S + 0.1, A, QUIET)
    assert (goal.phase, order) == (GoalPhase.CANCELLING, Order.CANCEL)


def test_a_goal_that_was_refused_leaves_the_one_before_which_is_cancelled() -> None:
    goal, _ = driving().step(2.0, B, QUIET)
    goal, order = goal.step(2.1, B, Heard(accepted=False))
    assert (goal.phase, order) == (GoalPhase.CANCELLING, Order.CANCEL)


def test_a_lost_link_cancels() -> None:
    goal, order = driving().step(1.0, A, Heard(lost=True))
    assert (goal.phase, order) == (GoalPhase.CANCELLING, Order.CANCEL)


def test_whatever_is_heard_a_goal_is_never_sent_while_another_may_drive() -> None:
    """All sequences of four events: before each goal the one before was accepted or ended."""
    events = [
        QUIET,
        Heard(accepted=True),
        Heard(accepted=False),
        Heard(result=GoalResult(4)),
        Heard(lost=True),
        Heard(cancel_code=0),
    ]
    states = {NavGoal(): 0}
    for _ in range(4):
        found = {}
        for goal, step in states.items():
            for heard in events:
                for wanted in (A, B, None):
                    now_s = step * 10.0
                    after, order = goal.step(now_s, wanted, heard)
                    if order is Order.SEND:
                        assert goal.phase in (GoalPhase.NONE, GoalPhase.DRIVING)
                        assert wanted is not None
                    if goal.phase is GoalPhase.DRIVING and wanted is None:
                        assert order is Order.CANCEL or after.phase is GoalPhase.NONE
                    found[replace(after)] = step + 1
        states = found
