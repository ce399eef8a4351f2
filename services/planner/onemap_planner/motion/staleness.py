"""Ages of the planner's inputs, and the check whether the robot may move on them.

Age counts from the arrival of a new message on the planner's monotonic clock; latched or
repeated messages do not count. Stamps are compared only with each other: odometry and frames
are both stamped by the robot, so the newest odometry tells the robot's clock, and the age of
the map's content follows without synchronised clocks.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from pydantic import Field, PositiveFloat

from onemap_shared.params import Params

MAX_COMPARABLE_LAG_S = 5.0  # more lag on fresh arrivals means a wrong stamp, not a slow map


@dataclass(frozen=True, slots=True)
class Arrival:
    """The newest message of a stream. sequence: or revision; at_s: time of arrival, seconds."""

    sequence: int
    stamp_ns: int
    at_s: float


class StalenessParams(Params):
    """How old, in seconds, the inputs may be while the robot moves."""

    max_odometry_age_s: PositiveFloat = Field(
        default=0.5, description="Seconds since new odometry came: 0.35 m at top speed."
    )
    max_map_age_s: PositiveFloat = Field(
        default=0.5,
        description="Seconds since a new revision of the map came: two updates at 4 Hz.",
    )
    max_map_lag_s: PositiveFloat = Field(
        default=1.0,
        description="Seconds from the capture of the frame the map last took in to the robot's "
        "clock now: an update period and what rendering, encoding and fusing take on two cores.",
    )
    max_plan_age_s: PositiveFloat = Field(
        default=1.5,
        description="Seconds a plan is followed without a newer one: four planning periods.",
    )


@dataclass(frozen=True, slots=True)
class InputAges:
    """Seconds, infinity before the first message; map_lag_s: robot's clock less the map's stamp."""

    odometry_s: float
    map_s: float
    map_lag_s: float


def newest(known: Arrival | None, arrival: Arrival) -> Arrival:
    """The arrival to keep: the new one, unless it repeats the known one."""
    return known if known is not None and known.sequence == arrival.sequence else arrival


def ages(odometry: Arrival | None, revision: Arrival | None, now_s: float) -> InputAges:
    """Ages at ``now_s``. The lag is 0 where stamps cannot be compared."""
    odometry_s = now_s - odometry.at_s if odometry else math.inf
    map_s = now_s - revision.at_s if revision else math.inf
    lag_s = 0.0
    if odometry and revision:
        # Both ages count from now: what is late in coming is not held against the map twice.
        lag_s = (odometry.stamp_ns - revision.stamp_ns) * 1e-9 + odometry_s
        if not 0.0 <= lag_s <= MAX_COMPARABLE_LAG_S:
            lag_s = 0.0
    return InputAges(odometry_s, map_s, lag_s)


def stale_reason(age: InputAges, params: StalenessParams) -> str:
    """Why the robot must stop, for people; empty if it may move."""
    if age.odometry_s > params.max_odometry_age_s:
        return _age_text("odometry", age.odometry_s)
    if age.map_s > params.max_map_age_s:
        return _age_text("the map", age.map_s)
    if age.map_lag_s > params.max_map_lag_s:
        return f"the map shows the world of {age.map_lag_s:.1f} s ago"
    return ""


def _age_text(what: str, age_s: float) -> str:
    return f"{what} has never arrived" if math.isinf(age_s) else f"{what} is {age_s:.1f} s old"
