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
from dataclasses import dataclass
from typing import ClassVar

from pydantic import Field, PositiveFloat

from onemap_shared.params import Params

MAX_COMPARABLE_LAG_S = 5.0  # more lag on fresh arrivals means a wrong stamp, not a slow map


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
    # Seconds that odometry may arrive later than the fastest of the last minute, by its stamp,
    # where the robot names no command and the loop cannot be measured: one way of two.
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
    # Seconds a plan is followed without a newer one: four planning periods.
    max_plan_age_s: ClassVar[float] = 1.5


@dataclass(frozen=True, slots=True)
class InputAges:
    """Seconds, infinity before the first message; map_lag_s: robot's clock less the map's stamp;
    map_period_s: between new frames in the map, infinity before it was measured."""

    odometry_s: float
    map_s: float
    map_lag_s: float
    map_period_s: float = math.inf

    @property
    def map_content_s(self) -> float:
        """How old what the map shows may become before the next frame, as far as it is known."""
        period_s = self.map_period_s if math.isfinite(self.map_period_s) else 0.0
        return max(self.map_s, self.map_lag_s, period_s)


def newest(known: Arrival | None, arrival: Arrival) -> Arrival:
    """The arrival to keep: the new one, unless it repeats the known one."""
    return known if known is not None and known.sequence == arrival.sequence else arrival


def ages(
    odometry: Arrival | None, revision: Arrival | None, now_s: float, map_period_s: float = math.inf
) -> InputAges:
    """Ages at ``now_s``. The lag is 0 where stamps cannot be compared."""
    odometry_s = now_s - odometry.at_s if odometry else math.inf
    map_s = now_s - revision.at_s if revision else math.inf
    lag_s = 0.0
    if odometry and revision:
        # Both ages count from now: what is late in coming is not held against the map twice.
        lag_s = (odometry.stamp_ns - revision.stamp_ns) * 1e-9 + odometry_s
        if not 0.0 <= lag_s <= MAX_COMPARABLE_LAG_S:
            lag_s = 0.0
    return InputAges(odometry_s, map_s, lag_s, map_period_s)


def map_age_limit_s(period_s: float, params: StalenessParams) -> float:
    """Seconds without a new frame in the map that stop the robot, at this measured period."""
    periods_s = params.map_periods * period_s if math.isfinite(period_s) else 0.0
    return min(max(periods_s, params.min_map_age_s), params.max_map_age_s)


def stale_reason(age: InputAges, params: StalenessParams) -> str:
    """Why the robot must stop, for people; empty if it may move."""
    if age.odometry_s > params.max_odometry_age_s:
        return _age_text("odometry", age.odometry_s)
    limit_s = map_age_limit_s(age.map_period_s, params)
    if age.map_s > limit_s:
        return _age_text("the map", age.map_s)
    if age.map_lag_s > params.map_lag_factor * limit_s:
        return f"the map shows the world of {age.map_lag_s:.1f} s ago"
    return ""


def _age_text(what: str, age_s: float) -> str:
    return f"{what} has never arrived" if math.isinf(age_s) else f"{what} is {age_s:.1f} s old"
