"""Ages of the planner's inputs, and the check whether the robot may move on them.

Age counts from the arrival of a new message on the planner's monotonic clock; latched or
repeated messages do not count. Stamps are compared only with each other: odometry and frames
are both stamped by the robot, so the newest odometry tells the robot's clock, and the age of
the map's content follows without synchronised clocks.

How old the map may be follows from how often it comes: a slow map is not a dead one. The robot
drives slower on it, so that it can still stop for what the next revision shows.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import ClassVar

from pydantic import Field, PositiveFloat

from onemap_planner.motion.motions import STOP, Pose2d, moved
from onemap_planner.sentences import ahead, behind, late, waiting_for
from onemap_shared.geometry import Velocity2d
from onemap_shared.messages import Odometry
from onemap_shared.params import Params


@dataclass(frozen=True, slots=True)
class Arrival:
    """The newest message of a stream. sequence: differs for new content; at_s: time of arrival,
    seconds."""

    sequence: int
    stamp_ns: int
    at_s: float


class StalenessParams(Params):
    """How old, in seconds, the inputs may be while the robot moves."""

    max_loop_s: PositiveFloat = Field(
        default=0.6,
        description="Seconds from a command, over the robot, to the odometry that names it, above "
        "which the robot stops: 0.1 on one computer, 0.4 on a slow wireless network. At top speed "
        "it is then 0.42 m from where the planner takes it to be.",
    )

    # Seconds since new odometry came: 0.35 m at top speed.
    max_odometry_age_s: ClassVar[float] = 0.5
    # Seconds that odometry may arrive later than the fastest of the last minute, by its stamp: one
    # way of two. The loop does not have what passes before an adapter names a command.
    max_odometry_delay_s: ClassVar[float] = 0.3
    # Measured periods of the map after which the robot stops without a new frame in it: one may be
    # late or lost.
    map_periods: ClassVar[float] = 2.0
    # Seconds without a new frame in the map that never stop the robot: two updates at 4 Hz; also
    # the limit before a period was measured.
    min_map_age_s: ClassVar[float] = 0.5
    # Seconds without a new frame in the map that stop the robot however rarely frames come: two of
    # 1.3 per second, fewer are no control.
    max_map_age_s: ClassVar[float] = 1.5
    # Age of the map's newest frame, from its capture to the robot's clock now, that stops the
    # robot, over the age that the map may have: encoding and fusing take as long as the wait for
    # the next frame where they are the slowest step. 1 s at 4 Hz.
    map_lag_factor: ClassVar[float] = 2.0
    # Seconds by which the plan that is followed may show the world of longer ago than that: two
    # planning periods, for the next one is made meanwhile, on a busy machine late.
    max_view_lag_s: ClassVar[float] = 0.5
    # Seconds that the map's newest frame may be stamped after the robot's clock now, which odometry
    # on its way tells too early.
    max_map_ahead_s: ClassVar[float] = 0.1
    # Seconds a plan is followed without a newer one: four planning periods.
    max_plan_age_s: ClassVar[float] = 1.5


@dataclass(frozen=True, slots=True)
class InputAges:
    """Seconds, infinity before the first message; map_lag_s: robot's clock less the map's stamp,
    below 0 where a clock was set, infinity for a map without a frame of this robot; map_period_s:
    between new frames in the map, infinity before it was measured; view_lag_s: as map_lag_s, of the
    view of the map that is planned on, minus infinity without one."""

    odometry_s: float
    map_s: float
    map_lag_s: float
    map_period_s: float = math.inf
    view_lag_s: float = -math.inf

    @property
    def map_content_s(self) -> float:
        """How old what the map shows may become before the next frame, as far as it is known."""
        period_s = self.map_period_s if math.isfinite(self.map_period_s) else 0.0
        return max(self.map_s, self.map_lag_s, self.view_lag_s, period_s)


def newest(known: Arrival | None, arrival: Arrival) -> Arrival:
    """The arrival to keep: the new one, unless it repeats the known one."""
    return known if known is not None and known.sequence == arrival.sequence else arrival


def ages(
    odometry: Arrival | None,
    revision: Arrival | None,
    now_s: float,
    map_period_s: float = math.inf,
    frame_ns: int = 0,
) -> InputAges:
    """Ages at ``now_s``. A lag below 0: the map's frame is stamped after the newest odometry.

    frame_ns: of the newest frame in the view of the map that is planned on, 0 for none.
    """
    odometry_s = now_s - odometry.at_s if odometry else math.inf
    map_s = now_s - revision.at_s if revision else math.inf
    lag_s, view_lag_s = math.inf, -math.inf
    # Both ages count from now: what is late in coming is not held against the map twice.
    if odometry and revision and revision.stamp_ns:
        lag_s = (odometry.stamp_ns - revision.stamp_ns) * 1e-9 + odometry_s
    if odometry and frame_ns:
        view_lag_s = (odometry.stamp_ns - frame_ns) * 1e-9 + odometry_s
    return InputAges(odometry_s, map_s, lag_s, map_period_s, view_lag_s)


def map_age_limit_s(period_s: float, params: StalenessParams) -> float:
    """Seconds without a new frame in the map that stop the robot, at this measured period."""
    periods_s = params.map_periods * period_s if math.isfinite(period_s) else 0.0
    return min(max(periods_s, params.min_map_age_s), params.max_map_age_s)


def map_lag_limit_s(period_s: float, params: StalenessParams) -> float:
    """Seconds since the newest frame in the map was taken that stop the robot, at this period."""
    return params.map_lag_factor * map_age_limit_s(period_s, params)


def view_problem(age: InputAges, params: StalenessParams, allowed_s: float = 0.0) -> str:
    """Why the view of the map is too old; ``allowed_s``: longer than the map may be."""
    limit_s = map_lag_limit_s(age.map_period_s, params) + allowed_s
    return behind("the camera", age.view_lag_s) if age.view_lag_s > limit_s else ""


def stale_reason(age: InputAges, params: StalenessParams) -> str:
    """Why the robot must stop, for people; empty if it may move."""
    if age.odometry_s > params.max_odometry_age_s:
        return late("the robot's position", age.odometry_s)
    if age.map_s > map_age_limit_s(age.map_period_s, params):
        return late("the map", age.map_s)
    if age.map_lag_s == math.inf:
        return waiting_for("the map", "it has no image of this robot yet")
    if age.map_lag_s > map_lag_limit_s(age.map_period_s, params):
        return behind("the camera", age.map_lag_s)
    if age.map_lag_s < -params.max_map_ahead_s:
        return ahead("the camera", -age.map_lag_s)
    return view_problem(age, params, params.max_view_lag_s)


FRESH_S = 1.0  # a measured loop of longer ago says nothing about now
MAX_SENT = 200  # commands that are remembered: 10 s at 20 Hz, far above any limit
SET_BACK_S = (
    0.3  # as long as odometry may be late: a clock that was set back by less counts as that
)
WINDOW_S = 60.0  # the least delay is that of the last one or two of these: clocks drift apart


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
        how = f"a command takes longer than {limit_s:g} s there and back"
        return waiting_for("the robot", how)


@dataclass(frozen=True, slots=True)
class OdometryDelay:
    """Arrival less stamp of the newest odometry, and the least of it, in seconds.

    On two clocks: only differences mean something. least_s: of this and of the last window.
    stamp_ns: the newest. A link keeps the order: a stamp ``SET_BACK_S`` before it is of a clock
    that was set back, and the delay is measured anew. The map's lag stops the robot until both
    agree again.
    """

    newest_s: float = math.nan
    stamp_ns: int = 0
    least_s: tuple[float, float] = (math.inf, math.inf)
    window_s: float = -math.inf

    def with_odometry(self, stamp_ns: int, now_s: float) -> OdometryDelay:
        """The delay after odometry with this stamp arrived."""
        delay_s = now_s - stamp_ns * 1e-9
        this_s, last_s = self.least_s
        back_s = (self.stamp_ns - stamp_ns) * 1e-9
        if back_s > SET_BACK_S or math.isnan(self.newest_s):
            return OdometryDelay(delay_s, stamp_ns, (delay_s, math.inf), now_s)
        if now_s - self.window_s > WINDOW_S:
            return OdometryDelay(delay_s, stamp_ns, (delay_s, this_s), now_s)
        return OdometryDelay(delay_s, stamp_ns, (min(this_s, delay_s), last_s), self.window_s)

    @property
    def excess_s(self) -> float:
        """Seconds that the newest odometry came later than the fastest."""
        return 0.0 if math.isnan(self.newest_s) else self.newest_s - min(self.least_s)

    def problem(self, limit_s: float) -> str:
        """Why odometry is too late to move on; empty if it is not."""
        if self.excess_s <= limit_s:
            return ""
        return behind("the robot's position", self.excess_s)
