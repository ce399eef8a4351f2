"""The planner follows the map's places, and does not drive where it does not know the zones."""

from __future__ import annotations

import threading

import numpy as np

from onemap_shared import keys
from onemap_shared.messages import NO_ROOM, MapPlaces, Place, PlaceKind, PlacesRequest
from tests.planner.simulated_services import ROOM, SimulatedServices, moves

FAR = Place("far", PlaceKind.KEEP_OUT, corners_m=((8.0, 8.0), (9.0, 8.0), (9.0, 9.0)))
KITCHEN = Place("kitchen", PlaceKind.KEEP_OUT, inside_m=(1.0, 1.0))


def places(version: int, *known: Place, revision: int = 0) -> MapPlaces:
    ids = np.full(ROOM.grid.shape, NO_ROOM, np.int32)
    return MapPlaces(version, revision, known, (NO_ROOM,) * len(known), ROOM.grid, ids)


def drives(services: SimulatedServices) -> None:
    services.sent_commands()
    services.until(lambda: any(map(moves, services.sent_commands())))


def serve(services: SimulatedServices, reply: MapPlaces) -> list[int]:
    """Serve these places; the versions that were told so far."""
    told: list[int] = []

    def answer(_: PlacesRequest) -> MapPlaces:
        told.append(reply.version)
        return reply

    services.mapper.serve(keys.MAP_PLACES, answer)
    return told


def test_a_mapper_of_an_earlier_release_has_no_zones(services: SimulatedServices) -> None:
    services.start("sofa")
    drives(services)


def test_unknown_zones_stop_the_robot_until_they_are_known(services: SimulatedServices) -> None:
    services.start("sofa")
    drives(services)
    services.places_version = 3
    services.frame()
    services.sent_commands()
    services.until(lambda: "waiting for the keep-out zones" in services.get().reason)
    assert not any(map(moves, services.sent_commands()))
    told = serve(services, places(3, FAR))
    drives(services)
    assert told == [3]
    assert "waiting" not in services.get().reason


def test_a_zone_stops_the_robot_at_the_next_control_step(services: SimulatedServices) -> None:
    drawn = threading.Event()

    def slow(_: PlacesRequest) -> MapPlaces:
        if services.places_version:
            drawn.wait(5.0)
        return places(services.places_version, FAR)

    services.mapper.serve(keys.MAP_PLACES, slow)
    services.start("sofa")
    drives(services)
    services.places_version = 1
    services.frame()
    services.sent_commands()
    for _ in range(5):
        services.frame()
    assert not any(map(moves, services.sent_commands()))
    drawn.set()
    drives(services)


def test_a_room_is_asked_for_again_where_the_map_changed(services: SimulatedServices) -> None:
    services.places_version = 2
    told = serve(services, places(2, KITCHEN))
    services.start("sofa")
    services.until(lambda: len(told) >= 2)
    assert set(told) == {2}
