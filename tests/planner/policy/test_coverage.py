"""What a search that found nothing says it has looked at."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from onemap_planner.policy.context import coverage_of
from tests.planner.one_room import context


def test_free_floor_explored_floor_and_the_best_match() -> None:
    room = context()
    seen = room.map_view
    explored = seen.explored.copy()
    explored[: len(explored) // 2] = False
    similarity = np.full(seen.grid.shape, 0.1, np.float32)
    similarity[12, 7] = 0.4
    view = replace(seen, explored=explored, similarity=similarity)
    coverage = coverage_of(replace(room, map_view=view))
    whole = coverage_of(room)
    assert whole.free_m2 == pytest.approx(whole.explored_m2)
    assert 0 < coverage.explored_m2 < coverage.free_m2 == whole.free_m2
    assert coverage.unreachable_m2 == 0.0
    assert coverage.best_score == pytest.approx(0.4)
    np.testing.assert_allclose(coverage.best_match_m, seen.grid.centres(np.array([12, 7])))


def test_without_features_there_is_no_best_match() -> None:
    room = context()
    nothing = np.full(room.map_view.grid.shape, np.nan, np.float32)
    coverage = coverage_of(replace(room, map_view=replace(room.map_view, similarity=nothing)))
    assert (coverage.best_match_m, coverage.best_score) == ((), 0.0)
