"""The planner follows the map's places, and does not drive where it does not know the zones."""

from __future__ import annotations

import threading

import pytest

from onemap_shared import keys
from onemap_shared.messages import (
    UNKNOWN_PLACES,
    Detail,
    KeptObject,
    MapPlaces,
    ObjectList,
    ObjectListRequest,
    Place,
    PlaceKind,
    PlacesRequest,
    Relation,
    RelationKind,
    SearchRequest,
)
from onemap_shared.transport import RemoteError, RequestRejected
from tests.planner.drawn_maps import places_of
from tests.planner.simulated_services import ROOM, SimulatedServices, moves

FAR = Place("far", PlaceKind.KEEP_OUT, corners_m=((8.0, 8.0), (9.0, 8.0), (9.0, 9.0)))
NOWHERE_M = (0.0, 0.0, 1.0)
KITCHEN = Place("kitchen", PlaceKind.KEEP_OUT, inside_m=(1.0, 1.0))


def drives(services: SimulatedServices) -> None:
    services.sent_commands()
    services.until(lambda: any(map(moves, services.sent_commands())))


def test_unknown_zones_stop_the_robot_until_they_are_known(services: SimulatedServices) -> None:
    services.start("sofa")
    drives(services)

    def failing(_: PlacesRequest) -> MapPlaces:
        raise RequestRejected("internal", "no places")

    services.mapper.serve(keys.MAP_PLACES, failing)
    services.places_version = 3
    services.frame()
    services.sent_commands()
    services.until(lambda: "waiting for the keep-out zones: no places" in services.get().reason)
    assert not any(map(moves, services.sent_commands()))
    told = services.serve_places(places_of(ROOM.grid, FAR, version=3))
    drives(services)
    assert told == [3]
    assert "waiting" not in services.get().reason


def test_a_zone_stops_the_robot_at_the_next_control_step(services: SimulatedServices) -> None:
    drawn = threading.Event()

    def slow(_: PlacesRequest) -> MapPlaces:
        if services.places_version:
            drawn.wait(5.0)
        return places_of(ROOM.grid, FAR, version=services.places_version)

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
    told = services.serve_places(places_of(ROOM.grid, KITCHEN, version=2, rooms=(1,)))
    services.start("sofa")
    services.until(lambda: len(told) >= 2)
    assert set(told) == {2}


def test_a_room_that_the_map_does_not_show_stops_the_robot(services: SimulatedServices) -> None:
    services.places_version = 2
    services.serve_places(places_of(ROOM.grid, KITCHEN, version=2))
    services.start("sofa")
    services.until(lambda: "the map shows no room for 'kitchen'" in services.get().reason)
    assert not any(map(moves, services.sent_commands()))


def test_finds_are_read_for_anchors_and_again_when_they_change(
    services: SimulatedServices,
) -> None:
    told: list[int] = []

    def finds(_: ObjectListRequest) -> ObjectList:
        version = services.objects_version
        told.append(version)
        bed = KeptObject(f"bed-{version}", "bed", NOWHERE_M, (*NOWHERE_M, 1.0), 0.9, 1, "s", 1, 1)
        return ObjectList((bed,))

    services.mapper.serve(keys.MAP_OBJECTS, finds)
    beside = Detail(relations=(Relation(RelationKind.NEXT_TO, ("bed",)),))
    services.caller.call(keys.SEARCH_START, SearchRequest(("lamp",), details=(beside,)))
    kept = services.planner._planning_thread._kept
    services.until(lambda: [each.object_id for each in kept.known] == ["bed-0"])
    services.objects_version = 1
    services.until(lambda: [each.object_id for each in kept.known] == ["bed-1"])
    assert told == [0, 1]


def test_a_place_to_stay_out_of_must_exist(services: SimulatedServices) -> None:
    services.serve_places(places_of(ROOM.grid, FAR, KITCHEN))
    told = r"no place 'attic'.*there are 'far', 'kitchen'"
    with pytest.raises(RemoteError, match=told) as caught:
        services.caller.call(keys.SEARCH_START, SearchRequest(("sofa",), stay_out=("attic",)))
    assert caught.value.code == "unknown_place"
    assert services.states.take(0.0) is None


def test_an_object_may_be_in_a_room_that_is_not_known_yet(services: SimulatedServices) -> None:
    services.serve_places(places_of(ROOM.grid, FAR))
    wing, attic = Detail(outside=("west wing",)), Detail(inside=("attic",))
    with pytest.raises(RemoteError, match="no place 'west wing'"):
        services.caller.call(keys.SEARCH_START, SearchRequest(("sofa",), details=(wing,)))
    request = SearchRequest(("sofa",), details=(attic,))
    assert services.caller.call(keys.SEARCH_START, request).details == (attic,)


def test_a_drive_into_a_zone_is_refused(services: SimulatedServices) -> None:
    services.serve_places(places_of(ROOM.grid, FAR))
    with pytest.raises(
        RemoteError, match=r"\(8.80, 8.20\) lies in the keep-out zone 'far'"
    ) as caught:
        services.go_to(8.8, 8.2)
    assert caught.value.code == "keep_out"
    services.go_to(7.0, 7.0)


def test_nothing_begins_while_the_places_cannot_be_read(services: SimulatedServices) -> None:
    def damaged(_: PlacesRequest) -> MapPlaces:
        raise RequestRejected("unreadable", "the named places cannot be read")

    services.mapper.serve(keys.MAP_PLACES, damaged)
    refused = "not known: the named places cannot be read"
    with pytest.raises(RemoteError, match=refused):
        services.start("sofa")
    with pytest.raises(RemoteError, match=refused):
        services.go_to(3.0, 3.0)
    assert services.states.take(0.0) is None


def test_zones_that_were_known_before_a_damage_are_asked_for_again(
    services: SimulatedServices,
) -> None:
    """The version after it may be one of before."""
    near = Place("near", PlaceKind.KEEP_OUT, corners_m=((2.5, 1.0), (3.0, 1.0), (3.0, 3.0)))
    services.places_version = 1
    services.serve_places(places_of(ROOM.grid, near, version=1))
    services.start("sofa")
    services.until(lambda: services.planner._planning_thread._places.known.get("near") is not None)

    def damaged(_: PlacesRequest) -> MapPlaces:
        raise RequestRejected("unreadable", "the named places cannot be read")

    services.mapper.serve(keys.MAP_PLACES, damaged)
    services.places_version = UNKNOWN_PLACES
    services.until(lambda: "the named places cannot be read" in services.get().reason)
    services.sent_commands()
    services.frame()
    assert not any(map(moves, services.sent_commands()))
    services.places_version = 1
    told = services.serve_places(places_of(ROOM.grid, version=1))
    services.until(lambda: bool(told))
    drives(services)
