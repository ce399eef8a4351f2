"""Conditions beside a wall: what is behind it belongs to the other room."""

from __future__ import annotations

import numpy as np
import pytest

from onemap_mapper.places.keeper import map_places
from onemap_mapper.places.memory import PlaceMemory
from onemap_mapper.places.rooms import rooms_of
from onemap_shared.conditions import Candidate, Surroundings, Thing, check
from onemap_shared.geometry import F32, Bool
from onemap_shared.grid import GridSpec
from onemap_shared.joint_belief import place_masks
from onemap_shared.messages import (
    Detail,
    Holds,
    Occupancy,
    Place,
    Relation,
    RelationKind,
    SearchView,
)

SHAPE = (80, 60)  # two rooms of 4 m by 6 m, and the wall between them in row 40
GRID = GridSpec(0.1, (0, 0), SHAPE)
NEXT_TO_BED = Detail(relations=(Relation(RelationKind.NEXT_TO, ("bed",)),))


def cells(x: range, y: range) -> Bool:
    mask = np.zeros(SHAPE, bool)
    mask[x.start : x.stop, y.start : y.stop] = True
    return mask


def holds(thing: Bool, detail: Detail, bed: Bool | None = None) -> Holds:
    """The verdict on a thing between the kitchen, x < 4.0 m, and the bedroom, x > 4.1 m."""
    walls = cells(range(1), range(60)) | cells(range(79, 80), range(60))
    walls |= cells(range(80), range(1)) | cells(range(80), range(59, 60))
    walls |= cells(range(40, 41), range(60)) & ~cells(range(40, 41), range(10, 20))
    stands = thing if bed is None else thing | bed
    occupancy = np.where(walls | stands, Occupancy.OCCUPIED, Occupancy.FREE).astype(np.uint8)
    tops_dm = np.where(walls, 25, np.where(stands, 10, 0)).astype(np.uint8)
    likely = np.ones(SHAPE, np.float32)
    view = SearchView("tv", 1, 1, 0, GRID, occupancy, tops_dm * 0, likely, tops_dm=tops_dm)
    named = Place("kitchen", inside_m=(2.0, 5.0)), Place("bedroom", inside_m=(6.0, 5.0))
    places = map_places(PlaceMemory(named), rooms_of(view))
    anchors: dict[str, F32] = {"bed": np.zeros(SHAPE, np.float32)}
    if bed is not None:
        anchors["bed"][bed] = 0.95
    around = Surroundings(
        GRID,
        occupancy,
        np.ones(SHAPE, bool),
        likely,
        anchors,
        places,
        place_masks(detail, places, GRID),
        place_masks(detail, places, GRID, settled=True),
    )
    (found,) = check(Candidate(Thing(np.argwhere(thing), 0.9)), detail, around)
    return found.holds


@pytest.mark.parametrize("depth", [1, 2, 4, 6, 10, 16])
@pytest.mark.parametrize("front", [True, False])
def test_what_stands_at_a_wall_is_in_one_room(depth: int, front: bool) -> None:
    """front: only its side towards the room was seen."""
    seen = range(41 + max(depth - 2, 0) if front else 41, 41 + depth)
    television = cells(seen, range(30, 40))
    assert holds(television, Detail(inside=("bedroom",))) is Holds.YES
    assert holds(television, Detail(inside=("kitchen",))) is Holds.NO
    assert holds(television, Detail(outside=("kitchen",))) is Holds.YES
    assert holds(television, Detail(outside=("bedroom",))) is Holds.NO


def test_a_bed_behind_the_wall_is_beside_nothing() -> None:
    lamp, bed = cells(range(41, 42), range(33, 37)), cells(range(34, 39), range(32, 38))
    assert holds(lamp, NEXT_TO_BED, bed) is Holds.NO
    here = cells(range(43, 48), range(32, 38))
    assert holds(lamp, NEXT_TO_BED, here) is Holds.YES


def test_through_an_open_door_it_is_beside() -> None:
    lamp, bed = cells(range(38, 39), range(14, 16)), cells(range(43, 50), range(12, 18))
    assert holds(lamp, NEXT_TO_BED, bed) is Holds.YES
