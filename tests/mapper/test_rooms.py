"""Rooms of drawn floor plans: cut at doors, and the same rooms while the map grows."""

from __future__ import annotations

import numpy as np
import pytest

from onemap_mapper.places.keeper import map_places
from onemap_mapper.places.memory import PlaceMemory
from onemap_mapper.places.rooms import Rooms, identified, labelled, parts_of, rooms_of
from onemap_shared.conditions import Candidate, Surroundings, Thing, check
from onemap_shared.geometry import F64, Bool
from onemap_shared.grid import GridSpec
from onemap_shared.joint_belief import place_masks
from onemap_shared.messages import (
    NO_ROOM,
    Detail,
    Holds,
    Occupancy,
    Place,
    RoomChange,
    SearchView,
)

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


STUDY = Place("study", inside_m=(5.5, 1.8))  # the other room
HALL = Place("hall", inside_m=(5.5, 1.8))


def holds_of_chair_in_the_first_room(
    free: Bool, walls: Bool, detail: Detail, place: Place = STUDY
) -> tuple[Holds, str]:
    """The verdict on a chair at (1.7, 1.8) m, on a map with one place."""
    occupancy = np.full(SHAPE, Occupancy.UNKNOWN, np.uint8)
    occupancy[free], occupancy[walls] = Occupancy.FREE, Occupancy.OCCUPIED
    grid, none = grid_of(free), np.zeros(SHAPE, np.uint8)
    likely = np.ones(SHAPE, np.float32)
    view = SearchView("chair", 1, 1, 0, grid, occupancy, none, likely, tops_dm=none)
    places = map_places(PlaceMemory((place,)), rooms_of(view))
    around = Surroundings(
        grid,
        occupancy,
        free,
        likely,
        {},
        places,
        place_masks(detail, places, grid),
        place_masks(detail, places, grid, settled=True),
    )
    (found,) = check(Candidate(Thing(np.array([[25, 15]]))), detail, around)
    return found.holds, found.evidence


def test_whether_it_is_beyond_a_door_is_told_once_the_walls_are_seen() -> None:
    free, walls = plan()
    inside, outside = Detail(inside=("study",)), Detail(outside=("study",))
    strip = np.zeros(SHAPE, bool)
    strip[:, 10:20] = True  # from one room through the door into the other, of neither the walls
    young = free & strip, walls & strip
    why = "its walls are not all seen yet"
    assert holds_of_chair_in_the_first_room(*young, inside) == (
        Holds.NOT_CHECKED,
        f"perhaps not in the study: {why}",
    )
    assert holds_of_chair_in_the_first_room(*young, outside) == (
        Holds.NOT_CHECKED,
        f"perhaps in the study: {why}",
    )
    assert holds_of_chair_in_the_first_room(free, walls, inside)[0] is Holds.NO
    assert holds_of_chair_in_the_first_room(free, walls, outside)[0] is Holds.YES


def test_what_unseen_floor_parts_from_a_room_may_be_in_it() -> None:
    free, walls = plan()
    seen, beyond = np.ones(SHAPE, bool), np.ones(SHAPE, bool)
    seen[35:45, 5:25] = False  # the door, and what is beside it
    beyond[:10] = beyond[-10:] = False  # the other ends of both rooms
    outside = Detail(outside=("study",))
    assert holds_of_chair_in_the_first_room(free & seen, walls & seen, outside) == (
        Holds.NOT_CHECKED,
        "perhaps in the study: its walls are not all seen yet",
    )
    inside = Detail(inside=("study",))
    assert holds_of_chair_in_the_first_room(free & seen, walls & seen, inside) == (
        Holds.NOT_CHECKED,
        "perhaps not in the study: its walls are not all seen yet",
    )
    told = holds_of_chair_in_the_first_room(free & beyond, walls & beyond, outside)
    assert told == (Holds.YES, "not in the study")


def test_what_is_not_in_a_named_room_for_sure_may_be_in_one_that_the_map_does_not_show() -> None:
    """The hall's floor and that of the chair are one room until the walls beside the door are
    seen: then the chair's room, which has no name, may be the kitchen."""
    free, walls = plan()
    strip = np.zeros(SHAPE, bool)
    strip[:, 10:20] = True
    young, inside, outside = (
        (free & strip, walls & strip),
        Detail(inside=("kitchen",)),
        Detail(outside=("kitchen",)),
    )
    why = "its walls are not all seen yet"
    assert holds_of_chair_in_the_first_room(*young, inside, HALL) == (
        Holds.NOT_CHECKED,
        f"perhaps not in the kitchen: {why}",
    )
    assert holds_of_chair_in_the_first_room(*young, outside, HALL) == (
        Holds.NOT_CHECKED,
        f"perhaps in the kitchen: {why}",
    )
    for place, not_in, is_in in (
        (HALL, Holds.NOT_KNOWN, Holds.NOT_CHECKED),
        (Place("hall", inside_m=(1.5, 1.8)), Holds.YES, Holds.NO),
    ):
        told = [
            holds_of_chair_in_the_first_room(free, walls, detail, place)[0]
            for detail in (outside, inside)
        ]
        assert told == [not_in, is_in]


def test_what_is_in_one_part_of_a_room_is_in_it() -> None:
    wide = plan(slice(10, 30))
    inside, outside = Detail(inside=("study",)), Detail(outside=("study",))
    assert holds_of_chair_in_the_first_room(*wide, inside) == (Holds.YES, "in the study")
    assert holds_of_chair_in_the_first_room(*wide, outside) == (Holds.NO, "in the study")


def test_what_stands_before_a_wall_hides_no_door() -> None:
    free, walls = plan()
    free[70:79, 40:50] = False  # behind a sofa
    low = np.zeros(SHAPE, bool)
    low[70, 40:50] = True
    found = rooms(free, low, walls, grid_of(free))
    parts = parts_of(free, low, walls, 0.1)
    beside = parts[free & (found.ids == found.ids[60, 5])]
    assert np.mean(beside == parts[60, 5]) > 0.8


def test_a_wall_that_was_seen_low_from_near_may_hold_a_door() -> None:
    _, walls = plan()
    low, unseen = np.zeros(SHAPE, bool), np.zeros(SHAPE, bool)
    low[39:44, 1:-1] = True  # both faces of a wall, and its ends beside the door
    low[39:44, 10:20] = False
    unseen[40:43, 1:6] = unseen[40:43, 25:-1] = True  # inside of it
    walls[40, 1:-1] = False
    low &= ~unseen
    parts = parts_of(~walls & ~low & ~unseen, low, walls, 0.1)
    assert parts[20, 15] != parts[60, 15]
    assert NO_ROOM not in {parts[20, 15], parts[60, 15]}
