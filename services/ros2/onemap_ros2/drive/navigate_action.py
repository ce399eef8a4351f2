"""The messages of nav2's action NavigateToPose, as bytes and as plain values."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from onemap_ros2.cdr import FormatError, decode, decode_start, encode, new, time_of
from onemap_ros2.definitions import CANCEL_GOAL, FEEDBACK, GET_RESULT, GOAL_INFO, SEND_GOAL, UUID
from onemap_ros2.drive.goal_pose import GoalPose, stamped_pose
from onemap_ros2.ros_types import NAVIGATE

STATUS_ARRAY = "action_msgs/msg/GoalStatusArray"
SUCCEEDED, CANCELED, ABORTED = 4, 5, 6  # of action_msgs/GoalStatus
UNDER_WAY = (1, 2)  # accepted, executing
OUTCOMES = {SUCCEEDED: "reached", CANCELED: "cancelled", ABORTED: "aborted"}
# of action_msgs/CancelGoal; what it does not know or has ended needs no cancelling
CANCEL_REJECTED, GOAL_UNKNOWN, GOAL_ENDED = 1, 2, 3
STATUS_BYTE = 4  # after the header of the encoding


@dataclass(frozen=True, slots=True)
class GoalResult:
    """How a goal ended: its status, nav2's error code (0: none) and what it says about it."""

    status: int
    error_code: int = 0
    error_text: str = ""

    @property
    def sentence(self) -> str:
        """What happened, for people."""
        outcome = OUTCOMES.get(self.status, f"ended with status {self.status}")
        code = f", error {self.error_code}" if self.error_code else ""
        return f"{outcome}{code}{': ' if self.error_text else ''}{self.error_text}"


def goal_request(goal_id: bytes, goal: GoalPose, stamp_ns: int, frame: str) -> bytes:
    """The request that sends a goal; ``goal_id``: 16 bytes."""
    wanted = new(f"{NAVIGATE}_Goal", stamped_pose(goal, stamp_ns, frame), "")
    return encode(new(f"{SEND_GOAL}_Request", _uuid(goal_id), wanted), f"{SEND_GOAL}_Request")


def is_accepted(reply: bytes) -> bool:
    """Whether a goal was accepted; FormatError for what is no such reply."""
    return bool(decode(reply, f"{SEND_GOAL}_Response").accepted)


def result_request(goal_id: bytes) -> bytes:
    """The request for a goal's result, which is answered when the goal ends."""
    return encode(new(f"{GET_RESULT}_Request", _uuid(goal_id)), f"{GET_RESULT}_Request")


def read_result(reply: bytes) -> GoalResult:
    """The result; older releases of nav2 have no text, or nothing but the status."""
    try:
        message = decode_start(reply, f"{GET_RESULT}_Response")
    except FormatError:
        if len(reply) <= STATUS_BYTE:
            raise
        return GoalResult(int(reply[STATUS_BYTE]))
    result = message.result
    return GoalResult(int(message.status), int(result.error_code), str(result.error_msg))


def cancel_request(goal_id: bytes) -> bytes:
    """The request that cancels one goal, whenever it was accepted."""
    info = new(GOAL_INFO, _uuid(goal_id), time_of(0))
    return encode(new(f"{CANCEL_GOAL}_Request", info), f"{CANCEL_GOAL}_Request")


def cancel_code(reply: bytes) -> int:
    """0 if the goal will be cancelled, else why not."""
    return int(decode(reply, f"{CANCEL_GOAL}_Response").return_code)


def read_feedback(data: bytes) -> tuple[bytes, float]:
    """The goal's id and the metres that remain; what later releases append is left out."""
    message = decode_start(data, FEEDBACK)
    return _bytes(message.goal_id), float(message.feedback.distance_remaining)


def read_under_way(data: bytes) -> list[bytes]:
    """The ids of the goals that are under way, of the action's status topic."""
    listed = decode(data, STATUS_ARRAY).status_list
    return [_bytes(each.goal_info.goal_id) for each in listed if each.status in UNDER_WAY]


def _uuid(goal_id: bytes) -> Any:
    return new(UUID, np.frombuffer(goal_id, np.uint8))


def _bytes(uuid: Any) -> bytes:
    return bytes(bytearray(uuid.uuid))
