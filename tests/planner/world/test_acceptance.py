"""Many near detections outweigh a map that disagrees weakly, and nothing else does."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from onemap_planner.world.candidates import (
    CERTAIN,
    DETECTED,
    LOOKS_DIFFERENT,
    MISTAKEN,
    MISTAKEN_THINGS,
    RANK_SCALE,
    SAME_SIDE_M,
    ViewpointTally,
    probability,
    with_view,
)


def sides(hits: int, frames: int, number: int) -> list[ViewpointTally]:
    """The same views from several places."""
    return [ViewpointTally((float(index), 0.0), hits, frames) for index in range(number)]


@pytest.mark.parametrize(
    ("hits", "number", "rank", "sure"),
    [
        pytest.param(22, 3, 0.95, True, id="found in most views from three sides"),
        pytest.param(22, 1, 0.95, False, id="from one side only"),
        pytest.param(30, 9, 0.6, False, id="the map says that it is something else"),
        pytest.param(15, 6, 1.0, False, id="in half of the views, from six sides"),
        pytest.param(6, 3, 1.0, False, id="in a fifth of the views"),
    ],
)
def test_what_outweighs_a_map_that_does_not_agree(
    hits: int, number: int, rank: float, sure: bool
) -> None:
    assert (probability(sides(hits, 30, number), rank) >= CERTAIN) is sure


def test_it_is_bayes_rule_with_the_stated_rates() -> None:
    is_object = LOOKS_DIFFERENT * math.exp(-0.1 / RANK_SCALE) / RANK_SCALE
    is_object *= DETECTED**3 * (1 - DETECTED)
    is_other = MISTAKEN_THINGS * MISTAKEN**3 * (1 - MISTAKEN)
    expected = is_object / (is_object + is_other)
    assert probability(sides(3, 4, 1), 0.9) == pytest.approx(expected)


@given(st.integers(0, 30), st.floats(0.8, 1))
def test_more_frames_from_one_place_change_nothing(hits: int, rank: float) -> None:
    once = probability(sides(hits, 30, 1), rank)
    assert probability(sides(7 * hits, 210, 1), rank) == pytest.approx(once)


def test_without_knowledge_of_the_map_it_is_nothing() -> None:
    assert probability(sides(30, 30, 3), math.nan) == 0.0


def test_views_from_about_one_place_are_counted_together() -> None:
    tallies: tuple[ViewpointTally, ...] = ()
    for x, hit in ((0.0, True), (0.9 * SAME_SIDE_M, False), (3.0, True), (0.1, True)):
        tallies = with_view(tallies, (x, 0.0), hit=hit)
    assert [(tally.hits, tally.frames) for tally in tallies] == [(2, 3), (1, 1)]
