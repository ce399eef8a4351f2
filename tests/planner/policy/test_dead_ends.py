"""What is around a goal that was given up is remembered; changes open it again."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from onemap_planner.policy.memory import DEAD_END_RETURNS, DeadEnd, surroundings, updated_dead_ends
from onemap_planner.world.map_view import MapView
from onemap_shared.messages import Occupancy
from tests.planner.drawn_maps import drawn_map

ROOM = drawn_map(*["." * 30] * 40)  # 4 x 3 m
PLACE = (1.5, 1.5)


def with_cells(cells: int, occupancy: Occupancy, x: int = 10) -> MapView:
    """The room with these cells of a row beside the place changed."""
    changed = ROOM.occupancy.copy()
    changed[x : x + 3].reshape(3, -1)[:, 8 : 8 + cells // 3] = occupancy
    return replace(ROOM, occupancy=changed)


def known(map_view: MapView = ROOM) -> tuple[DeadEnd, ...]:
    return updated_dead_ends((), (PLACE,), map_view)


@pytest.mark.parametrize(
    ("later", "is_open"),
    [
        pytest.param(ROOM, False, id="nothing has changed"),
        pytest.param(with_cells(30, Occupancy.OCCUPIED), True, id="something came"),
        pytest.param(with_cells(27, Occupancy.OCCUPIED), False, id="too little came"),
        pytest.param(with_cells(30, Occupancy.OCCUPIED, x=30), False, id="too far away"),
        pytest.param(with_cells(30, Occupancy.UNKNOWN), False, id="it is not known"),
    ],
)
def test_a_place_opens_when_what_is_around_it_changes(later: MapView, is_open: bool) -> None:
    (dead_end,) = updated_dead_ends(known(), (PLACE,), later)
    assert dead_end.open == is_open


def test_what_was_in_the_way_and_has_gone_opens_it() -> None:
    before = known(with_cells(30, Occupancy.OCCUPIED))
    (dead_end,) = updated_dead_ends(before, (PLACE,), ROOM)
    assert dead_end.open


def test_floor_that_becomes_known_does_not() -> None:
    before = known(with_cells(30, Occupancy.UNKNOWN))
    assert updated_dead_ends(before, (PLACE,), ROOM) == before


def test_a_place_is_offered_again_a_few_times_only() -> None:
    views = (ROOM, with_cells(30, Occupancy.OCCUPIED))
    dead_ends, opened = known(), 0
    for change in range(1, 9):
        x = PLACE[0] + 0.05 * change  # the border lies a little elsewhere each time
        dead_ends = updated_dead_ends(dead_ends, ((x, PLACE[1]),), views[change % 2])
        after = updated_dead_ends(dead_ends, ((x, PLACE[1]),), views[(change + 1) % 2])
        opened += any(each.open and each.xy[0] == x for each in after)
        dead_ends = after
    assert opened == DEAD_END_RETURNS


def test_a_place_that_is_no_longer_given_up_is_forgotten() -> None:
    assert updated_dead_ends(known(), (), ROOM) == ()


@pytest.mark.parametrize("xy", [(0.05, 0.05), (3.95, 2.95), (-0.5, 1.0), (9.0, 9.0)])
def test_beyond_the_view_nothing_is_known(xy: tuple[float, float]) -> None:
    patch = surroundings(ROOM, xy)
    assert patch.shape == (21, 21)
    centre = ROOM.grid.cells(np.asarray(xy))
    for i, j in ((10, 10), (0, 20), (20, 0), (3, 7)):
        cell = centre + (i - 10, j - 10)
        inside = bool(ROOM.grid.contains(cell))
        assert patch[i, j] == (Occupancy.FREE if inside else Occupancy.UNKNOWN)
