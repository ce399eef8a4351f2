"""The places of the map, asked for again when they may have changed."""
# Talks: calls the mapper, on the planning thread.

from __future__ import annotations

import time

from onemap_planner.inputs import LatestInputs
from onemap_planner.search.state_machine import Search
from onemap_planner.sentences import waiting_for
from onemap_planner.world.keep_out import Zones
from onemap_shared import keys
from onemap_shared.messages import MapPlaces, PlaceKind, PlacesRequest
from onemap_shared.transport import Bus, CallError, NoReply, QueryTimeout

TIMEOUT_S = 1.0  # rooms are cut anew where the map changed
EVERY_S = 1.0  # at most, where only the map has changed: rooms grow as slowly as the robot drives


class FollowedPlaces:
    """The newest places; of one thread.

    known: None where the mapper is of an earlier release and has none. version: what was announced
    when they were read, see ``LatestInputs.places_version``; None before the first reply.
    """

    def __init__(self, bus: Bus) -> None:
        self._bus = bus
        self._asked_s = float("-inf")
        self.known: MapPlaces | None = None
        self.version: tuple[int, int] | None = None

    def follow(self, inputs: LatestInputs, search: Search, revision: int) -> str:
        """Ask for the places if they may have changed; why they are not known, empty if they are.

        revision: of the map that the plan is made on: rooms change with it.
        """
        problem = self._ask(inputs, search, revision)
        problem = problem or Zones(self.known, search.stay_out).problem()
        return waiting_for("the keep-out zones", problem) if problem else ""

    def _ask(self, inputs: LatestInputs, search: Search, revision: int) -> str:
        current = self.version == inputs.places_version
        if current and not (self._rooms_count(search) and self._is_older(revision)):
            return ""
        count, announced = inputs.places_version
        self._asked_s = time.monotonic()
        try:
            self.known = self._bus.call(keys.MAP_PLACES, PlacesRequest(), TIMEOUT_S)
            self.version = count, self.known.version
        except NoReply:
            if announced:
                return "the mapper does not answer for them"
            self.known, self.version = None, inputs.places_version
        except QueryTimeout:
            return "" if current else f"no answer within {TIMEOUT_S:g} s"
        except CallError as problem:
            return "" if current else str(problem)
        return ""

    def _rooms_count(self, search: Search) -> bool:
        """Whether it matters for this search which cells a room has."""
        if self.known is None:
            return True  # in case that the mapper was about to start
        zones = (place for place in self.known.places if place.kind is PlaceKind.KEEP_OUT)
        named = search.stay_out or any(each.inside or each.outside for each in search.details)
        return bool(named) or any(zone.inside_m for zone in zones)

    def _is_older(self, revision: int) -> bool:
        due = time.monotonic() - self._asked_s >= EVERY_S
        return due and (self.known is None or self.known.revision < revision)
