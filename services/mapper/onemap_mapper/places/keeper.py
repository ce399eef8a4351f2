"""Named places on the bus: listed with the rooms of now, named, forgotten."""
# Talks: answers the bus's threads.

from __future__ import annotations

import logging
from collections.abc import Callable
from pathlib import Path

from onemap_mapper.places.memory import NO_PLACES, from_bytes, to_bytes
from onemap_mapper.places.suggestions import suggestions
from onemap_mapper.storage.kept import Form, Kept
from onemap_mapper.storage.objects import ObjectMemory
from onemap_shared import keys
from onemap_shared.messages import (
    NO_ROOM,
    MapPlaces,
    MapRooms,
    Place,
    PlaceId,
    PlaceKind,
    PlacesRequest,
)
from onemap_shared.names import same_name
from onemap_shared.places import room_at
from onemap_shared.transport import RequestRejected, Server

LOG = logging.getLogger("onemap.mapper")
# Written also without places, so that a version that a planner knows never comes again.
FORM = Form("the named places", "places.bin", NO_PLACES, to_bytes, from_bytes)


class PlaceKeeper:
    """The named places of the map in use, and their procedures.

    ``announce`` is called after every change; ``rooms`` and ``objects`` give those of now.
    """

    def __init__(
        self,
        bus: Server,
        folder: Path,
        announce: Callable[[], None],
        rooms: Callable[[], MapRooms],
        objects: Callable[[], ObjectMemory],
    ) -> None:
        self._rooms, self._objects = rooms, objects
        self.kept = Kept(folder, FORM, announce)
        bus.serve(keys.MAP_PLACES, self.list_places)
        bus.serve(keys.MAP_NAME_PLACE, self.name)
        bus.serve(keys.MAP_FORGET_PLACE, self.forget)

    def list_places(self, _request: PlacesRequest) -> MapPlaces:
        """Named places, then suggestions, with the room of each as the map is now."""
        memory, rooms = self.kept.value, self._rooms()
        ids = [_room_of(place, rooms) for place in memory.places]
        finds = (entry.kept for entry in self._objects().objects)
        names = (place.name for place in memory.places)
        suggested = suggestions(rooms, finds, names, set(ids))
        return MapPlaces(
            memory.version,
            rooms.revision,
            (*memory.places, *suggested.values()),
            (*ids, *suggested),
            rooms.grid,
            rooms.ids,
        )

    def name(self, place: Place) -> MapPlaces:
        """Keep a place, instead of the one of its name."""
        unknown = not place.corners_m and _room_of(place, self._rooms()) == NO_ROOM
        if unknown and place.kind is PlaceKind.KEEP_OUT:
            x_m, y_m = place.inside_m
            raise RequestRejected(
                "invalid",
                f"the map has no room at ({x_m:.2f}, {y_m:.2f}) m, so that {place.name!r} would "
                "keep nothing out: give the corners of the zone, or a point in a room",
            )
        self.kept.change(lambda memory: memory.with_place(place))
        LOG.info("%s %r is named", place.kind, place.name)
        return self.list_places(PlacesRequest())

    def forget(self, request: PlaceId) -> MapPlaces:
        """Forget a named place; its room may be suggested another name then."""
        if self.kept.value.get(request.name) is None:
            raise RequestRejected("no_such_place", self._unknown(request.name))
        self.kept.change(lambda memory: memory.without(request.name))
        LOG.info("forgot the place %r", request.name)
        return self.list_places(PlacesRequest())

    def replace(self, places: tuple[Place, ...]) -> None:
        """Keep these places instead, because the map is another one."""
        self.kept.change(lambda memory: memory.changed_to(places))

    def _unknown(self, name: str) -> str:
        """Why there is no place of this name to forget, and which there are."""
        suggested = self.list_places(PlacesRequest()).places
        if any(same_name(place.name, name) for place in suggested):
            return f"{name!r} is only suggested, by what was found there: name the room instead"
        names = ", ".join(repr(place.name) for place in self.kept.value.places)
        which = f"there are {names}" if names else "none has a name"
        return f"there is no place {name!r}; {which}"


def _room_of(place: Place, rooms: MapRooms) -> int:
    return NO_ROOM if place.corners_m else room_at(rooms.ids, rooms.grid, place.inside_m)
