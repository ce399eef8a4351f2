"""Lets nav2 drive: the planner's goals by its action NavigateToPose, and nothing on cmd_vel."""

from __future__ import annotations

import hashlib
import secrets
from dataclasses import dataclass, replace
from enum import Enum
from typing import Any

import numpy as np

from onemap_ros2.cdr import (
    CANCEL_GOAL,
    FEEDBACK,
    GET_RESULT,
    GOAL_INFO,
    NAVIGATE,
    SEND_GOAL,
    UUID,
    FormatError,
    decode,
    decode_start,
    encode,
    new,
    time_of,
)
from onemap_ros2.config import NODE, Ros2Config
from onemap_ros2.drive.driver import (
    GOAL_PERIOD_S,
    NEVER,
    GoalPose,
    PlannerVoice,
    RobotNow,
    Say,
    stamped_pose,
)
from onemap_ros2.network.interface import PendingCall, RosNetwork
from onemap_ros2.topic_list import missing, serves_action
from onemap_shared.messages import VelocityCommand

MARK_BYTES = 6  # of a goal's id that say whose it is
RANDOM_BYTES = 10
RESULT_S = 86_400.0  # a goal takes as long as it takes; a lost link ends the question earlier
CLOSE_S = 2.0
ANSWER_S = 2.0  # for nav2 to answer a goal or a cancellation, which is asked again then
RETRY_S = 3.0  # after a goal that nav2 refused, aborted or reached, before the same is sent again
STATUS_KEPT = 5
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


class GoalPhase(Enum):
    """Where the goal stands."""

    NONE = "there is none"
    ASKING = "it was sent and is not answered"
    DRIVING = "nav2 accepted it"
    CANCELLING = "it must end, and nav2 has not said that it did"


class Order(Enum):
    """What to ask of nav2 now."""

    NOTHING = "nothing"
    SEND = "send"
    CANCEL = "cancel"


@dataclass(frozen=True, slots=True)
class Heard:
    """What nav2 said since the last step; None where it has not answered.

    served: whether a node serves the action. lost: the question for the result ended without an
    answer: the link or nav2 is gone.
    """

    served: bool = True
    accepted: bool | None = None
    result: GoalResult | None = None
    cancel_code: int | None = None
    lost: bool = False


@dataclass(frozen=True, slots=True)
class NavGoal:
    """The newest goal and its state. Times are seconds of a monotonic clock.

    since_s: since when the phase lasts, or when the cancellation was last asked for. next_s: before
    this it is not sent again: nav2 refused or ended it. replaces: it takes the place of one that
    nav2 drives to.
    """

    phase: GoalPhase = GoalPhase.NONE
    target: GoalPose | None = None
    since_s: float = NEVER
    sent_s: float = NEVER
    next_s: float = NEVER
    replaces: bool = False

    def step(self, now_s: float, wanted: GoalPose | None, heard: Heard) -> tuple[NavGoal, Order]:
        """The goal after this moment, and what to ask of nav2. ``wanted`` None: it must end."""
        late = now_s - self.since_s > ANSWER_S
        moved = wanted is not None and (self.target is None or wanted.differs(self.target))
        due = now_s >= (self.sent_s + GOAL_PERIOD_S if moved else self.next_s)
        after: tuple[NavGoal, Order] = self, Order.NOTHING
        if self.phase is GoalPhase.NONE:
            if wanted is not None and heard.served and due:
                after = self._sent(now_s, wanted)
        elif self.phase is GoalPhase.ASKING:
            if heard.accepted:
                after = replace(self, phase=GoalPhase.DRIVING, since_s=now_s), Order.NOTHING
            elif heard.accepted is False and not self.replaces:
                after = self._ended(now_s), Order.NOTHING
            elif heard.accepted is False or late:
                after = self._cancel(now_s)  # the goal before, or this one: an answer may be lost
        elif self.phase is GoalPhase.DRIVING:
            if heard.result is not None:
                after = self._ended(now_s), Order.NOTHING
            elif wanted is None or heard.lost:
                after = self._cancel(now_s)
            elif moved and due:
                after = self._sent(now_s, wanted)
        elif heard.result is not None or heard.cancel_code in (GOAL_UNKNOWN, GOAL_ENDED):
            after = replace(self, phase=GoalPhase.NONE, next_s=now_s), Order.NOTHING
        elif late:
            after = self._cancel(now_s)
        return after

    def _sent(self, now_s: float, wanted: GoalPose) -> tuple[NavGoal, Order]:
        replaces = self.phase is GoalPhase.DRIVING
        return NavGoal(GoalPhase.ASKING, wanted, now_s, now_s, replaces=replaces), Order.SEND

    def _cancel(self, now_s: float) -> tuple[NavGoal, Order]:
        return replace(self, phase=GoalPhase.CANCELLING, since_s=now_s), Order.CANCEL

    def _ended(self, now_s: float) -> NavGoal:
        return replace(self, phase=GoalPhase.NONE, since_s=now_s, next_s=now_s + RETRY_S)


