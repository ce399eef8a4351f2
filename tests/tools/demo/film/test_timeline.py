"""Which moments a film shows, and for how long."""

from __future__ import annotations

from itertools import pairwise

import pytest

from onemap_tools.demo.film.timeline import (
    LAST_PICTURE_S,
    MAX_LENGTH_S,
    MIN_PICTURE_MS,
    SPEED,
    durations_ms,
    film_speed,
    spread,
)
from tests.tools.demo.film.moments import moment


@pytest.mark.parametrize("count", [2, 3, 7, 50])
def test_a_spread_has_the_first_and_the_last(count: int) -> None:
    items = list(range(50))
    kept = spread(items, count)
    assert len(kept) == count
    assert (kept[0], kept[-1]) == (0, 49)
    assert kept == sorted(set(kept))
    steps = {after - before for before, after in pairwise(kept)}
    assert max(steps) - min(steps) <= 1
    assert spread(items[:2], count) == items[:2]


def test_a_short_search_is_shown_at_the_usual_speed() -> None:
    assert film_speed([moment(3.0)]) == SPEED
    assert film_speed([moment(3.0), moment(30.0)]) == SPEED


@pytest.mark.parametrize("length_s", [20.0, 60.0, 150.0, 900.0])
def test_a_film_is_no_longer_than_its_limit(length_s: float) -> None:
    moments = [moment(1.0 + length_s * i / 100) for i in range(101)]
    durations = durations_ms(moments, film_speed(moments))
    assert len(durations) == len(moments)
    assert sum(durations) / 1000 <= MAX_LENGTH_S + 0.01
    assert durations[-1] == LAST_PICTURE_S * 1000


def test_pictures_keep_the_rhythm_of_the_search() -> None:
    durations = durations_ms([moment(0.0), moment(0.4), moment(2.4), moment(2.4)], 4.0)
    assert durations == [100, 500, MIN_PICTURE_MS, 2000]
