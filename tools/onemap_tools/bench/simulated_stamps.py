"""Stamps of simulated time: seconds since the start as nanoseconds, and back."""

from __future__ import annotations

START_S = 1.0  # the stamp 0 would mean that the map is empty


def stamp_of(now_s: float) -> int:
    """The stamp in nanoseconds of a simulated second."""
    return int((now_s + START_S) * 1e9)


def seconds_of(stamp_ns: int) -> float:
    """The simulated second of a stamp."""
    return stamp_ns * 1e-9 - START_S
