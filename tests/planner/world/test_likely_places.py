"""Places of the map that look like an object."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from onemap_planner.world.map_view import MapView
from onemap_planner.world.regions import MAX_PLACES, likely_places
from tests.planner.drawn_maps import drawn_map

ROOM = drawn_map(*["." * 20] * 20)


def with_peaks(*peaks: tuple[int, int, float]) -> MapView:
    similarity = ROOM.similarity.copy()
    for x, y, score in peaks:
        similarity[x : x + 2, y : y + 2] = score
    return replace(ROOM, similarity=similarity, margin=ROOM.margin.copy())


def test_the_best_places_are_those_of_the_highest_similarity() -> None:
    view = with_peaks((2, 2, 0.6), (10, 2, 0.9), (2, 10, 0.7), (14, 14, 0.8))
    places = likely_places(view, view.observed, threshold=0.5, refuted=frozenset())
    assert len(places) == MAX_PLACES
    assert [round(place.probability, 3) for place in places] == [0.9, 0.8, 0.7]
    assert np.allclose(places[0].xy, (1.05, 0.25))
    assert places[0].cells == {(10, 2), (10, 3), (11, 2), (11, 3)}


def test_what_is_more_like_another_name_or_not_asked_for_is_none() -> None:
    view = with_peaks((2, 2, 0.9), (10, 10, 0.9))
    view.margin[2:4, 2:4] = -0.1
    among = view.observed.copy()
    among[10:12, 10:12] = False
    assert likely_places(view, among, threshold=0.5, refuted=frozenset()) == ()


def test_a_place_that_was_searched_for_the_greater_part_is_left_out() -> None:
    view = with_peaks((2, 2, 0.9))
    for refuted, left in ((frozenset({(2, 2)}), 1), (frozenset({(2, 2), (3, 3)}), 0)):
        assert len(likely_places(view, view.observed, threshold=0.5, refuted=refuted)) == left
