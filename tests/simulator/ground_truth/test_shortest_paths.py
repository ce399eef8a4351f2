"""Shortest paths on a grid: lengths against the straight line, walls, and no path at all."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from onemap_simulator.ground_truth.shortest_paths import ShortestPaths

cells = st.tuples(st.integers(0, 39), st.integers(0, 29))


def goals_at(*places: tuple[int, int]) -> np.ndarray:
    goals = np.zeros((40, 30), bool)
    for place in places:
        goals[place] = True
    return goals


@settings(max_examples=100, deadline=None, derandomize=True)
@given(start=cells, first=cells, second=cells)
def test_in_the_open_it_is_the_straight_line_to_the_nearest_goal(
    start: tuple[int, int], first: tuple[int, int], second: tuple[int, int]
) -> None:
    paths = ShortestPaths.to(goals_at(first, second), np.ones((40, 30), bool))
    straight = min(np.hypot(*np.subtract(start, end)) for end in (first, second))
    length = paths.length(np.array(start))
    assert straight - 1e-9 <= length <= 1.014 * straight + 1e-9


def test_no_path_leads_through_a_wall_however_thin() -> None:
    free = np.ones((40, 30), bool)
    free[20, :25] = False
    around = ShortestPaths.to(goals_at((25, 5)), free).length(np.array([15, 5]))
    assert around == pytest.approx(np.hypot(5, 20) * 2, rel=0.02)
    free[20] = False
    assert ShortestPaths.to(goals_at((25, 5)), free).length(np.array([15, 5])) == np.inf


def test_without_a_goal_there_is_no_path() -> None:
    assert ShortestPaths.to(goals_at(), np.ones((40, 30), bool)).length(np.array([1, 1])) == np.inf


def test_a_goal_needs_no_path() -> None:
    assert (
        ShortestPaths.to(goals_at((3, 4)), np.ones((40, 30), bool)).length(np.array([3, 4])) == 0.0
    )
