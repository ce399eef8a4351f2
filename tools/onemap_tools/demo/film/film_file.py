"""Writes the film of a search, within a limit of bytes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from onemap_tools.demo.film.drawing import common_bounds, draw_moment
from onemap_tools.demo.film.encoding import encode_animation
from onemap_tools.demo.film.moment import FilmMoment
from onemap_tools.demo.film.timeline import MAX_MOMENTS, durations_ms, film_speed, spread
from onemap_tools.errors import CliError

MAX_BYTES = 3_000_000  # pages that show the film load it whole
ROOM = 0.93  # of the limit is aimed at: pictures differ in size


@dataclass(frozen=True, slots=True)
class FilmFacts:
    """What was written. ``pictures``: how many, of which equal ones may have become one."""

    pictures: int
    length_s: float
    bytes: int


def write_film(path: Path, moments: Sequence[FilmMoment], max_bytes: int = MAX_BYTES) -> FilmFacts:
    """Write the film of at least one moment; CliError if the file cannot be written.

    Pictures are left out, evenly, until it has at most ``max_bytes``; never the last two.
    """
    moments = spread(moments, MAX_MOMENTS)
    speed = film_speed(moments)
    bounds_m = common_bounds(moments)
    shown = [(moment, draw_moment(moment, bounds_m, speed)) for moment in moments]
    while True:
        durations = durations_ms([moment for moment, _ in shown], speed)
        data = encode_animation([picture for _, picture in shown], durations, path.suffix.lower())
        if len(data) <= max_bytes or len(shown) <= 2:
            break
        fitting = int(len(shown) * ROOM * max_bytes / len(data))
        shown = spread(shown, max(fitting, 2))
    try:
        path.write_bytes(data)
    except OSError as problem:
        raise CliError(f"The film cannot be written to {path}: {problem.strerror}.") from problem
    return FilmFacts(len(shown), sum(durations) / 1000, len(data))
