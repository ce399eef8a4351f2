"""Named places on the bus: listed with the rooms of now, named, forgotten."""
# Talks: answers the bus's threads.

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path

from onemap_mapper.places.memory import NO_PLACES, PlaceMemory, from_bytes, to_bytes
from onemap_mapper.places.rooms import Rooms
from onemap_mapper.places.suggestions import suggestions
from onemap_mapper.storage.kept import Form, Kept
from onemap_mapper.storage.objects import ObjectMemory
from onemap_shared import keys
from onemap_shared.messages import (
    NO_ROOM,
    UNKNOWN_PLACES,
    KeptObject,
    MapPlaces,
    Place,
    PlaceKind,
    PlacesChange,
)
from onemap_shared.places import room_at
from onemap_shared.transport import RequestRejected, Server

LOG = logging.getLogger("onemap.mapper")
# Written also without places, so that a version that a planner knows never comes again.
FORM = Form(
    "the named places",
    "places.bin",
    NO_PLACES,
    to_bytes,
    from_bytes,
    "no robot drives until it is known where it may not; put the file back and restart the mapper, "
    "load a saved map, or say with 'onemap places reset' that there are no places",
    lambda memory: memory.version,
    lambda before, read: replace(before, version=read.version + 1),
)


class PlaceKeeper:
    """The named places of the map in use, and their procedures.

    ``announce`` is called after every change; ``rooms`` and ``objects`` give those of now.
    """

    def __init__(
        self,
        bus: Server,
        folder: Path,
        announce: Callable[[], None],
        rooms: Callable[[], Rooms],
        objects: Callable[[], ObjectMemory],
        *,
        before: tuple[Place, ...] = (),
    ) -> None:
        """before: those of the checkpoint, older than the file; where there are some is one."""
        self._rooms, self._objects, self._before = rooms, objects, before
        self._clock = bus.clock
        self.kept = Kept(folder, FORM, announce, bus.clock, expected=bool(before))
        bus.serve(keys.MAP_PLACES, lambda _request: self.places())
        bus.serve(keys.MAP_CHANGE_PLACES, self.change)

    @property
    def version(self) -> int:
        """Of the places, as it is announced."""
        return UNKNOWN_PLACES if self.kept.unreadable else self.kept.value.version

    @property
    def for_checkpoint(self) -> tuple[Place, ...]:
        """The named places; while they cannot be read, those of before, so that they are missed."""
        return self._before if self.kept.unreadable else self.kept.value.places

    def places(self) -> MapPlaces:
        """Named places, then suggestions, and the rooms as the map is now."""
        finds = (entry.kept for entry in self._objects().objects)
        return map_places(self.kept.value, self._rooms(), finds)

    def change(self, request: PlacesChange) -> MapPlaces:
        """Name places and forget others; a room may be suggested another name then."""
        rooms = self._rooms()
        for place in request.named:
            nowhere = place.inside_m and _room_of(place, rooms) == NO_ROOM
            if nowhere and place.kind is PlaceKind.KEEP_OUT:
                x_m, y_m = place.inside_m
                raise RequestRejected(
                    "invalid",
                    f"the map has no room at ({x_m:.2f}, {y_m:.2f}) m, so that {place.name!r} "
                    "would keep nothing out: give the corners of the zone, or a point in a room",
                )
        try:
            if request.all_others:
                self.replace(NO_PLACES.changed(request.named).places)
                LOG.info("all other places are forgotten")
            else:
                self.kept.change(lambda memory: memory.changed(request.named, request.forgotten))
        except KeyError as problem:
            raise RequestRejected("no_such_place", f"there is {problem.args[0]}") from None
        for place in request.named:
            LOG.info("%s %r is named", place.kind, place.name)
        for name in request.forgotten:
            LOG.info("forgot the place %r", name)
        return self.places()

    def replace(self, places: tuple[Place, ...]) -> None:
        """Keep these places instead, whatever was there, also what cannot be read."""
        self.kept.replace(lambda: self.exchanged(places))

    def exchanged(self, places: tuple[Place, ...]) -> PlaceMemory:
        """The memory with these places instead, whatever was there."""
        if self.kept.unreadable:  # nobody has counted so far
            return PlaceMemory(places, version=self._clock.wall_ns() // 10**9)
        return self.kept.value.changed_to(places)


def map_places(memory: PlaceMemory, rooms: Rooms, finds: Iterable[KeptObject] = ()) -> MapPlaces:
    """The places with the rooms that hold them, and names that finds suggest for other rooms."""
    ids = [_room_of(place, rooms) for place in memory.places]
    suggested = suggestions(rooms, finds, (place.name for place in memory.places), set(ids))
    return MapPlaces(
        memory.version,
        rooms.revision,
        (*memory.places, *suggested.values()),
        (*ids, *suggested),
        rooms.grid,
        rooms.ids,
        rooms.changes,
        rooms.parts,
    )


def _room_of(place: Place, rooms: Rooms) -> int:
    return NO_ROOM if place.corners_m else room_at(rooms.ids, rooms.grid, place.inside_m)
