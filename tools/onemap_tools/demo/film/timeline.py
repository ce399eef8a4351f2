"""Which moments a film shows, and for how long."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import TypeVar

from onemap_tools.demo.film.moment import FilmMoment

T = TypeVar("T")

SPEED = 4.0  # times faster than the search, unless the film would become too long
MAX_LENGTH_S = 15.0  # of the film
LAST_PICTURE_S = 2.0  # how long the last picture stands
MAX_MOMENTS = 200  # kept; drawn they take 310 MB
FIRST_INTERVAL_S = 0.25  # between two moments: 16 pictures per second of the film
MIN_PICTURE_MS = 20  # browsers show shorter ones for 100 ms


def spread(items: Sequence[T], count: int) -> list[T]:
    """At most ``count`` (2 or more) of the items, evenly spread, with the first and the last."""
    if len(items) <= count:
        return list(items)
    step = (len(items) - 1) / (count - 1)
    return [items[round(i * step)] for i in range(count)]


def film_speed(moments: Sequence[FilmMoment]) -> float:
    """How many times faster than the search the film is."""
    length_s = moments[-1].elapsed_s - moments[0].elapsed_s
    return max(SPEED, length_s / (MAX_LENGTH_S - LAST_PICTURE_S))


def durations_ms(moments: Sequence[FilmMoment], speed: float) -> list[int]:
    """Milliseconds for which each moment is shown: until the next one, the last one for long.

    Rounded to ten, which is what a GIF can tell apart; rounding errors do not add up.
    """
    start_s = moments[0].elapsed_s
    shown_at_ms = [round((each.elapsed_s - start_s) / speed * 100) * 10 for each in moments]
    return [
        *(max(after - before, MIN_PICTURE_MS) for before, after in pairwise(shown_at_ms)),
        round(LAST_PICTURE_S * 1000),
    ]
