"""Outlines against the cells they surround."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import ndimage

from onemap_mapper.query.regions import outline
from onemap_shared.geometry import F32, I64
from onemap_shared.grid import GridSpec

GRID = GridSpec(0.1, (-4, 7), (20, 20))


def area_m2(corners: F32) -> float:
    """Of a polygon, positive if it runs counter-clockwise (Gauss)."""
    x, y = corners.astype(np.float64).T
    return float(0.5 * (x @ np.roll(y, -1) - y @ np.roll(x, -1)))


def contains(corners: F32, point: np.ndarray) -> bool:
    """Whether a polygon contains a point, by the crossings of a ray along x."""
    inside = False
    for (x0, y0), (x1, y1) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        if (y0 > point[1]) != (y1 > point[1]):
            inside ^= point[0] < x0 + (x1 - x0) * (point[1] - y0) / (y1 - y0)
    return inside


def test_a_rectangle_has_four_corners_and_a_hole_is_filled() -> None:
    ring = np.argwhere(np.pad(np.zeros((3, 2)), 1, constant_values=1))
    corners = outline(ring, GRID)
    assert len(corners) == 4
    assert np.isclose(area_m2(corners), 0.01 * 5 * 4, atol=1e-6)


def test_cells_that_touch_at_a_corner_have_one_outline() -> None:
    corners = outline(np.array([[0, 0], [1, 1]]), GRID)
    assert len(np.unique(corners, axis=0)) == len(corners)  # never touches itself
    assert area_m2(corners) > 0.02


@given(seed=st.integers(0, 2**16), density=st.floats(0.3, 0.9))
@settings(max_examples=60, deadline=None)
def test_the_polygon_contains_every_cell_and_few_others(seed: int, density: float) -> None:
    mask = np.random.default_rng(seed).random((12, 12)) < density
    parts, _ = ndimage.label(mask, np.ones((3, 3)))
    cells: I64 = np.argwhere(parts == 1)
    if len(cells) == 0:
        return
    corners = outline(cells, GRID)
    assert len(np.unique(corners, axis=0)) == len(corners)
    assert all(contains(corners, centre) for centre in GRID.centres(cells))
    grown = np.zeros((14, 14), bool)
    grown[tuple((cells + 1).T)] = True
    most = ndimage.binary_fill_holes(ndimage.binary_dilation(grown, np.ones((3, 3))))
    assert 0.01 * len(cells) - 1e-6 <= area_m2(corners) <= 0.01 * most.sum()
