"""Drives to places by their names: the planner knows where they are when it accepts the request."""

from __future__ import annotations

import threading
from concurrent.futures import ThreadPoolExecutor

import cv2
import numpy as np
import pytest

from onemap_planner.named_places import goal_m, inner_point_m
from onemap_shared import keys
from onemap_shared.geometry import pose_2d
from onemap_shared.messages import (
    MapPlaces,
    Place,
    PlacesRequest,
    SearchId,
    SearchKind,
    SearchRequest,
    SearchStatus,
)
from onemap_shared.transport import RemoteError
from tests.planner.drawn_maps import places_of
from tests.planner.simulated_services import ROOM, SimulatedServices, moves

KITCHEN = Place("kitchen", inside_m=(3.0, 2.5))
PLACES = places_of(ROOM.grid, KITCHEN)


def drive_to(services: SimulatedServices, place: str) -> SearchStatus:
    request = SearchRequest((), kind=SearchKind.GO_TO, place=place, patience_s=60.0)
    return services.caller.call(keys.SEARCH_START, request)


def test_a_drive_ends_at_the_place_of_the_name_or_where_the_robot_set_out(
    services: SimulatedServices,
) -> None:
    services.serve_places(PLACES)
    services.frame()
    with pytest.raises(RemoteError, match="not known where the robot stood") as caught:
        drive_to(services, "back")
    assert caught.value.code == "unknown_place"
    with pytest.raises(RemoteError, match="no place 'attic' on the map; there are 'kitchen'"):
        drive_to(services, "attic")
    assert drive_to(services, "Kitchen").place_m == (3.0, 2.5)
    services.caller.call(keys.SEARCH_CANCEL, SearchId())
    assert drive_to(services, "Back").place_m == (2.0, 2.0)
    services.caller.call(keys.SEARCH_CANCEL, SearchId())
    services.pose = pose_2d(2.0, 4.0, 0.0)
    services.frame()
    with pytest.raises(RemoteError, match="the robot's position jumped"):
        drive_to(services, "back")


@pytest.mark.parametrize("place", ["kitchen", "back"])
@pytest.mark.parametrize("another", ["driver", "map", "jump"])
def test_no_drive_begins_to_coordinates_of_another_frame(
    services: SimulatedServices, monkeypatch: pytest.MonkeyPatch, place: str, another: str
) -> None:
    """The frame begins anew between the answer about the place and the start."""
    monkeypatch.setattr("onemap_planner.searches.PLACES_TIMEOUT_S", 60.0)
    services.serve_places(PLACES)
    for _ in range(3):
        services.frame()
    services.go_to(3.0, 2.0)
    services.caller.call(keys.SEARCH_CANCEL, SearchId())
    services.sent_commands()
    asked, released = threading.Event(), threading.Event()

    def slow(_: PlacesRequest) -> MapPlaces:
        asked.set()
        released.wait(60.0)
        return PLACES

    services.mapper.serve(keys.MAP_PLACES, slow)
    with ThreadPoolExecutor(1) as caller:
        started = caller.submit(drive_to, services, place)
        assert asked.wait(60.0)
        if another == "driver":
            services.restart_driver(named=True, joined=False)
        elif another == "map":
            services.count = 0
        else:
            services.pose = pose_2d(2.0, 4.0, 0.0)
        services.frame()
        released.set()
    with pytest.raises(RemoteError, match="nothing was started: while") as caught:
        started.result()
    assert caught.value.code == "stopped"
    for _ in range(3):
        services.frame()
    assert not any(map(moves, services.sent_commands()))


@pytest.mark.parametrize("turned_rad", [0.0, 0.7])
@pytest.mark.parametrize(
    "corners",
    [
        ((0, 0), (4, 0), (4, 1), (1, 1), (1, 4), (0, 4)),  # L
        ((0, 0), (4, 0), (4, 3), (3, 3), (3, 1), (1, 1), (1, 3), (0, 3)),  # U
    ],
)
def test_the_goal_of_a_bent_place_is_well_inside_it(
    corners: tuple[tuple[float, float], ...], turned_rad: float
) -> None:
    cos, sin = np.cos(turned_rad), np.sin(turned_rad)
    polygon = np.array(corners) @ np.array([[cos, sin], [-sin, cos]])
    hall = Place("hall", corners_m=tuple((x, y) for x, y in polygon.tolist()))
    inside_m = cv2.pointPolygonTest(polygon.astype(np.float32), goal_m(hall), measureDist=True)
    assert inside_m > 0.4  # of at most about 0.6


def test_the_goal_of_a_straight_place_is_its_middle() -> None:
    assert inner_point_m(((0, 0), (4, 0), (4, 1), (0, 1))) == pytest.approx((2, 0.5), abs=0.05)
    sliver = ((0.0, 0.0), (9.0, 8.99), (9.0, 9.01))  # no tried point is inside
    assert inner_point_m(sliver) == pytest.approx((6.0, 6.0), abs=0.1)
