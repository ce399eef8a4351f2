"""Names for rooms without one, by what was found inside."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Mapping

import numpy as np
from scipy import ndimage

from onemap_mapper.places.rooms import Rooms
from onemap_shared.messages import NO_ROOM, KeptObject, Place
from onemap_shared.names import normalised
from onemap_shared.places import room_at

# What tells a kind of room; of kinds with as many finds the first one is suggested.
FURNITURE: Mapping[str, tuple[str, ...]] = {
    "bathroom": ("toilet", "bathtub", "shower"),
    "kitchen": ("refrigerator", "fridge", "oven", "stove", "dishwasher", "kitchen cabinet"),
    "bedroom": ("bed", "nightstand"),
    "living room": ("sofa", "couch", "television", "tv", "coffee table"),
}


def suggestions(
    rooms: Rooms, objects: Iterable[KeptObject], names: Iterable[str], named: Collection[int]
) -> dict[int, Place]:
    """A place for each room that is not in ``named`` and in which furniture of a kind was found.

    names: of other places; of rooms of one kind the second is "bedroom 2".
    """
    found: dict[int, Counter[str]] = {}
    for kept in objects:
        room = room_at(rooms.ids, rooms.grid, kept.position_m[:2])
        if (kind := kind_of(kept.name)) and room != NO_ROOM and room not in named:
            found.setdefault(room, Counter())[kind] += 1
    taken, places = {normalised(name) for name in names}, {}
    for room, counts in sorted(found.items()):
        kind = max(FURNITURE, key=counts.__getitem__)
        name = next(name for name in _numbered(kind) if name not in taken)
        taken.add(name)
        places[room] = Place(name, inside_m=_inside_m(rooms, room), suggested=True)
    return places


def kind_of(name: str) -> str:
    """The kind of room that an object of this name tells; empty if it tells none."""
    words = f" {normalised(name)}"
    for kind, furniture in FURNITURE.items():
        if words.endswith(tuple(f" {each}" for each in furniture)):
            return kind
    return ""


def _numbered(kind: str) -> Iterable[str]:
    yield kind
    yield from (f"{kind} {number}" for number in range(2, 1000))


def _inside_m(rooms: Rooms, room: int) -> tuple[float, float]:
    """x, y on the floor of a room, as far from its edge as possible."""
    depth = ndimage.distance_transform_edt(np.pad(rooms.ids == room, 1))
    cell = np.array(np.unravel_index(np.argmax(depth), depth.shape)) - 1
    x_m, y_m = rooms.grid.centres(cell).tolist()
    return x_m, y_m
