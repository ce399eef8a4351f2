"""Lets nav2 drive: the planner's goals by its action NavigateToPose, and nothing on cmd_vel."""

from __future__ import annotations

import hashlib
import secrets
from dataclasses import dataclass, replace
from enum import Enum
from typing import Any

import numpy as np

from onemap_ros2 import cdr
from onemap_ros2.config import NODE, Ros2Config
from onemap_ros2.drive.driver import (
    ARRIVED_M,
    ARRIVED_RAD,
    GOAL_CHANGE_M,
    GOAL_PERIOD_S,
    NEVER,
    GoalPose,
    GoalReport,
    Log,
    PlannerInputs,
    RobotNow,
    stamped_pose,
)
from onemap_ros2.drive.standstill import StandstillWatch
from onemap_ros2.drive.velocity import STOPPED, ZEROS, Base
from onemap_ros2.network.interface import PendingCall, RosNetwork
from onemap_ros2.topic_list import missing, serves_action
from onemap_shared.messages import VelocityCommand

MARK_BYTES = 6  # of a goal's id that say whose it is
RANDOM_BYTES = 10
RESULT_S = 86_400.0  # a goal takes as long as it takes; a lost link ends the question earlier
CLOSE_S = 2.0
ANSWER_S = 2.0  # an answer of nav2 that comes later is not heard
NAMED_S = 1.0  # after so long without an answer to a goal nav2 is named, and the goal cancelled
CANCEL_S = 1.0  # the same for a cancellation, which is asked again: the robot may still drive
# After the second goal in a row without an answer: longer than a search waits, which ends with the
# reason. A later answer, or a server that is started anew, ends it before.
SILENT_S = 35.0
END_S = 3.0  # for a goal to end after nav2 accepted that: it brakes within one
RETRY_S = 3.0  # after a goal that nav2 refused or aborted, before the same is sent again
GIVEN_UP = 2  # failures in a row at one goal, after which the planner is told: it has others
STATUS_KEPT = 5
STATUS_ARRAY = "action_msgs/msg/GoalStatusArray"
SUCCEEDED, CANCELED, ABORTED = 4, 5, 6  # of action_msgs/GoalStatus
UNDER_WAY = (1, 2)  # accepted, executing
OUTCOMES = {SUCCEEDED: "reached", CANCELED: "cancelled", ABORTED: "aborted"}
# of action_msgs/CancelGoal; what it does not know or has ended needs no cancelling
CANCEL_ACCEPTED, CANCEL_REJECTED, GOAL_UNKNOWN, GOAL_ENDED = 0, 1, 2, 3
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
    wanted = cdr.new(f"{cdr.NAVIGATE}_Goal", stamped_pose(goal, stamp_ns, frame), "")
    return cdr.encode(
        cdr.new(f"{cdr.SEND_GOAL}_Request", _uuid(goal_id), wanted), f"{cdr.SEND_GOAL}_Request"
    )


def is_accepted(reply: bytes) -> bool:
    """Whether a goal was accepted; FormatError for what is no such reply."""
    return bool(cdr.decode(reply, f"{cdr.SEND_GOAL}_Response").accepted)


def result_request(goal_id: bytes) -> bytes:
    """The request for a goal's result, which is answered when the goal ends."""
    return cdr.encode(
        cdr.new(f"{cdr.GET_RESULT}_Request", _uuid(goal_id)), f"{cdr.GET_RESULT}_Request"
    )


def read_result(reply: bytes) -> GoalResult:
    """The result; older releases of nav2 have no text, or nothing but the status."""
    try:
        message = cdr.decode_start(reply, f"{cdr.GET_RESULT}_Response")
    except cdr.FormatError:
        if len(reply) <= STATUS_BYTE:
            raise
        return GoalResult(int(reply[STATUS_BYTE]))
    result = message.result
    return GoalResult(int(message.status), int(result.error_code), str(result.error_msg))


