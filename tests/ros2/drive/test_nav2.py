from __future__ import annotations

import struct
from dataclasses import replace

import pytest

from onemap_ros2.cdr import FormatError
from onemap_ros2.drive.driver import GoalPose
from onemap_ros2.drive.nav2 import (
    ANSWER_S,
    RETRY_S,
    GoalPhase,
    GoalResult,
    Heard,
    NavGoal,
    Order,
    cancel_code,
    cancel_request,
    goal_request,
    is_accepted,
    read_feedback,
    read_result,
    read_under_way,
    result_request,
)

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


def test_a_goal_that_was_refused_leaves_the_one_before_which_is_cancelled() -> None:
    goal, _ = driving().step(2.0, B, QUIET)
    goal, order = goal.step(2.1, B, Heard(accepted=False))
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


HEAD = bytes((0, 1, 0, 0))
GOAL_ID = bytes(range(16))


def pose(x: float) -> bytes:
    body = struct.pack("<iII4s", 3, 7, 4, b"map\0")
    return body + struct.pack("<7d", x, 0, 0, 0, 0, 0, 1)


def test_a_goal_is_its_id_a_stamped_pose_and_an_empty_tree() -> None:
    golden = HEAD + GOAL_ID + pose(2.5) + struct.pack("<Ib", 1, 0)
    assert goal_request(GOAL_ID, GoalPose(2.5, 0.0, 0.0), 3_000_000_007, "map") == golden


def test_requests_for_a_result_and_a_cancellation() -> None:
    assert result_request(GOAL_ID) == HEAD + GOAL_ID
    assert cancel_request(GOAL_ID) == HEAD + GOAL_ID + bytes(8)


def test_a_result_with_and_without_a_text() -> None:
    jazzy = HEAD + struct.pack("<bxHI7s", 6, 9002, 7, b"no map\0")
    assert read_result(jazzy) == GoalResult(6, 9002, "no map")
    assert read_result(jazzy).sentence == "aborted, error 9002: no map"
    humble = HEAD + struct.pack("<bB", 4, 0)  # std_msgs/Empty
    assert read_result(humble) == GoalResult(4)
    assert read_result(humble).sentence == "reached"


def test_feedback_of_jazzy_and_with_what_lyrical_appends() -> None:
    body = GOAL_ID + pose(1.0) + struct.pack("<iIiIhxxf", 4, 0, 5, 0, 1, 2.5)
    assert read_feedback(HEAD + body) == (GOAL_ID, 2.5)
    assert read_feedback(HEAD + body + struct.pack("<2f", 0.1, 0.2)) == (GOAL_ID, 2.5)


def test_goals_that_are_under_way() -> None:
    other = bytes(16)
    entries = b"".join(
        goal_id + struct.pack("<iIbxxx", 1, 2, state)
        for goal_id, state in ((GOAL_ID, 2), (other, 4))
    )
    assert read_under_way(HEAD + struct.pack("<I", 2) + entries) == [GOAL_ID]


@pytest.mark.parametrize("read", [is_accepted, read_result, read_feedback, cancel_code])
def test_what_is_no_answer_is_refused(read: object) -> None:
    with pytest.raises(FormatError, match="bytes are no"):
        read(HEAD)  # type: ignore[operator]
