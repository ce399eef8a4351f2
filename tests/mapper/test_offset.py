"""What a frame shows, matched against the map: where the pose is right, and where it is not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.frame.update import compute_update
from onemap_mapper.occupancy.offset import LEAST_CELLS, REACH_CELLS, offset_cells
from onemap_shared.geometry import I64, U8
from onemap_shared.messages import Occupancy
from tests.mapper import scenes
from tests.mapper.scenes import ROOM, Box

FRAME = 2 * REACH_CELLS + 1  # cells are shifted, and searched for when they are


def room() -> tuple[I64, U8]:
    """What stands in a room of 5 x 4 m with two things in it, and the map of it."""
    lasting = np.full((50 + 2 * FRAME, 40 + 2 * FRAME), Occupancy.UNKNOWN, np.uint8)
    inside = lasting[FRAME:-FRAME, FRAME:-FRAME]
    inside[:] = Occupancy.OCCUPIED
    inside[1:-1, 1:-1] = Occupancy.FREE
    inside[10:14, 25:33] = inside[36:44, 8:11] = Occupancy.OCCUPIED
    return np.argwhere(lasting == Occupancy.OCCUPIED), lasting


@given(st.tuples(*[st.integers(-REACH_CELLS, REACH_CELLS)] * 2))
def test_a_shift_is_told_by_its_length_and_none_where_there_is_none(shift: tuple[int, int]) -> None:
    cells, lasting = room()
    told, by = offset_cells(cells + shift, lasting), float(np.hypot(*shift))
    if by <= np.sqrt(2):
        assert told == 0.0
    elif by >= LEAST_CELLS:
        assert told == pytest.approx(by, abs=1.5)


def test_people_a_new_room_and_a_bare_corner_are_no_shift() -> None:
    cells, lasting = room()
    people = np.argwhere(np.ones((5, 5), bool)) + 25
    assert offset_cells(np.vstack([cells, people]), lasting) == 0.0
    lasting[FRAME + 20 :] = Occupancy.UNKNOWN  # what is seen there now stands beside what was
    for by in range(-REACH_CELLS, REACH_CELLS + 1):
        new = cells[cells[:, 0] >= FRAME + 20]
        assert offset_cells(new + (by, 0), lasting) == 0.0
    assert offset_cells(room()[0][:20] + (0, 4), room()[1]) == 0.0


def test_the_map_tells_of_a_robot_that_was_pushed_in_the_frame_that_shows_it() -> None:
    """By 0.4 m to the left, while its odometry says that it turns on the spot."""
    belief, shelf = BeliefMap(scenes.params()), Box((1.0, -1.6, 0.0), (1.4, -0.8, 1.2))

    def fuse(sequence: int, pushed_m: float) -> float:
        yaw_rad = 0.5 * sequence
        seen = scenes.pose(0.0, pushed_m, yaw_rad)
        field = scenes.field(sequence, seen, boxes=(*ROOM, shelf))
        told = replace(field, T_map_camera=scenes.pose(0.0, 0.0, yaw_rad))
        belief.fuse(compute_update(told, belief.params))
        return belief.history().offset_m

    assert [fuse(k, 0.0) for k in range(52)] == [0.0] * 52
    assert fuse(52, 0.4) == pytest.approx(0.4, abs=0.11)