def cancel_request(goal_id: bytes) -> bytes:
    """The request that cancels one goal, whenever it was accepted."""
    info = cdr.new(cdr.GOAL_INFO, _uuid(goal_id), cdr.time_of(0))
    return cdr.encode(cdr.new(f"{cdr.CANCEL_GOAL}_Request", info), f"{cdr.CANCEL_GOAL}_Request")


def read_feedback(data: bytes) -> tuple[bytes, float]:
    """The goal's id and the metres that remain; what later releases append is left out."""
    message = cdr.decode_start(data, cdr.FEEDBACK)
    return _bytes(message.goal_id), float(message.feedback.distance_remaining)


def read_under_way(data: bytes) -> list[bytes]:
    """The ids of the goals that are under way, of the action's status topic."""
    listed = cdr.decode(data, STATUS_ARRAY).status_list
    return [_bytes(each.goal_info.goal_id) for each in listed if each.status in UNDER_WAY]


def _uuid(goal_id: bytes) -> Any:
    return cdr.new(cdr.UUID, np.frombuffer(goal_id, np.uint8))


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
class Replies:
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
    nav2 drives to. reached: the last goal that nav2 reached, while the robot is there, and stood:
    its pose then. ending_s: since when the goal must end; cancel_code: nav2's last answer to that.
    """

    phase: GoalPhase = GoalPhase.NONE
    target: GoalPose | None = None
    since_s: float = NEVER
    sent_s: float = NEVER
    next_s: float = NEVER
    replaces: bool = False
    reached: GoalPose | None = None
    stood: GoalPose | None = None
    ending_s: float = NEVER
    cancel_code: int | None = None

    def step(
        self,
        now_s: float,
        wanted: GoalPose | None,
        replies: Replies,
        here: GoalPose | None = None,
    ) -> tuple[NavGoal, Order]:
        """The goal after this moment, and what to ask of nav2. ``wanted`` None: it must end."""
        if self.stood and here and here.away_m(self.stood) > GOAL_CHANGE_M:
            return replace(self, reached=None, stood=None).step(now_s, wanted, replies, here)
        late = now_s - self.since_s > NAMED_S
        outcome: tuple[NavGoal, Order] = self, Order.NOTHING
        if self.phase is GoalPhase.NONE:
            if wanted is not None and replies.served and self._due(now_s, wanted):
                outcome = self._sent(now_s, wanted)
        elif self.phase is GoalPhase.ASKING:
            if replies.accepted is False and not self.replaces:
                outcome = self._failed(now_s), Order.NOTHING
            elif wanted is None or replies.accepted is False or (late and not replies.accepted):
                outcome = self._cancel(now_s)  # nav2 may drive to the one before, or to this one
            elif replies.accepted:
                outcome = replace(self, phase=GoalPhase.DRIVING, since_s=now_s), Order.NOTHING
        elif self.phase is GoalPhase.DRIVING:
            if replies.result is not None:
                there = replies.result.status == SUCCEEDED
                ended = self._arrived(here) if there else self._failed(now_s)
                outcome = ended, Order.NOTHING
            elif wanted is None or replies.lost:
                outcome = self._cancel(now_s)
            elif self._moved(wanted) and self._due(now_s, wanted):
                outcome = self._sent(now_s, wanted)
        else:
            outcome = self._ending(now_s, replies)
        return outcome

    def overdue_s(self, now_s: float) -> float:
        """Seconds since the goal had to end, once that takes too long; else 0."""
        patience_s = END_S if self.cancel_code == CANCEL_ACCEPTED else CANCEL_S
        waited_s = now_s - self.ending_s
        cancelling = self.phase is GoalPhase.CANCELLING
        return waited_s if cancelling and waited_s > patience_s else 0.0

    def _ending(self, now_s: float, replies: Replies) -> tuple[NavGoal, Order]:
        if replies.result is not None or replies.cancel_code in (GOAL_UNKNOWN, GOAL_ENDED):
            return replace(self, phase=GoalPhase.NONE, next_s=now_s), Order.NOTHING
        goal = self
        if replies.cancel_code is not None:
            goal = replace(self, cancel_code=replies.cancel_code)
        return goal._cancel(now_s) if now_s - self.since_s > CANCEL_S else (goal, Order.NOTHING)

    def _moved(self, wanted: GoalPose) -> bool:
        """Whether it is another goal than the newest; of one that was reached little is enough."""
        if self.target is None:
            return True
        if self.phase is GoalPhase.NONE and self.reached is not None:
            return wanted.turns or wanted.differs(self.target, ARRIVED_M, ARRIVED_RAD)
        return wanted.differs(self.target)

    def _due(self, now_s: float, wanted: GoalPose) -> bool:
        """Whether to send it now; never the one again at which the robot stands."""
        if self._moved(wanted):
            return now_s >= self.sent_s + GOAL_PERIOD_S
        return self.reached is None and now_s >= self.next_s

    def _sent(self, now_s: float, wanted: GoalPose) -> tuple[NavGoal, Order]:
        replaces = self.phase is GoalPhase.DRIVING
        goal = NavGoal(GoalPhase.ASKING, wanted, now_s, now_s, replaces=replaces)
        if self.reached is not None and self.reached.away_m(wanted) <= GOAL_CHANGE_M:
            goal = replace(goal, reached=self.reached, stood=self.stood)  # it turns where it stands
        return goal, Order.SEND

    def _cancel(self, now_s: float) -> tuple[NavGoal, Order]:
        goal = replace(self, phase=GoalPhase.CANCELLING, since_s=now_s, reached=None, stood=None)
        if self.phase is not GoalPhase.CANCELLING:
            goal = replace(goal, ending_s=now_s, cancel_code=None)
        return goal, Order.CANCEL

    def _arrived(self, here: GoalPose | None) -> NavGoal:
        return replace(self, phase=GoalPhase.NONE, reached=self.target, stood=here or self.target)

    def _failed(self, now_s: float) -> NavGoal:
        next_s = now_s + RETRY_S
        goal = replace(self, phase=GoalPhase.NONE, since_s=now_s, next_s=next_s)
        return replace(goal, reached=None, stood=None)


class Nav2Driver:
    """Implements ``Driver``. One goal at a time; it ends as soon as it may not rest on anything.

    Goals carry a mark in their ids: those that an adapter left behind when it was killed are
    cancelled by the next one of the same name. From when a goal must end, the base gets zero
    velocities beside nav2's own, as long as the robot moves: see ``StandstillWatch``.
    """

    def __init__(self, network: RosNetwork, config: Ros2Config, log: Log) -> None:
        self._network, self._config, self._log = network, config, log
        self._action, self._base = config.names.navigate, Base(network, config)
        self._mark = hashlib.sha256(f"{config.namespace}/{NODE}".encode()).digest()[:MARK_BYTES]
        self._goal = NavGoal()
        self._goal_id = self._ended_id = b""  # that is driven to or ends; the last with a result
        # Others that nav2 may drive to, with the questions for their results: by its one goal at a
        # time they end when it accepts the newest.
        self._others: list[tuple[bytes, PendingCall | None]] = []
        self._asked_id = b""  # the newest, whose answer this is
        self._answer: PendingCall | None = None
        self._result: PendingCall | None = None
        self._cancel: PendingCall | None = None
        self._feedback = network.read(f"{self._action}/_action/feedback", cdr.FEEDBACK, 1)
        status = f"{self._action}/_action/status"
        self._status = network.read(status, STATUS_ARRAY, STATUS_KEPT, latched=True)
        self._counts = dict.fromkeys(("sent", "replaced", "refused", "lost", *OUTCOMES.values()), 0)
        self._remaining_m = 0.0
        self._problem = ""
        self._failed: GoalPose | None = None  # what the problem is about, if it is about a goal
        self._failures = 0  # in a row, at that goal
        self._robot: RobotNow | None = None
        self._watch, self._was_served = StandstillWatch(), False
        self._unanswered, self._silent_s = 0, NEVER  # goals in a row, and when the last one ended

    def step(self, robot: RobotNow, command: VelocityCommand | None, inputs: PlannerInputs) -> None:
        """See ``Driver``; a velocity counts as the planner's sign of life only."""
        del command
        self._robot, phase = robot, self._goal.phase
        self._base.find()
        self._take_topics(robot.now_s)
        served, replies = self._was_served, self._take_replies()
        self._was_served = replies.served
        before = self._goal
        self._goal, order = before.step(robot.now_s, inputs.goal(robot), replies, robot.pose)
        if order is Order.SEND and self._goal.target is not None:
            self._send(self._goal.target, robot.stamp_ns)
        elif order is Order.CANCEL:
            if before.phase is GoalPhase.ASKING and replies.accepted is False:
                self._turn_to_another()
            self._ask_to_cancel()
        if replies.accepted:
            self._counts["replaced"] += before.replaces
            self._others = []
            self._result = self._ask_result(self._goal_id)
            if not self._is_retry():
                self._problem = ""
        self._count_silence(before, replies, robot.now_s, back=replies.served and not served)
        if inputs.goal(robot) is None and self._failed is not None and self.idle:
            self._problem = ""  # of a goal that nobody wants any more
        self._brake(robot, phase)

    def problem(self) -> str:
        """See ``Driver``."""
        if hold := self.report().hold:
            return hold
        if not self._served():
            return missing(self._network.endpoints(), self._config).get("navigate", "")
        return self._problem

    def report(self) -> GoalReport:
        """See ``Driver``: where nav2 says it is, and that it does not end a goal."""
        if self._robot is None:
            return GoalReport()
        now_s = self._robot.now_s
        overdue_s = self._goal.overdue_s(now_s)
        if not overdue_s:
            refused = self._failed if self.idle and self._failures >= GIVEN_UP else None
            return GoalReport(self._goal.reached, self._silence(now_s), refused)
        code, since = self._goal.cancel_code, f"{overdue_s:.0f} s"
        what = f"has not answered a cancellation for {since}"
        if code is not None:
            rejected = code == CANCEL_REJECTED
            what = (
                f"{'refuses' if rejected else 'was asked and has failed'} to end a goal for {since}"
            )
        return GoalReport(hold=f"{self._action} {what}: the robot may still drive")

    @property
    def idle(self) -> bool:
        """See ``Driver``."""
        return self._goal.phase is GoalPhase.NONE

    def metrics(self) -> dict[str, float]:
        """See ``Driver``: goals by what became of them, and what remains of the present one."""
        counts = {f"goals_{name}": float(count) for name, count in self._counts.items()}
        active = self._goal.phase is GoalPhase.DRIVING
        return {**counts, "goal_remaining_m": self._remaining_m if active else 0.0}

    def close(self) -> None:
        """Stop the base; cancel the goal, and send zeros until nav2 says so, for a while."""
        if self._robot is None or (self.idle and not self._watch.on):
            return
        for _ in range(1 + ZEROS):
            self._base.publish(STOPPED, self._robot)
        if self.idle:
            return
        self._ask_to_cancel()
        for _ in range(int(CLOSE_S / 0.05)):
            if self._cancel is None or self._cancel.done:
                break
            self._network.wait(0.05)
            self._base.publish(STOPPED, self._robot)

    def _is_retry(self) -> bool:
        """Whether nav2 failed at this goal before; what failed with another one is over."""
        goal, failed = self._goal.target, self._failed
        return goal is not None and failed is not None and not goal.differs(failed)

    def _served(self) -> bool:
        return serves_action(self._network.endpoints(), self._action)

    def _brake(self, robot: RobotNow, before: GoalPhase) -> None:
        """Zero velocity while the robot moves and no goal of ours is driven to."""
        phase = self._goal.phase
        if phase in (GoalPhase.ASKING, GoalPhase.DRIVING):
            self._watch = self._watch.armed(robot.now_s)
            return
        if phase is GoalPhase.CANCELLING and before is not phase:
            self._watch = self._watch.begun(robot.now_s)
        ended = phase is GoalPhase.NONE
        self._watch, zero = self._watch.step(robot.now_s, moving=robot.moving, ended=ended)
        if zero:
            self._base.publish(STOPPED, robot)

    def _count_silence(
        self, before: NavGoal, replies: Replies, now_s: float, *, back: bool
    ) -> None:
        """Count the goals that nav2 leaves without an answer; ``back``: it was started anew."""
        if replies.accepted is not None or back:
            self._unanswered = 0
        elif before.phase is GoalPhase.ASKING and self._goal.phase is GoalPhase.CANCELLING:
            self._unanswered += now_s - before.since_s > NAMED_S
            self._silent_s = now_s

    def _silence(self, now_s: float) -> str:
        """That nav2 takes goals and does not answer; empty if it does."""
        asked_s = 0.0 if self.idle or self._answer is None else now_s - self._goal.sent_s
        again = self._unanswered > 1 and now_s - self._silent_s <= SILENT_S
        if asked_s <= NAMED_S and not again:
            return ""
        since = f"for {asked_s:.0f} s" if asked_s > NAMED_S else f"{self._unanswered} times"
        return f"{self._action} takes goals and has not answered {since}: is nav2 active?"

    def _send(self, goal: GoalPose, stamp_ns: int) -> None:
        before = self._goal_id, self._result  # which nav2 may yet accept, if it did not end it
        self._others = [] if before[0] in (b"", self._ended_id) else [before]
        self._goal_id = self._asked_id = self._mark + secrets.token_bytes(RANDOM_BYTES)
        self._result = None
        request = goal_request(self._goal_id, goal, stamp_ns, self._config.map_frame)
        self._answer = self._call("send_goal", cdr.SEND_GOAL, request)
        self._counts["sent"] += 1
        self._remaining_m = 0.0
        self._log(f"goal ({goal.x_m:.2f}, {goal.y_m:.2f}) was sent to {self._action}")

    def _ask_result(self, goal_id: bytes) -> PendingCall:
        service = f"{self._action}/_action/get_result"
        return self._network.call(service, cdr.GET_RESULT, result_request(goal_id), RESULT_S)

    def _turn_to_another(self) -> bool:
        """The goal ended, or nav2 does not have it: on to another one; False without any."""
        if not self._others:
            return False
        self._goal_id, self._result = self._others.pop()
        return True

    def _ask_to_cancel(self) -> None:
        """Cancel all that nav2 may drive to; the others are asked again when this one has ended."""
        for goal_id in (*(each for each, _ in self._others), self._goal_id):
            self._cancel = self._call("cancel_goal", cdr.CANCEL_GOAL, cancel_request(goal_id))
        self._log(f"{self._action} was asked to cancel its goal")

    def _call(self, service: str, ros_type: str, request: bytes) -> PendingCall:
        return self._network.call(f"{self._action}/_action/{service}", ros_type, request, ANSWER_S)

    def _take_replies(self) -> Replies:
        """Take nav2's answers; what cannot be read counts as no answer."""
        try:
            return Replies(
                served=self._served(),
                accepted=self._accepted(),
                result=self._ended(),
                cancel_code=self._cancelled(),
                lost=self._lost(),
            )
        except cdr.FormatError as problem:
            self._problem = f"{self._action} answers what cannot be read: {problem}"
            return Replies(served=self._served())

    def _take_topics(self, now_s: float) -> None:
        try:
            for data in self._feedback.take():
                goal_id, remaining_m = read_feedback(data)
                self._remaining_m = remaining_m if goal_id == self._goal_id else self._remaining_m
            for data in self._status.take():
                for goal_id in read_under_way(data):
                    self._end_orphan(goal_id, now_s)
        except cdr.FormatError as problem:
            self._problem = f"{self._action} says what cannot be read: {problem}"

    def _end_orphan(self, goal_id: bytes, now_s: float) -> None:
        """End a goal with our mark that is under way and that nobody wants.

        An adapter of our name that was killed left it; or nav2 accepted it after it had answered
        that it does not know it. One that is accepted ends it by itself: nav2 has one goal at a
        time. What says that it has ended may come before what said that it drives.
        """
        ours = goal_id.startswith(self._mark) and goal_id != self._ended_id
        phase = self._goal.phase
        known = goal_id in (each for each, _ in self._others)
        known |= goal_id == self._goal_id and (phase is GoalPhase.ASKING or self._answer is None)
        if not ours or phase is GoalPhase.DRIVING or (known and phase is not GoalPhase.NONE):
            return
        if phase is GoalPhase.ASKING:
            self._others.insert(0, (goal_id, self._ask_result(goal_id)))
        else:
            self._take_over(goal_id, now_s)

    def _take_over(self, goal_id: bytes, now_s: float) -> None:
        """Cancel a goal that is under way, and then those that were to be cancelled before."""
        self._log("a goal that nobody wants any more is cancelled")
        if self.idle:
            self._goal = NavGoal(GoalPhase.CANCELLING, since_s=now_s, ending_s=now_s)
        elif goal_id != self._goal_id:
            self._others.append((self._goal_id, self._result))
        self._goal_id, self._result = goal_id, self._ask_result(goal_id)
        self._ask_to_cancel()

    def _accepted(self) -> bool | None:
        reply, self._answer = _taken(self._answer)
        if reply is None:
            return None
        accepted = is_accepted(reply)
        if not accepted:
            self._counts["refused"] += 1
            self._fail(f"{self._action} refused the goal")
            self._log(self._problem)
        elif self._goal.phase is not GoalPhase.ASKING and self._robot is not None:
            self._others = []
            self._take_over(self._asked_id, self._robot.now_s)
            return None
        return accepted

    def _ended(self) -> GoalResult | None:
        reply, self._result = _taken(self._result)
        if reply is None:
            return None
        result, self._ended_id = read_result(reply), self._goal_id
        outcome = OUTCOMES.get(result.status, "aborted")
        self._counts[outcome] += 1
        if outcome == "aborted":
            self._fail(f"{self._action}: {result.sentence}")
        else:
            self._problem, self._failed, self._failures = "", None, 0
        self._log(f"goal of {self._action} was {result.sentence}")
        if self._turn_to_another():
            self._ask_to_cancel()
            return None
        return result

    def _fail(self, problem: str) -> None:
        """nav2 failed at the present goal."""
        self._failures = self._failures + 1 if self._is_retry() else 1
        self._problem, self._failed = problem, self._goal.target

    def _cancelled(self) -> int | None:
        """nav2's answer to a cancellation; without this goal it may have another one of ours."""
        reply, self._cancel = _taken(self._cancel)
        if reply is None:
            return None
        code = int(cdr.decode(reply, f"{cdr.CANCEL_GOAL}_Response").return_code)
        if code in (GOAL_UNKNOWN, GOAL_ENDED) and self._turn_to_another():
            self._ask_to_cancel()
            return None
        return code

    def _lost(self) -> bool:
        call = self._result
        if call is None or not call.done or call.reply is not None:  # it may come just now
            return False
        self._result = None
        self._counts["lost"] += 1
        self._problem = f"the link to {self._action} was lost while it drove"
        self._log(self._problem)
        return True


def _taken(call: PendingCall | None) -> tuple[bytes | None, PendingCall | None]:
    """The answer to a question, and the question if it is still open."""
    reply = call.reply if call is not None else None
    return reply, call if reply is None else None
