"""Lets nav2 drive: the planner's goals by its action NavigateToPose, and nothing on cmd_vel."""

from __future__ import annotations

import hashlib
import secrets

from onemap_ros2.cdr import FormatError
from onemap_ros2.config import Ros2Config
from onemap_ros2.definitions import CANCEL_GOAL, FEEDBACK, GET_RESULT, SEND_GOAL
from onemap_ros2.drive.driver import RobotNow
from onemap_ros2.drive.goal_pose import GoalPose
from onemap_ros2.drive.nav_goal import GoalPhase, Heard, NavGoal, Order
from onemap_ros2.drive.navigate_action import (
    CANCEL_REJECTED,
    OUTCOMES,
    STATUS_ARRAY,
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
from onemap_ros2.drive.planner_voice import PlannerVoice
from onemap_ros2.network.endpoint import serves_action
from onemap_ros2.network.interface import PendingCall, RosNetwork
from onemap_ros2.topic_list import missing
from onemap_shared.messages import VelocityCommand

MARK_BYTES = 6  # of a goal's id that say whose it is
RANDOM_BYTES = 10
RESULT_S = 86_400.0  # a goal takes as long as it takes; a lost link ends the question earlier
CLOSE_S = 2.0
STATUS_KEPT = 5


class Nav2Driver:
    """Implements ``Driver``. One goal at a time; it ends as soon as it may not rest on anything.

    Goals carry a mark in their ids: those that an adapter left behind when it was killed are
    cancelled by the next one of the same name.
    """

    def __init__(self, network: RosNetwork, config: Ros2Config) -> None:
        self._network, self._config = network, config
        self._action = config.names.navigate
        self._mark = hashlib.sha256(f"{config.namespace}/{config.node}".encode()).digest()
        self._goal = NavGoal()
        self._goal_id = b""
        self._old_id = b""  # of the goal that the newest one takes the place of
        self._answer: PendingCall | None = None
        self._result: PendingCall | None = None
        self._cancel: PendingCall | None = None
        self._orphans: dict[bytes, float] = {}  # cancelled goals of others like us, and when
        self._feedback = network.read(f"{self._action}/_action/feedback", FEEDBACK, 1)
        status = f"{self._action}/_action/status"
        self._status = network.read(status, STATUS_ARRAY, STATUS_KEPT, latched=True)
        self._counts = dict.fromkeys(("sent", "refused", "lost", *OUTCOMES.values()), 0)
        self._remaining_m = 0.0
        self._problem = ""
        self._news: list[str] = []

    def step(self, robot: RobotNow, command: VelocityCommand | None, voice: PlannerVoice) -> None:
        """See ``Driver``; a velocity counts as the planner's sign of life only."""
        del command
        wanted = None
        if robot.fresh and robot.pose is not None:
            wanted = voice.goal(robot.now_s, robot.pose, self._config.nav2)
        heard = self._hear(robot.now_s)
        before = self._goal
        self._goal, order = before.step(robot.now_s, wanted, heard, self._config.nav2)
        if order is Order.SEND and self._goal.target is not None:
            self._send(self._goal.target, robot.stamp_ns)
        elif order is Order.CANCEL:
            refused = before.phase is GoalPhase.ASKING and heard.accepted is False
            self._ask_to_cancel(self._old_id if refused else self._goal_id)
        if heard.accepted:
            self._ask_result()

    def problem(self) -> str:
        """See ``Driver``."""
        if not self._served():
            return missing(self._network.endpoints(), self._config).get("navigate", "")
        return self._problem

    def take_news(self) -> list[str]:
        """See ``Driver``."""
        news, self._news = self._news, []
        return news

    def metrics(self) -> dict[str, float]:
        """See ``Driver``: goals by what became of them, and what remains of the present one."""
        counts = {f"goals_{name}": float(count) for name, count in self._counts.items()}
        active = self._goal.phase is GoalPhase.DRIVING
        return {**counts, "goal_remaining_m": self._remaining_m if active else 0.0}

    def close(self) -> None:
        """Cancel the goal, and wait shortly for nav2 to say so."""
        if self._goal.phase is GoalPhase.NONE:
            return
        self._ask_to_cancel(self._goal_id)
        for _ in range(int(CLOSE_S / 0.05)):
            if self._cancel is None or self._cancel.done:
                return
            self._network.wait(0.05)

    def _served(self) -> bool:
        return serves_action(self._network.endpoints(), self._action)

    def _send(self, goal: GoalPose, stamp_ns: int) -> None:
        self._old_id = self._goal_id
        self._goal_id = self._mark[:MARK_BYTES] + secrets.token_bytes(RANDOM_BYTES)
        request = goal_request(self._goal_id, goal, stamp_ns, self._config.map_frame)
        self._answer = self._call("send_goal", SEND_GOAL, request)
        self._counts["sent"] += 1
        self._remaining_m = 0.0
        self._news.append(f"goal ({goal.x_m:.2f}, {goal.y_m:.2f}) was sent to {self._action}")

    def _ask_result(self) -> None:
        request = result_request(self._goal_id)
        service = f"{self._action}/_action/get_result"
        self._result = self._network.call(service, GET_RESULT, request, RESULT_S)

    def _ask_to_cancel(self, goal_id: bytes) -> None:
        self._goal_id, self._old_id = goal_id, b""
        self._cancel = self._call("cancel_goal", CANCEL_GOAL, cancel_request(goal_id))
        self._news.append(f"{self._action} was asked to cancel its goal")

    def _call(self, service: str, ros_type: str, request: bytes) -> PendingCall:
        timeout_s = self._config.nav2.answer_s
        return self._network.call(f"{self._action}/_action/{service}", ros_type, request, timeout_s)

    def _hear(self, now_s: float) -> Heard:
        """Take nav2's answers; what cannot be read counts as no answer."""
        self._hear_topics(now_s)
        try:
            return Heard(
                served=self._served(),
                accepted=self._accepted(),
                result=self._ended(),
                cancel_code=self._cancelled(),
                lost=self._lost(),
            )
        except FormatError as problem:
            self._problem = f"{self._action} answers what cannot be read: {problem}"
            return Heard(served=self._served())

    def _hear_topics(self, now_s: float) -> None:
        try:
            for data in self._feedback.take():
                goal_id, remaining_m = read_feedback(data)
                self._remaining_m = remaining_m if goal_id == self._goal_id else self._remaining_m
            for data in self._status.take():
                for goal_id in read_under_way(data):
                    self._end_orphan(goal_id, now_s)
        except FormatError as problem:
            self._problem = f"{self._action} says what cannot be read: {problem}"

    def _end_orphan(self, goal_id: bytes, now_s: float) -> None:
        """Cancel a goal of an adapter of our name that is not ours: it was killed."""
        ours = goal_id in (self._goal_id, self._old_id)
        if ours or not goal_id.startswith(self._mark[:MARK_BYTES]):
            return
        if now_s - self._orphans.get(goal_id, float("-inf")) > self._config.nav2.answer_s:
            self._orphans[goal_id] = now_s
            self._call("cancel_goal", CANCEL_GOAL, cancel_request(goal_id))
            self._news.append("a goal that an adapter before this one left behind is cancelled")

    def _accepted(self) -> bool | None:
        call = self._answer
        if call is None or call.reply is None:
            return None
        self._answer = None
        accepted = is_accepted(call.reply)
        if not accepted:
            self._counts["refused"] += 1
            self._problem = f"{self._action} refused the goal"
            self._news.append(self._problem)
        return accepted

    def _ended(self) -> GoalResult | None:
        call = self._result
        if call is None or call.reply is None:
            return None
        self._result = None
        result = read_result(call.reply)
        outcome = OUTCOMES.get(result.status, "aborted")
        self._counts[outcome] += 1
        self._problem = f"{self._action}: {result.sentence}" if outcome == "aborted" else ""
        self._news.append(f"goal of {self._action} was {result.sentence}")
        return result

    def _cancelled(self) -> int | None:
        call = self._cancel
        if call is None or call.reply is None:
            return None
        self._cancel = None
        code = cancel_code(call.reply)
        if code == CANCEL_REJECTED:
            self._problem = f"{self._action} does not let its goal be cancelled"
        return code

    def _lost(self) -> bool:
        call = self._result
        if call is None or not call.done or call.reply is not None:
            return False
        self._result = None
        self._counts["lost"] += 1
        self._problem = f"the link to {self._action} was lost while it drove"
        self._news.append(self._problem)
        return True
