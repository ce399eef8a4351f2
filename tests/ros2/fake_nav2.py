"""nav2's action NavigateToPose on a fake robot; prints what it is asked, one JSON line each."""

from __future__ import annotations

import json
import struct
import sys
import threading

from onemap_ros2.cdr import decode
from tests.ros2.fake_robot import FakeBridge, FakeRobot, Publisher

ACTION = "nav2_msgs/action/NavigateToPose"
HEAD = bytes((0, 1, 0, 0))
SUCCEEDED, CANCELED = 4, 5
DRIVE_S = 0.3


class FakeNav2:
    """Serves goals, results and cancellations; ``behaviour``: succeed after a while, or wait."""

    def __init__(self, robot: FakeRobot | FakeBridge, behaviour: str) -> None:
        self._behaviour = behaviour
        self._ends: dict[bytes, threading.Event] = {}
        self._states: dict[bytes, int] = {}
        base = "/navigate_to_pose/_action"
        robot.serve(f"{base}/get_result", f"{ACTION}_GetResult", self._result)
        robot.serve(f"{base}/cancel_goal", "action_msgs/srv/CancelGoal", self._cancel)
        self._feedback = robot.publish(f"{base}/feedback", f"{ACTION}_FeedbackMessage")
        kind = "action_msgs/msg/GoalStatusArray"
        self._status: Publisher = robot.publish(f"{base}/status", kind, latched=True)
        robot.serve(f"{base}/send_goal", f"{ACTION}_SendGoal", self._goal)

    def _say(self, *what: object) -> None:
        sys.stdout.write(json.dumps(["nav2", *what]) + "\n")  # whole: other threads write too
        sys.stdout.flush()

    def _publish_status(self) -> None:
        entries = b"".join(
            goal + struct.pack("<iIbxxx", 1, 2, state) for goal, state in self._states.items()
        )
        self._status.put(HEAD + struct.pack("<I", len(self._states)) + entries)

    def _goal(self, request: bytes) -> bytes:
        message = decode(request, f"{ACTION}_SendGoal_Request")
        goal_id, place = request[4:20], message.goal.pose.pose.position
        frame = message.goal.pose.header.frame_id
        self._say("goal", goal_id.hex(), place.x, place.y, frame)
        self._ends[goal_id], self._states[goal_id] = threading.Event(), 2
        self._publish_status()
        pose = request[20:]
        self._feedback.put(HEAD + goal_id + pose[: len(pose) - 5] + bytes(24))
        return HEAD + struct.pack("<?3xiI", True, 1, 2)

    def _result(self, request: bytes) -> bytes:
        goal_id = request[4:20]
        ended = self._ends[goal_id]
        if not ended.wait(DRIVE_S if self._behaviour == "succeed" else None):
            self._states[goal_id] = SUCCEEDED
        state = self._states[goal_id]
        self._say("end", goal_id.hex(), state)
        self._publish_status()
        return HEAD + struct.pack("<bxHI1s", state, 0, 1, b"\0")

    def _cancel(self, request: bytes) -> bytes:
        goal_id = request[4:20]
        self._say("cancel", goal_id.hex())
        known = goal_id in self._ends
        if known:
            self._states[goal_id] = CANCELED
            self._ends[goal_id].set()
            self._publish_status()
        return HEAD + struct.pack("<b3xI", 0 if known else 2, 0)