class Nav2Driver:
    """Implements ``Driver``. One goal at a time; it ends as soon as it may not rest on anything.

    Goals carry a mark in their ids: those that an adapter left behind when it was killed are
    cancelled by the next one of the same name.
    """

    def __init__(self, network: RosNetwork, config: Ros2Config, say: Say) -> None:
        self._network, self._config, self._say = network, config, say
        self._action = config.names.navigate
        self._mark = hashlib.sha256(f"{config.namespace}/{NODE}".encode()).digest()
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

    def step(self, robot: RobotNow, command: VelocityCommand | None, voice: PlannerVoice) -> None:
        """See ``Driver``; a velocity counts as the planner's sign of life only."""
        del command
        heard = self._hear(robot.now_s)
        before = self._goal
        self._goal, order = before.step(robot.now_s, voice.goal(robot), heard)
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
        self._say(f"goal ({goal.x_m:.2f}, {goal.y_m:.2f}) was sent to {self._action}")

    def _ask_result(self) -> None:
        request = result_request(self._goal_id)
        service = f"{self._action}/_action/get_result"
        self._result = self._network.call(service, GET_RESULT, request, RESULT_S)

    def _ask_to_cancel(self, goal_id: bytes) -> None:
        self._goal_id, self._old_id = goal_id, b""
        self._cancel = self._call("cancel_goal", CANCEL_GOAL, cancel_request(goal_id))
        self._say(f"{self._action} was asked to cancel its goal")

    def _call(self, service: str, ros_type: str, request: bytes) -> PendingCall:
        return self._network.call(f"{self._action}/_action/{service}", ros_type, request, ANSWER_S)

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
        if now_s - self._orphans.get(goal_id, NEVER) > ANSWER_S:
            self._orphans[goal_id] = now_s
            self._call("cancel_goal", CANCEL_GOAL, cancel_request(goal_id))
            self._say("a goal that an adapter before this one left behind is cancelled")

    def _accepted(self) -> bool | None:
        reply, self._answer = _taken(self._answer)
        if reply is None:
            return None
        accepted = is_accepted(reply)
        if not accepted:
            self._counts["refused"] += 1
            self._problem = f"{self._action} refused the goal"
            self._say(self._problem)
        return accepted

    def _ended(self) -> GoalResult | None:
        reply, self._result = _taken(self._result)
        if reply is None:
            return None
        result = read_result(reply)
        outcome = OUTCOMES.get(result.status, "aborted")
        self._counts[outcome] += 1
        self._problem = f"{self._action}: {result.sentence}" if outcome == "aborted" else ""
        self._say(f"goal of {self._action} was {result.sentence}")
        return result

    def _cancelled(self) -> int | None:
        reply, self._cancel = _taken(self._cancel)
        if reply is None:
            return None
        code = int(decode(reply, f"{CANCEL_GOAL}_Response").return_code)
        if code == CANCEL_REJECTED:
            self._problem = f"{self._action} does not let its goal be cancelled"
        return code

    def _lost(self) -> bool:
        call = self._result
        if call is None or not call.done or call.reply is not None:  # it may come just now
            return False
        self._result = None
        self._counts["lost"] += 1
        self._problem = f"the link to {self._action} was lost while it drove"
        self._say(self._problem)
        return True


def _taken(call: PendingCall | None) -> tuple[bytes | None, PendingCall | None]:
    """The answer to a question, and the question if it is still open."""
    reply = call.reply if call is not None else None
    return reply, call if reply is None else None
