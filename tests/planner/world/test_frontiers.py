"""Both borders are frontiers; noise is none."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from onemap_planner.world import frontiers
from onemap_planner.world.frontiers import (
    DECAY_PER_M,
    MOST_EXPECTED,
    UNKNOWN_PRIOR,
    Frontier,
    area_in_view,
    find_frontiers,
)
from onemap_shared.geometry import F32
from onemap_shared.messages import Occupancy
from tests.planner.drawn_maps import costmap_of, drawn_map
from tests.reference import planning as reference

OPEN = drawn_map(*["." * 9] * 8)


def frontiers_of(*rows: str, similarity: F32 | None = None) -> tuple[Frontier, ...]:
    map_view = drawn_map(*rows, scale=5, similarity=similarity)
    return find_frontiers(map_view, costmap_of(map_view, (0.75, 0.75)))


def test_a_door_to_the_unknown_is_one() -> None:
    (found,) = frontiers_of("#####  ", "#....  ", "#...#  ", "#####  ")
    assert found.unknown
    assert UNKNOWN_PRIOR < found.score <= MOST_EXPECTED
    assert found.beyond_xy[1] > 2.5  # it looks outward
    assert {int(y) for _, y in found.cells} == {24}


def test_the_border_of_explored_and_observed_takes_the_best_similarity_beyond() -> None:
    rows = ("#######", "#..,,,#", "#..,,,#", "#######")
    similarity = np.full((20, 35), 0.1, np.float32)
    similarity[6, 28] = 0.7  # far inside O - E
    similarity[7, 7] = 0.9  # in E: no reason to cross the border
    (found,) = frontiers_of(*rows, similarity=similarity)
    assert not found.unknown
    assert found.score == pytest.approx(0.7 - DECAY_PER_M * 1.3, abs=0.05)


@settings(deadline=None, max_examples=40)
@given(
    arrays(bool, (8, 9)),
    arrays(np.float32, (8, 9), elements=st.floats(0, 1, width=32) | st.just(float("nan"))),
)
def test_similarity_beyond_is_that_of_the_slow_twin(beyond: np.ndarray, values: F32) -> None:
    view = replace(OPEN, similarity=values, explored=~beyond)
    found = frontiers._similarity_beyond(view, beyond, DECAY_PER_M)
    expected = reference.similarity_beyond(values, beyond, DECAY_PER_M * 0.1)
    expected[expected < frontiers.LEAST_SIMILARITY - 1e-9] = 0.0
    at_limit = np.abs(expected - frontiers.LEAST_SIMILARITY) < 1e-6
    np.testing.assert_allclose(found[~at_limit], expected[~at_limit], atol=1e-8)


@settings(deadline=None, max_examples=40)
@given(
    arrays(np.uint8, (8, 9), elements=st.sampled_from([0, 1, 2])),
    arrays(bool, (8, 9)),
    st.tuples(st.integers(0, 7), st.integers(0, 8)),
)
def test_the_area_in_view_is_that_of_the_slow_twin(
    occupancy: np.ndarray, wanted: np.ndarray, cell: tuple[int, int]
) -> None:
    view = replace(OPEN, occupancy=occupancy)
    (found,) = area_in_view(view, wanted, np.array([cell]), 0.55)
    occupied = occupancy == Occupancy.OCCUPIED
    expected = reference.area_in_view(occupied, wanted, np.array(cell), frontiers.RAYS, 5)
    assert found == pytest.approx(expected * view.cell_area_m2)


def test_small_gaps_and_spots_are_noise() -> None:
    map_view = drawn_map("#####", "#...#", "#...#", "#####", scale=5)
    map_view.occupancy[8:10, 8:10] = 0
    map_view.explored[12:14, 8:10] = False
    assert find_frontiers(map_view, costmap_of(map_view, (0.75, 0.75))) == ()


def test_a_hidden_corner_is_a_frontier() -> None:
    open_floor = ["......."] * 7
    behind = [*open_floor[:3], "..#  ..", "..#  ..", *open_floor[5:]]
    assert any(1 < f.beyond_xy[0] < 3 and 1 < f.beyond_xy[1] < 3 for f in frontiers_of(*behind))


def test_twice_the_unknown_area_in_view_lets_expect_twice_as_much(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def expected(depth: int, most_expected: float) -> float:
        """Beyond a wide opening, of unknown cells up to a wall."""
        rows = ("######", *["#....#"] * 3, *["#    #"] * depth, "######")
        map_view = drawn_map(*rows, scale=5)
        monkeypatch.setattr(frontiers, "MOST_EXPECTED", most_expected)
        found = find_frontiers(map_view, costmap_of(map_view, (0.75, 0.75)))
        return max(frontier.score for frontier in found)

    assert expected(4, 1.0) == pytest.approx(2 * expected(2, 1.0), rel=0.1)
    assert expected(4, 0.02) == 0.02  # however much is unknown


def test_what_the_camera_missed_along_the_way_is_looked_at_last() -> None:
    room = ["#......#"] * 3
    rows = ["########", *room, "###  ..#", *room, "########"]  # the spot touches a wall
    map_view = drawn_map(*rows, scale=5)

    def best(trail: list[list[float]]) -> float:
        costmap = costmap_of(map_view, (3.0, 3.0), trail_xy=np.array(trail).reshape(-1, 2))
        return max(
            f.score
            for f in find_frontiers(map_view, costmap)
            if 1.8 < f.beyond_xy[0] < 2.7 and 1.3 < f.beyond_xy[1] < 2.7
        )

    assert best([]) > 0.0
    assert best([[0.7, 2.0]]) == pytest.approx(best([]))  # from 1.3 m the camera sees the floor
    assert best([[1.8, 2.0]]) < 0.1 * best([])  # but it stays a goal: it may hide the only way out
