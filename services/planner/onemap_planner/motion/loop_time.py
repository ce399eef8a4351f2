"""How long the loop takes: from a command, over the robot, back to the planner.

Everything is measured on the planner's monotonic clock. The robot's odometry names the newest
command that it has received, so the loop holds both ways of the link, the robot's own delay and
the wait for its next odometry: a constant delay is seen, which the age of what arrives does not
show. A robot that names no command is judged by its odometry alone: arrival less stamp, on two
clocks, against the least that was seen. That shows a delay that grew, not one that was always
there.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from onemap_planner.motion.motions import STOP, Pose2d, moved
from onemap_shared.geometry import Velocity2d
from onemap_shared.messages import Odometry

FRESH_S = 1.0  # a measured loop of longer ago says nothing about now
MAX_SENT = 200  # commands that are remembered: 10 s at 20 Hz, far above any limit
WINDOW_S = 60.0  # the least delay is that of the last one or two of these: clocks drift apart
CLOCK_STEP_S = 5.0  # a change by more is a clock that was set, as no link holds messages back


@dataclass(frozen=True, slots=True)
class SentCommand:
    """A command under way: its number, when it was sent, in seconds, and its velocity."""

    sequence: int
    sent_s: float
    velocity: Velocity2d = STOP


@dataclass(frozen=True, slots=True)
class LoopMonitor:
    """The commands that the robot has not yet named, and the last measured loop.

    instance: of this planner. sent: the commands after the newest one that the robot named, oldest
    first. measured_s: the last loop, of ``measured_at_s``.
    followed: the planner that the robot says it follows, empty for none; named: whether its
    odometry says so at all.
    """

    instance: str = ""
    sent: tuple[SentCommand, ...] = ()
    measured_s: float = math.nan
    measured_at_s: float = -math.inf
    followed: str = ""
    named: bool = False

    def with_sent(self, command: SentCommand) -> LoopMonitor:
        """The monitor after a command was sent; after a pause it begins anew."""
        paused = not self.sent or command.sent_s - self.sent[-1].sent_s > FRESH_S
        return replace(self, sent=(*(() if paused else self.sent), command)[-MAX_SENT:])

    def with_odometry(self, message: Odometry, now_s: float) -> LoopMonitor:
        """The monitor after odometry arrived."""
        heard = replace(self, followed=message.planner, named=message.command_sequence >= 0)
        if not heard.named or message.planner != self.instance:
            return heard
        sent_s = {each.sequence: each.sent_s for each in self.sent}.get(message.command_sequence)
        if sent_s is None:  # named before, or never sent
            return heard
        left = tuple(each for each in self.sent if each.sequence > message.command_sequence)
        return replace(heard, sent=left, measured_s=now_s - sent_s, measured_at_s=now_s)

    def predicted(self, pose: Pose2d, now_s: float, within_s: float) -> Pose2d:
        """Where the robot of this odometry will be when it gets a command that is sent now.

        Until then it follows the commands that it has not named, one after the other. Those of the
        last ``within_s`` are left out: the collision monitor's reaction time stands for them.
        """
        if not self.named or not self.sent:
            return pose
        ends_s = [each.sent_s for each in self.sent[1:]] + [now_s]
        for command, end_s in zip(self.sent, ends_s, strict=True):
            if now_s - command.sent_s > within_s:
                pose = moved(pose, command.velocity, end_s - command.sent_s)
        return pose

    def loop_s(self, now_s: float) -> float:
        """Seconds that the loop takes, at least: measured, or waited for so far; 0 if unknown."""
        measured_s = self.measured_s if now_s - self.measured_at_s <= FRESH_S else 0.0
        waited_s = now_s - self.sent[0].sent_s if self.sent and self.named else 0.0
        return max(measured_s, waited_s)

    def confirmed(self, now_s: float) -> bool:
        """Whether the robot named a command lately, or never names one: then it may move."""
        return not self.named or now_s - self.measured_at_s <= FRESH_S

    def problem(self, now_s: float, limit_s: float) -> str:
        """Why the loop must not move the robot; empty if it may, or if it is about to be known."""
        loop_s = self.loop_s(now_s)
        if loop_s <= limit_s:
            return ""
        if self.followed not in ("", self.instance):
            return f"the robot follows another planner, instance {self.followed}"
        return f"a command takes {loop_s:.1f} s to the robot and back, more than {limit_s:g} s"


@dataclass(frozen=True, slots=True)
class OdometryDelay:
    """Arrival less stamp of the newest odometry, and the least of it, in seconds.

    On two clocks: only differences mean something. least_s: of this and of the last window.
    """

    newest_s: float = math.nan
    least_s: tuple[float, float] = (math.inf, math.inf)
    window_s: float = -math.inf

    def with_odometry(self, stamp_ns: int, now_s: float) -> OdometryDelay:
        """The delay after odometry with this stamp arrived."""
        delay_s = now_s - stamp_ns * 1e-9
        this_s, last_s = self.least_s
        if not abs(delay_s - self.newest_s) <= CLOCK_STEP_S:  # also the first
            return OdometryDelay(delay_s, (delay_s, math.inf), now_s)
        if now_s - self.window_s > WINDOW_S:
            return OdometryDelay(delay_s, (delay_s, this_s), now_s)
        return OdometryDelay(delay_s, (min(this_s, delay_s), last_s), self.window_s)

    @property
    def excess_s(self) -> float:
        """Seconds that the newest odometry came later than the fastest."""
        return 0.0 if math.isnan(self.newest_s) else self.newest_s - min(self.least_s)

    def problem(self, limit_s: float) -> str:
        """Why odometry is too late to move on; empty if it is not."""
        if self.excess_s <= limit_s:
            return ""
        return f"odometry arrives {self.excess_s:.1f} s later than before, more than {limit_s:g} s"
