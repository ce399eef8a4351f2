"""The map view holds the known part of the map and the robot."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from onemap_planner.world.map_view import MAX_OUTSIDE_M, map_view_around, outside_reason
from onemap_planner.world.regions import find_regions
from onemap_shared.grid import GridSpec
from onemap_shared.messages import Occupancy, SearchView
from tests.planner.drawn_maps import drawn_map, search_view_of


def test_the_window_holds_what_is_known_and_the_robot() -> None:
    view = search_view_of(drawn_map("          ", "   ..#    ", "          "))
    map_view = map_view_around(view, np.array([0.95, -0.35]))
    assert map_view.grid.contains(map_view.grid.cells(np.array([0.95, -0.35])))
    cell = map_view.grid.cells(view.grid.centres(np.array([1, 5])))
    assert map_view.occupancy[tuple(cell)] == Occupancy.OCCUPIED
    assert map_view.occupancy.sum() == view.occupancy.sum()
    assert map_view.explored.sum() == 3
    assert np.isnan(map_view.similarity).sum() == map_view.similarity.size - 3


def test_the_margin_over_a_rival_survives_the_crop_around_the_robot() -> None:
    view = search_view_of(drawn_map(*["." * 20] * 20))  # similarity 0.1
    rival = np.full(view.grid.shape, np.nan, np.float32)
    rival[5, 5], rival[5, 6] = 0.7, 0.05
    cropped = map_view_around(replace(view, rival=rival), np.array([0.5, 0.5]))
    x, y = np.array([5, 5]) - np.asarray(cropped.grid.origin_cell)
    assert cropped.margin[x, y] == pytest.approx(-0.6)
    assert cropped.margin[x, y + 1] == pytest.approx(0.05)
    assert np.isposinf(cropped.margin[x + 5, y])
    assert np.isposinf(map_view_around(view, np.array([0.5, 0.5])).margin).all()


@pytest.mark.parametrize(("score", "regions"), [(0.9, 1), (0.02, 0)])
def test_without_calibration_the_place_in_the_ranking_is_the_similarity(
    score: float, regions: int
) -> None:
    """Goals go by the score too: the best cells of a map need not be like the object."""
    view = search_view_of(drawn_map(*["." * 10] * 10))
    guidance = np.arange(1, 101, dtype=np.float32).reshape(10, 10) * 2.54 + 1
    view = replace(
        view,
        similarity=np.linspace(score, score + 0.02, 100, dtype=np.float32).reshape(10, 10),
        guidance=guidance.astype(np.uint8),
    )
    at = np.array([0.5, 0.5])
    assert np.nanmin(map_view_around(view, at).similarity) >= np.float32(score)
    ranked = map_view_around(replace(view, calibrated=False), at)
    known = ranked.similarity[ranked.observed]
    assert (np.sort(known)[:90] == 0).all()
    assert known.max() == pytest.approx(1.0)
    assert 8 <= (known > 0).sum() <= 11
    assert len(find_regions(replace(ranked, similarity=ranked.promise))) == regions
    assert len(find_regions(ranked)) == 1


@pytest.mark.parametrize(("x_m", "outside"), [(-49.0, False), (51.0, False), (90_000.0, True)])
def test_a_robot_far_outside_the_map_cannot_use_it(x_m: float, outside: bool) -> None:
    view = search_view_of(drawn_map(*["." * 20] * 20))
    reason = outside_reason(view, (x_m, 0.5))
    assert bool(reason) is outside
    assert not outside or f"the limit is {MAX_OUTSIDE_M:g} m" in reason
    nothing = np.zeros((0, 0), np.uint8)
    empty = SearchView(
        "", 0, 0, 0, GridSpec(0.1, (0, 0), (0, 0)), nothing, nothing, np.zeros((0, 0), np.float32)
    )
    assert not outside_reason(empty, (x_m, 0.5))
