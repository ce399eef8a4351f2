"""Golden bytes of nav2's action, built with ``struct`` alone."""

from __future__ import annotations

import struct

import pytest

from onemap_ros2.cdr import FormatError
from onemap_ros2.drive.driver import GoalPose
from onemap_ros2.drive.nav2 import (
    GoalResult,
    cancel_code,
    cancel_request,
    goal_request,
    is_accepted,
    read_feedback,
    read_result,
    read_under_way,
    result_request,
)

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


@pytest.mark.parametrize("accepted", [True, False])
def test_the_answer_to_a_goal(accepted: bool) -> None:
    assert is_accepted(HEAD + struct.pack("<?3xiI", accepted, 1, 2)) is accepted


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


@pytest.mark.parametrize("code", [0, 1, 2, 3])
def test_the_answer_to_a_cancellation(code: int) -> None:
    assert cancel_code(HEAD + struct.pack("<b3xI", code, 0)) == code


@pytest.mark.parametrize("read", [is_accepted, read_result, read_feedback, cancel_code])
def test_what_is_no_answer_is_refused(read: object) -> None:
    with pytest.raises(FormatError, match="bytes are no"):
        read(HEAD)  # type: ignore[operator]
