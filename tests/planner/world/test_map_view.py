"""The map view holds the known part of the map and the robot."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from onemap_planner.world.map_view import MapView, map_view_around
from onemap_shared.grid import GridSpec
from onemap_shared.messages import Occupancy, SearchView
from tests.planner.drawn_maps import (
    drawn_map,
    search_view_of,
)


def test_the_window_holds_what_is_known_and_the_robot() -> None:
    view = search_view_of(drawn_map("          ", "   ..#    ", "          "))
    map_view = map_view_around(view, np.array([0.95, -0.35]))
    assert map_view.grid.contains(map_view.grid.cells(np.array([0.95, -0.35])))
    cell = map_view.grid.cells(view.grid.centres(np.array([1, 5])))
    assert map_view.occupancy[tuple(cell)] == Occupancy.OCCUPIED
    assert map_view.occupancy.sum() == view.occupancy.sum()
    assert map_view.explored.sum() == 3
    assert np.isnan(map_view.similarity).sum() == map_view.similarity.size - 3


def test_an_empty_map_gives_a_window_around_the_robot() -> None:
    empty = SearchView(
        text="",
        revision=0,
        sequence=0,
        stamp_ns=0,
        grid=GridSpec(0.1, (0, 0), (0, 0)),
        occupancy=np.zeros((0, 0), np.uint8),
        layers=np.zeros((0, 0), np.uint8),
        similarity=np.zeros((0, 0), np.float32),
    )
    map_view = map_view_around(empty, np.array([3.0, -4.0]))
    assert map_view.grid.contains(map_view.grid.cells(np.array([3.0, -4.0])))
    assert not map_view.observed.any()
    assert np.isnan(map_view.similarity).all()


BED = frozenset((x, y) for x in range(4, 14) for y in range(4, 12))


def map_view_where(
    own: dict[tuple[int, int], float], rival: dict[tuple[int, int], float]
) -> MapView:
    """20 x 20 cells of 0.1 m with these scores of the target and of its best rival."""
    similarity, best = (np.full((20, 20), 0.05, np.float32) for _ in range(2))
    for cells, grid in ((own, similarity), (rival, best)):
        for cell, score in cells.items():
            grid[cell] = score
    return replace(drawn_map(*["." * 20] * 20), similarity=similarity, rival=best)


def test_the_rival_s_score_survives_the_crop_around_the_robot() -> None:
    map_view = map_view_where({}, dict.fromkeys(BED, 0.7))
    view = replace(search_view_of(map_view), rival=map_view.rival)
    cropped = map_view_around(view, np.array([0.5, 0.5]))
    x, y = np.array([5, 5]) - np.asarray(cropped.grid.origin_cell)
    assert cropped.rival[x, y] == pytest.approx(0.7)
    alone = map_view_around(search_view_of(map_view), np.array([0.5, 0.5]))
    assert np.isneginf(alone.rival).all()
