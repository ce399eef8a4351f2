"""Rooms of drawn floor plans: cut at doors, and the same rooms while the map grows."""

from __future__ import annotations

import numpy as np
import pytest

from onemap_mapper.places.rooms import Rooms, identified, labelled
from onemap_shared.geometry import F64, Bool
from onemap_shared.grid import GridSpec
from onemap_shared.messages import NO_ROOM, RoomChange

SHAPE = (80, 60)  # two rooms, 4 m by 6 m, and the wall between them in row 40


def grid_of(mask: Bool) -> GridSpec:
    return GridSpec(0.1, (-8, 3), (mask.shape[0], mask.shape[1]))


def plan(door: slice = slice(10, 20)) -> tuple[Bool, Bool]:
    """Floor and walls of two rooms with a door of 1 m."""
    walls = np.zeros(SHAPE, bool)
    walls[[0, -1]] = walls[:, [0, -1]] = walls[40] = True
    walls[40, door] = False
    return ~walls, walls


def rooms(
    free: Bool, low: Bool, walls: Bool, grid: GridSpec, previous: Rooms | None = None
) -> Rooms:
    revision = 1 if previous is None else previous.revision + 1
    return identified(labelled(free, low, walls, grid.cell_size_m), grid, previous, revision)


def cut(free: Bool, walls: Bool, previous: Rooms | None = None) -> Rooms:
    return rooms(free, np.zeros(SHAPE, bool), walls, grid_of(free), previous)


def turned_plan(angle_deg: float) -> tuple[Bool, Bool, F64]:
    """Floor and walls of the same rooms on a turned map, and metres along the longer side."""
    centres = (np.argwhere(np.ones((120, 120))) + 0.5).reshape(120, 120, 2) * 0.1 - 6.0
    c, s = np.cos(np.deg2rad(angle_deg)), np.sin(np.deg2rad(angle_deg))
    along, across = np.moveaxis(centres @ [[c, -s], [s, c]] + (4.0, 3.0), 2, 0)
    inside = (np.abs(along - 4.0) < 4.05) & (np.abs(across - 3.0) < 3.05)
    walls = (np.abs(np.abs(along - 4.0) - 4.0) < 0.07) | (np.abs(np.abs(across - 3.0) - 3.0) < 0.07)
    walls |= (np.abs(along - 4.0) < 0.07) & (np.abs(across - 1.5) > 0.5)
    return inside & ~walls, inside & walls, along


@pytest.mark.parametrize("angle_deg", [0.0, 5.0, 27.0, 45.0, 200.0])
def test_a_door_parts_two_rooms_however_they_lie(angle_deg: float) -> None:
    free, walls, along = turned_plan(angle_deg)
    found = rooms(free, np.zeros_like(free), walls, grid_of(free))
    (west,) = np.unique(found.ids[free & (along < 3.9)])
    (east,) = np.unique(found.ids[free & (along > 4.1)])
    assert west != east
    assert set(found.ids[free]) == {west, east}
    assert (found.ids[~free] == NO_ROOM).all()


def test_furniture_parts_no_room_and_a_niche_is_none() -> None:
    free, walls = plan()
    low = np.zeros(SHAPE, bool)
    low[20, 1:-1] = True  # a counter across the whole room
    walls[70:, 50] = True  # a tall cupboard's side, with 1 m behind it
    found = rooms(free & ~low & ~walls, low, walls, grid_of(free))
    assert found.ids[5, 5] == found.ids[30, 30]
    assert found.ids[75, 55] == found.ids[60, 5]
    assert len(found.present) == 2


def test_a_wide_opening_is_no_door() -> None:
    found = cut(*plan(slice(10, 30)))
    assert len(found.present) == 1


def test_ids_stay_while_the_map_grows() -> None:
    free, walls = plan()
    half = rooms(free[25:], free[25:] & False, walls[25:], GridSpec(0.1, (17, 3), (55, 60)))
    assert len(half.present) == 2
    whole = cut(free, walls, half)
    assert (whole.ids[25:] == half.ids)[half.ids != NO_ROOM].all()
    assert (whole.present, whole.next_id, whole.changes) == (half.present, half.next_id, ())
    gone = cut(free & False, walls, whole)
    assert (gone.present, gone.next_id) == (frozenset(), whole.next_id)


def test_what_splits_or_joins_is_told() -> None:
    free, walls = plan()
    wide = plan(slice(10, 30))
    one = cut(*wide)
    two = cut(free, walls, one)
    (split,) = two.changes
    assert (split.revision, split.before) == (2, (0,))
    assert two.present == {*split.after}
    assert 0 in split.after
    joined = cut(*wide, two)
    join = RoomChange(3, tuple(sorted(split.after)), (*joined.present,))
    assert joined.changes == (split, join)
