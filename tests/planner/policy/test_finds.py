"""What a step confirms becomes a find with its place, its extent and its picture."""

from __future__ import annotations

from dataclasses import replace

import pytest

from onemap_planner.policy.evidence import extent_m, finds_of, object_find
from onemap_planner.search.phases import Arrived, Confirmed
from onemap_planner.world.candidates import PictureOfObject
from onemap_shared.grid import GridSpec
from tests.planner.one_room import SEARCH, candidate

GRID = GridSpec(0.1, (5, 5), (3, 3))
VIEW = PictureOfObject(0.7, 123, (1.0, 2.0, 3.0, 4.0), b"jpeg")


def test_only_what_was_confirmed_is_a_find() -> None:
    sofa = candidate(2.0, 2.0)
    assert finds_of(SEARCH, (Arrived(sofa),), GRID) == ()
    (find,) = finds_of(SEARCH, (Arrived(sofa), Confirmed(sofa)), GRID)
    assert find == object_find(SEARCH, sofa, GRID)


def test_a_find_is_what_the_search_reports_with_the_best_view() -> None:
    sofa = replace(candidate(2.0, 2.0), best_view=VIEW, similarity=1.0000001)
    find = object_find(SEARCH, sofa, GRID)
    assert (find.name, find.search_id) == ("sofa", "id")
    assert (find.position_m, find.score) == ((2.0, 2.0, 0.5), 1.0)
    assert (find.stamp_ns, find.box_px, find.picture) == (123, (1.0, 2.0, 3.0, 4.0), b"jpeg")
    blind = object_find(SEARCH, replace(sofa, best_view=None), GRID)
    assert (blind.stamp_ns, blind.box_px, blind.picture) == (0, (), b"")


def test_the_extent_is_that_of_the_cells() -> None:
    cells = frozenset({(-3, 4), (2, 5), (0, -1)})
    found = extent_m(replace(candidate(2.0, 2.0), cells=cells), GRID)
    assert found == pytest.approx((-0.3, -0.1, 0.3, 0.6))
    assert extent_m(replace(candidate(2.0, 1.0), cells=frozenset()), GRID) == (2.0, 1.0, 2.0, 1.0)
