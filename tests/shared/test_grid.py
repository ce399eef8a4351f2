from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from onemap_shared.grid import MAX_CELLS, GridSpec, GridTooLarge, world_cells

origins = st.tuples(st.integers(-500, 500), st.integers(-500, 500))
shapes = st.tuples(st.integers(0, 400), st.integers(0, 400))
sizes = st.sampled_from([0.05, 0.1, 0.25, 1.0])
grids = st.builds(GridSpec, sizes, origins, shapes)
coordinates = st.floats(-200, 200)
corners = st.floats(-100, 100)  # 16 million cells of 0.05 m


@given(grids, st.integers(-600, 600), st.integers(-600, 600))
def test_a_cell_contains_its_own_centre(grid: GridSpec, ix: int, iy: int) -> None:
    cell = np.array([ix, iy])
    np.testing.assert_array_equal(grid.cells(grid.centres(cell)), cell)


@given(grids, coordinates, coordinates)
def test_cells_agree_with_the_obvious_floor(grid: GridSpec, x: float, y: float) -> None:
    obvious = [
        math.floor(x / grid.cell_size_m) - grid.origin_cell[0],
        math.floor(y / grid.cell_size_m) - grid.origin_cell[1],
    ]
    assert grid.cells(np.array([x, y])).tolist() == obvious


def test_world_cells_are_computed_in_the_precision_of_the_points() -> None:
    point = np.array([0.7, -0.7], np.float32)
    assert world_cells(point, 0.1).tolist() == [7, -7]  # in float64 0.7 of float32 is in cell 6


@given(sizes, corners, corners, corners, corners)
def test_covering_contains_both_corners(
    size: float, x0: float, y0: float, x1: float, y1: float
) -> None:
    lower, upper = (min(x0, x1), min(y0, y1)), (max(x0, x1), max(y0, y1))
    grid = GridSpec.covering(size, lower, upper)
    assert grid.contains(grid.cells(np.array([lower, upper]))).all()


@pytest.mark.parametrize("size", [0.0, -1.0, float("nan"), float("inf")])
def test_impossible_cell_sizes_are_refused(size: float) -> None:
    with pytest.raises(ValueError, match="cell_size_m"):
        GridSpec(size, (0, 0), (1, 1))


def test_no_grid_is_larger_than_memory_allows() -> None:
    assert GridSpec(0.1, (0, 0), (MAX_CELLS, 1)).shape == (MAX_CELLS, 1)
    with pytest.raises(GridTooLarge, match="did the pose jump"):
        GridSpec(0.1, (0, 0), (MAX_CELLS, 2))
    with pytest.raises(GridTooLarge, match="900001 x 900001 cells"):
        GridSpec.covering(0.1, (0.0, 0.0), (9e4, 9e4))
