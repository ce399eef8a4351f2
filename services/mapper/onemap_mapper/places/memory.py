"""The places that people named, as they are kept and merged."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from onemap_mapper.storage.planar_motion import PlanarMotion
from onemap_shared.messages import MAX_PLACES, Place, different_names
from onemap_shared.messages.checks import Count, Message, items
from onemap_shared.names import normalised
from onemap_shared.wire import Packet, decode, encode


@dataclass(frozen=True, slots=True)
class PlaceMemory(Message):
    """Named places in the order of their first naming; ``version`` counts changes."""

    places: Annotated[tuple[Place, ...], items(MAX_PLACES)] = ()
    version: Count = 0

    def _check(self) -> None:
        different_names(self.places)

    def changed(
        self, named: tuple[Place, ...] = (), forgotten: tuple[str, ...] = ()
    ) -> PlaceMemory:
        """The memory with places instead of those of their names, and without others.

        Raises ValueError if there are too many, KeyError with a sentence if there is no such one.
        """
        known = self._by_name()
        for name in forgotten:
            if known.pop(normalised(name), None) is None:
                names = ", ".join(repr(place.name) for place in known.values())
                which = f"those that people named are {names}" if names else "nobody named one"
                raise KeyError(f"no place {name!r}; {which}")
        known |= {normalised(place.name): replace(place, suggested=False) for place in named}
        return self._limited(known)

    def merged(
        self, theirs: tuple[Place, ...], moved: PlanarMotion
    ) -> tuple[PlaceMemory, tuple[str, ...]]:
        """Our places, and those of theirs with other names at their places in our frame.

        Also the names of ours that stay although theirs differ. Raises ValueError if there are too
        many places together, or one would lie too far away.
        """
        known, stayed = self._by_name(), list[str]()
        for place in (_moved(place, moved) for place in theirs):
            kept = known.setdefault(normalised(place.name), place)
            if kept != replace(place, name=kept.name):
                stayed.append(kept.name)
        return self._limited(known), tuple(stayed)

    def _limited(self, known: dict[str, Place]) -> PlaceMemory:
        if len(known) > MAX_PLACES:
            raise ValueError(
                f"the map would have {len(known)} places, and it may have {MAX_PLACES}: forget "
                "some first"
            )
        return self.changed_to(tuple(known.values()))

    def changed_to(self, places: tuple[Place, ...]) -> PlaceMemory:
        """These places instead; the same memory if they are the same."""
        return self if places == self.places else PlaceMemory(places, self.version + 1)

    def _by_name(self) -> dict[str, Place]:
        return {normalised(place.name): place for place in self.places}


NO_PLACES = PlaceMemory()


def _moved(place: Place, moved: PlanarMotion) -> Place:
    def points(points_m: tuple[tuple[float, ...], ...]) -> list[tuple[float, float]]:
        return [(x, y) for x, y in moved.apply(np.array(points_m, np.float64)).tolist()]

    if place.corners_m:
        return replace(place, corners_m=tuple(points(place.corners_m)))
    return replace(place, inside_m=points((place.inside_m,))[0])


def to_bytes(memory: PlaceMemory) -> bytes:
    """The memory as it is saved: the header of a packet, which holds all of it."""
    return encode(memory).header


def from_bytes(data: bytes) -> PlaceMemory:
    """The memory that was saved as ``data``; raises ValueError if that is damaged."""
    return decode(PlaceMemory, Packet(data, b""))
