"""How high the pixels of cells are, and where in height a match lies."""

from __future__ import annotations

import numpy as np
import pytest

from onemap_mapper.frame.update import compute_update
from onemap_mapper.occupancy.heights import LEVELS, height_band, tops_dm
from onemap_shared.geometry import F32
from tests.mapper import scenes

FLOOR, SEAT, TOP, ABOVE = 0, 2, 4, 5  # levels: up to 0.1, 0.3 to 0.5, 0.7 to 0.9, 0.9 to 1.1 m


def at(**shares: float) -> F32:
    """Shares (1, LEVELS) by the name of a level."""
    row = np.zeros((1, LEVELS), np.float32)
    for name, share in shares.items():
        row[0, globals()[name.upper()]] = share
    return row


def test_shares_say_how_high_the_pixels_of_a_cell_are() -> None:
    shelf = scenes.Box((1.5, -0.5, 0.0), (2.5, 0.5, 0.76))
    params = scenes.params()
    field = scenes.field(0, scenes.pose(), boxes=(*scenes.ROOM, shelf))
    update = compute_update(field, params)
    heights, cells = update.heights, update.cells
    total = heights.sum(axis=1)
    known = total > 0
    assert known.mean() > 0.5
    np.testing.assert_allclose(total[known], 1.0, atol=1e-5)
    centre = (cells + 0.5) * params.cell_size_m
    on_shelf = known & (np.abs(centre - (1.8, 0.0)) < (0.2, 0.3)).all(axis=1)
    assert (heights[on_shelf, TOP] > 0.99).all()
    assert (tops_dm(heights[on_shelf]) == 8).all()
    assert (tops_dm(heights[~known]) == 0).all()
    in_front = known & (np.abs(centre - (1.9, -1.2)) < (0.2, 0.3)).all(axis=1)
    assert (heights[in_front, FLOOR] == 1).all()


@pytest.mark.parametrize(
    ("inside", "around", "band"),
    [
        (at(top=0.6, above=0.4), at(top=1.0), (0.9, 1.1)),  # on a table
        (at(top=0.5, floor=0.5), at(top=0.9, floor=0.1), (0.0, 0.1)),  # under it
        (at(top=0.7, floor=0.3), at(floor=1.0), (0.7, 0.9)),  # the table
        (at(floor=1.0), at(floor=1.0), (0.0, 0.1)),  # a rug
        (at(seat=0.5, top=0.5), np.zeros((0, LEVELS), np.float32), (0.3, 0.9)),  # all of the map
    ],
)
def test_a_match_lies_where_its_cells_differ_from_those_beside(
    inside: F32, around: F32, band: tuple[float, float]
) -> None:
    np.testing.assert_allclose(height_band(inside, np.ones(1, np.float32), around), band, atol=1e-6)
