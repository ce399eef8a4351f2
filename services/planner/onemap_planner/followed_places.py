"""The places and the finds of the map, asked for again when they may have changed."""
# Talks: calls the mapper, on the planning thread.

from __future__ import annotations

from contextlib import suppress

from onemap_planner.inputs import LatestInputs
from onemap_planner.search.state_machine import Search
from onemap_planner.sentences import waiting_for
from onemap_shared import keys
from onemap_shared.messages import KeptObject, ObjectListRequest, PlacesRequest
from onemap_shared.places import NOWHERE, Zones
from onemap_shared.transport import Bus, CallError

TIMEOUT_S = 1.0  # rooms are cut anew where the map changed
UNKNOWN = (-1, 0)  # no version that is announced
EVERY_S = 1.0  # at most, where only the map has changed: rooms grow as slowly as the robot drives


class FollowedPlaces:
    """The newest places; of one thread.

    version: what was announced when they were read, see ``LatestInputs.places_version``.
    """

    def __init__(self, bus: Bus) -> None:
        self._bus, self._asked_s = bus, float("-inf")
        self.known, self.version = NOWHERE, UNKNOWN

    def follow(self, inputs: LatestInputs, search: Search, revision: int) -> str:
        """Ask for the places if they may have changed; why they are not known, empty if they are.

        revision: of the map that the plan is made on: rooms change with it.
        """
        current = self.version == inputs.places_version
        due = self._bus.clock.monotonic_s() - self._asked_s >= EVERY_S
        places = filter(None, map(self.known.get, Zones(self.known, search.stay_out).names))
        rooms = any(place.inside_m for place, _ in places)
        rooms = rooms or any(each.inside or each.outside for each in search.details)
        problem = ""
        if not current or (rooms and due and self.known.revision < revision):
            self._asked_s = self._bus.clock.monotonic_s()
            try:
                self.known = self._bus.call(keys.MAP_PLACES, PlacesRequest(), TIMEOUT_S)
                self.version = (inputs.places_version[0], self.known.version)
            except CallError as failed:
                if not current:  # nor later, if this version should be announced again
                    self.version, problem = UNKNOWN, str(failed)
        problem = problem or Zones(self.known, search.stay_out).problem()
        return waiting_for("the keep-out zones", problem) if problem else ""


class FollowedFinds:
    """The finds that the map keeps, for the anchors of descriptions; of one thread.

    While they cannot be read the last ones hold: no safety rests on them.
    """

    def __init__(self, bus: Bus) -> None:
        self._bus, self._version, self._asked_s = bus, UNKNOWN, float("-inf")
        self.known: tuple[KeptObject, ...] = ()

    def follow(self, inputs: LatestInputs, search: Search) -> None:
        """Ask for the finds if they may have changed, and the search names anchors."""
        version, now_s = inputs.objects_version, self._bus.clock.monotonic_s()
        if version == self._version or not search.detail.anchors or now_s < self._asked_s + EVERY_S:
            return
        if version[0] != self._version[0]:
            self.known = ()  # of another map
        self._asked_s = now_s
        with suppress(CallError):
            self.known = self._bus.call(keys.MAP_OBJECTS, ObjectListRequest(), TIMEOUT_S).objects
            self._version = version
