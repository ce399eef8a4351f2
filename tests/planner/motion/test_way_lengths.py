"""Lengths of ways on the coarse grid: round walls, through doors, beyond the known floor."""

from __future__ import annotations

import numpy as np
import pytest

from onemap_planner.motion.path import BEYOND_FACTOR, COARSE_M, cost_to_go_from, way_lengths
from onemap_shared.geometry import Bool
from onemap_shared.grid import GridSpec

GRID = GridSpec(0.1, (0, 0), (100, 80))


def two_rooms() -> Bool:
    """Floor for the robot's centre: two rooms of 5 x 8 m, with a door at y from 6 to 6.5 m."""
    floor = np.ones(GRID.shape, bool)
    floor[47:53] = False
    floor[47:53, 60:65] = True
    return floor


@pytest.mark.parametrize("to", [(1.0, 7.0), (9.0, 1.0), (9.0, 7.0), (4.0, 1.0)])
def test_a_way_is_about_as_long_as_on_the_fine_grid(to: tuple[float, float]) -> None:
    floor, start = two_rooms(), (1.0, 1.0)
    fine = cost_to_go_from(np.where(floor, 1.0, -1.0), (10, 10), cell_size_m=0.1)
    exact = fine.cost_m[int(to[0] / 0.1), int(to[1] / 0.1)]
    ((length,),) = way_lengths(GRID, floor, np.array([start]), np.array([to]))
    assert length == pytest.approx(exact, abs=2 * COARSE_M)


def test_beyond_the_floor_the_way_is_the_distance_and_a_half() -> None:
    floor = np.zeros(GRID.shape, bool)
    floor[:51] = True
    points = np.array([[1.0, 4.0], [8.0, 4.0]])
    lengths = way_lengths(GRID, floor, points, points)
    assert lengths[0, 0] == 0.0
    assert lengths[0, 1] == pytest.approx(4.0 + BEYOND_FACTOR * 3.0, abs=2 * COARSE_M)
    assert lengths[0, 1] == pytest.approx(lengths[1, 0])


def test_without_floor_or_door_there_is_no_way() -> None:
    points = np.array([[1.0, 1.0], [9.0, 1.0]])
    assert np.isinf(way_lengths(GRID, np.zeros(GRID.shape, bool), points, points)).all()
    closed = two_rooms()
    closed[47:53] = False
    assert np.isinf(way_lengths(GRID, closed, points, points)[0, 1])
