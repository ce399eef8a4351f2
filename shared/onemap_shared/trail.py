"""Trails: where a robot has been, as points on the floor."""

from __future__ import annotations

from math import hypot, inf
from typing import TypeAlias

PointM: TypeAlias = tuple[float, float]


def extended(
    trail: tuple[PointM, ...],
    xy: PointM,
    *,
    step_m: float,
    max_points: int | None = None,
    jump_m: float = inf,
) -> tuple[PointM, ...]:
    """The trail with ``xy`` (metres, map frame) added if it lies ``step_m`` from the last point.

    ``max_points``: the oldest points beyond this number go. ``jump_m``: a longer step starts a
    new trail, because no robot moves so far between two readings.
    """
    if not trail:
        return (xy,)
    step = hypot(xy[0] - trail[-1][0], xy[1] - trail[-1][1])
    if step > jump_m:
        return (xy,)
    if step < step_m:
        return trail
    kept = (*trail, xy)
    return kept if max_points is None else kept[-max_points:]
