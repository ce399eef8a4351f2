"""Messages about places: rooms with a name and zones that a robot keeps out of."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from onemap_shared.geometry import I32, MAX_COORDINATE_M
from onemap_shared.grid import GridSpec
from onemap_shared.messages.checks import Message, Shape, Word, cleaned, expect, items, without
from onemap_shared.names import normalised, same_name

MAX_PLACES = 100  # of one map: a building's rooms, and its zones
MAX_CORNERS = 64  # of a polygon; as many places of these fit into one message
NO_ROOM = -1
UNKNOWN_PLACES = -1  # in place of their version: they cannot be read
MAX_ROOM_CHANGES = 100
BACK = "back"  # in the place of a name: where the robot stood when the last search was accepted
MIN_AREA_M2 = 0.01  # of a polygon: less covers no cell


class PlaceKind(Word):
    """What a place is for: a name of a part of the floor, or a part that no robot enters."""

    ROOM = "room"
    KEEP_OUT = "keep_out"


def _corners(corners_m: tuple[tuple[float, float], ...], name: str) -> None:
    """Raise ValueError unless these are no corners or those of a polygon on the map."""
    if corners_m and not 3 <= len(corners_m) <= MAX_CORNERS:
        raise ValueError(f"{name} has {len(corners_m)} corners; a polygon has 3 to {MAX_CORNERS}")
    for corner in corners_m:
        _on_map(corner, name)
    if corners_m and polygon_area_m2(corners_m) < MIN_AREA_M2:
        raise ValueError(
            f"{name} enclose {polygon_area_m2(corners_m):.3f} m2; a place needs at least "
            f"{MIN_AREA_M2:g}: give the corners in their order around it, in metres"
        )


def _on_map(point_m: tuple[float, ...], name: str) -> None:
    """Raise ValueError unless this is a point of the map, or none."""
    if point_m and (len(point_m) != 2 or not np.abs(point_m).max() <= MAX_COORDINATE_M):  # or NaN
        raise ValueError(
            f"{name} has the point {list(point_m)}; each is x, y in metres, at most "
            f"{MAX_COORDINATE_M:g} from the origin"
        )


def polygon_area_m2(corners_m: tuple[tuple[float, float], ...]) -> float:
    """What a polygon that does not cross itself encloses, in square metres."""
    x, y = np.transpose(np.subtract(corners_m, corners_m[0]))
    return float(abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2)


NAME = cleaned("name of a place", advice="name a part of the floor, for example 'kitchen'")


@dataclass(frozen=True, slots=True)
class Place(Message):
    """A part of the floor with a name: the room that holds a point, or a polygon.

    Attributes:
        name: two places of a map differ in it, whatever their case.
        kind: a name of a part of the floor, or a part that no robot enters.
        inside_m: x, y of a point in the room, which may grow around it; empty for a polygon.
        corners_m: x, y of the polygon's corners, in order; empty for a room.
        suggested: named by the mapper, by what was found inside, not by a person.
    """

    name: Annotated[str, NAME]
    kind: PlaceKind = PlaceKind.ROOM
    inside_m: Annotated[tuple[float, ...], _on_map] = ()
    corners_m: Annotated[tuple[tuple[float, float], ...], _corners] = ()
    suggested: bool = False

    def _check(self) -> None:
        if bool(self.inside_m) == bool(self.corners_m):
            raise ValueError(
                f"place {self.name!r} needs either a point inside a room or the corners of a "
                "polygon"
            )


def different_names(places: tuple[Place, ...]) -> None:
    """Raise ValueError if two places have the same name, whatever its case."""
    names = [normalised(place.name) for place in places]
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f"two places have the name {name!r}: give each its own")


@dataclass(frozen=True, slots=True)
class PlacesRequest:
    """Request for the rooms and places of the map in use."""


@dataclass(frozen=True, slots=True)
class PlacesChange(Message):
    """Names places and forgets others: all of it, or nothing.

    Attributes:
        named: instead of the places of these names.
        forgotten: names of places, whatever their case.
        all_others: forget all that are not named here, also those that cannot be read.
    """

    named: Annotated[tuple[Place, ...], items(MAX_PLACES)] = ()
    forgotten: Annotated[tuple[str, ...], items(MAX_PLACES), NAME] = ()
    all_others: bool = False

    def _check(self) -> None:
        different_names(self.named)
        if any(same_name(place.name, BACK) for place in self.named):
            raise ValueError(
                f"a place cannot be called {BACK!r}, which sends the robot back to where it stood "
                "when the last search began: give another name"
            )


@dataclass(frozen=True, slots=True)
class RoomChange(Message):
    """A room that split into several, or several that joined.

    Attributes:
        revision: of the map in which it was noticed.
        before: ids of the rooms before.
        after: ids of what they are now; one of those before may stay.
    """

    revision: int
    before: tuple[int, ...]
    after: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class MapPlaces(Message):
    """The rooms of the map and its places now.

    A room keeps its id while the map grows; another map begins anew.

    Attributes:
        version: changes whenever a person changed a place; that of ``MapRevision``.
        places: those that people named, then suggestions.
        rooms: id of the room of each place; NO_ROOM for a polygon and where none is known yet.
        ids: (nx, ny) of the room of every free cell, NO_ROOM elsewhere.
        changes: the latest splits and joins of rooms, the newest last.
        parts: (nx, ny) of the part of its room that each free cell is in, NO_ROOM elsewhere and
            where it is not seen yet whether a doorway is there: cells of one part are in one room
            whatever is seen later. (0, 0): not known.
    """

    version: int
    revision: int
    places: Annotated[tuple[Place, ...], items(2 * MAX_PLACES)]
    rooms: tuple[int, ...]
    grid: GridSpec
    ids: Annotated[I32, Shape(None, None)]
    changes: Annotated[tuple[RoomChange, ...], items(MAX_ROOM_CHANGES)] = ()
    parts: Annotated[I32, Shape(None, None)] = without(np.int32, 0, 0)

    def _check(self) -> None:
        expect(self.ids, "ids", np.int32, self.grid.shape)
        if self.parts.size:
            expect(self.parts, "parts", np.int32, self.grid.shape)
        if len(self.rooms) != len(self.places):
            raise ValueError(f"{len(self.rooms)} rooms for {len(self.places)} places")
        different_names(self.places)

    def get(self, name: str) -> tuple[Place, int] | None:
        """The place of this name, whatever its case, and its room; None if there is none."""
        pairs = zip(self.places, self.rooms, strict=True)
        return next((pair for pair in pairs if same_name(pair[0].name, name)), None)
