"""Places over HTTP, in Python and on the command line."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest
from starlette.testclient import TestClient
from typer.testing import CliRunner

from onemap import Client, OneMapError
from onemap_gateway.bus.live_state import LiveState
from onemap_gateway.present.places import place_list
from onemap_shared import keys
from onemap_shared import messages as m
from onemap_shared.transport import RequestRejected
from onemap_tools.cli.app import app
from tests.client.conftest import client as python_client
from tests.client.conftest import url
from tests.gateway import fakes
from tests.gateway.fakes import (
    NamingMapper,
    client_of,
    gateway_on,
    map_places,
    state_reached,
)
from tests.memory_bus import MemoryRouter

__all__ = ["python_client", "url"]  # the fixtures
CORNERS = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.5], [0.0, 1.5]]
ZONE = {"corners_m": CORNERS, "kind": "keep_out"}
ROOM_3 = (1.5, 1.0)
L_SHAPED = (0.3, 0.25)


@pytest.fixture
def mapper(router: MemoryRouter) -> Iterator[NamingMapper]:
    fake = NamingMapper(router)
    yield fake
    fake.bus.close()


def test_a_room_and_a_zone_are_named_listed_and_forgotten(
    client: TestClient, mapper: NamingMapper
) -> None:
    room = client.put("/v1/places/Nursery / 2", json={"inside_m": L_SHAPED}).json()
    zone = client.put("/v1/places/stairs", json=ZONE).json()
    first, unnamed = place_list(map_places()).places
    outlines = [[list(corner) for corner in outline] for outline in first.outlines_m]
    assert room == {
        "name": "Nursery / 2", "kind": "room", "suggested": False, "room": 0,
        "inside_m": [*L_SHAPED], "corners_m": [], "outlines_m": outlines,
        "area_m2": first.area_m2,
    }  # fmt: skip
    assert (zone["room"], zone["inside_m"], zone["corners_m"]) == (None, None, CORNERS)
    assert (zone["kind"], zone["outlines_m"], zone["area_m2"]) == ("keep_out", [CORNERS], 3.0)
    listed = client.get("/v1/places").json()
    assert listed["places"][:2] == [room, zone]
    assert [(p["name"], p["suggested"], p["room"]) for p in listed["places"][2:]] == [
        ("kitchen", True, 3)
    ]
    assert client.delete("/v1/places/nursery / 2").json() == room
    assert [*mapper.named] == ["stairs"]
    suggested = client.delete("/v1/places").json()["places"]
    assert ([p["suggested"] for p in suggested], mapper.named) == ([True, False], {})
    assert [unnamed.name, unnamed.room] == ["", 3]


def test_rooms_have_areas_outlines_and_what_parted() -> None:
    reply = place_list(map_places()).model_dump(mode="json")
    assert reply["revision"] == 7
    assert reply["changes"] == [{"revision": 5, "before": [0], "after": [0, 3]}]
    corner, parted = reply["places"]
    assert (corner["room"], corner["area_m2"]) == (0, 1.57)  # 100 + 60 + 1 - 4 cells
    around, beyond = ({tuple(xy) for xy in outline} for outline in corner["outlines_m"])
    assert around == {(0, 0), (2, 0), (2, 0.5), (0.7, 0.5), (0.6, 0.6), (0.6, 1.5), (0, 1.5)}
    assert beyond == {(2.4, 0.1), (2.5, 0.1), (2.5, 0.2), (2.4, 0.2)}
    assert (parted["room"], parted["area_m2"], parted["inside_m"]) == (3, 0.9, [1.45, 1.05])
    x, y = np.transpose(parted["outlines_m"][0])
    assert (x * np.roll(y, -1) - y * np.roll(x, -1)).sum() / 2 == pytest.approx(0.9)
    nowhere = replace(map_places(), ids=np.full(fakes.GRID.shape, m.NO_ROOM, np.int32))
    assert place_list(nowhere).places == ()


def stands_at(x_m: float, state: LiveState) -> bool:
    return state.robot is not None and state.robot[0] == x_m


def test_the_room_of_the_robot_is_named(router: MemoryRouter, mapper: NamingMapper) -> None:
    odometry = router.bus("simulator").publish(keys.ROBOT_ODOMETRY)
    with gateway_on(router) as gateway:
        client = client_of(gateway)
        assert client.put("/v1/places/kitchen", json={}).status_code == 503
        for x_m, room in ((ROOM_3[0], 3), (40.0, None)):  # there is no room yet
            odometry.put(fakes.odometry(x_m, ROOM_3[1]))
            assert state_reached(gateway.cache, partial(stands_at, x_m))
            assert client.put("/v1/places/kitchen", json={}).json()["room"] == room
            assert mapper.named["kitchen"].inside_m == (x_m, ROOM_3[1])


@pytest.mark.parametrize(
    ("name", "body", "said"),
    [
        ("a", {**ZONE, "inside_m": L_SHAPED}, "either a point inside a room or the corners"),
        ("a", {"corners_m": []}, "either a point inside a room or the corners"),
        ("a", {"inside_m": [1, 2, 3]}, "'inside_m'"),
        ("a", {"inside_m": [1, 1e9]}, "'inside_m"),
        ("a", {"corners_m": CORNERS[:2]}, "a polygon has 3 to"),
        ("a", {"corners_m": CORNERS * m.MAX_CORNERS}, "a polygon has 3 to"),
        ("a", {"corners_m": [[0, 0], [1, 1], [2, 2]]}, "enclose 0.000 m2"),
        ("a", {**ZONE, "kind": "lava"}, "'kind'"),
        ("a", {"here": True}, "'here'"),
        ("The Back", {}, "A place cannot be called 'back', which sends the robot back"),
        ("4", ZONE, "place holds no readable word: name a part of the floor"),
        ("x" * 201, ZONE, "201 characters"),
    ],
)
def test_what_is_no_place_is_refused(
    client: TestClient, mapper: NamingMapper, name: str, body: dict[str, Any], said: str
) -> None:
    answer = client.put(f"/v1/places/{name}", json=body)
    assert (answer.status_code, mapper.named) == (422, {})
    assert said in answer.json()["detail"]


def test_places_that_cannot_be_read_are_a_problem(client: TestClient, mapper: NamingMapper) -> None:
    def damaged(_: m.PlacesRequest) -> m.MapPlaces:
        raise RequestRejected("unreadable", "the named places in places.bin cannot be read")

    mapper.bus.serve(keys.MAP_PLACES, damaged)
    answer = client.get("/v1/places")
    assert (answer.status_code, answer.json()["title"]) == (503, "A file cannot be read")
    assert "places.bin cannot be read" in answer.json()["detail"]


def test_places_in_python(python_client: Client, mapper: NamingMapper) -> None:
    kitchen = python_client.name_place("kitchen / 2", ROOM_3)
    assert (kitchen.room, kitchen.kind, kitchen.inside_m) == (3, "room", ROOM_3)
    zone = python_client.name_place("stairs", corners_m=[(0, 0), (2, 0), (2, 1)], keep_out=True)
    assert python_client.places().places[:2] == (kitchen, zone)
    assert python_client.forget_place("Kitchen / 2") == kitchen
    assert m.NO_ROOM not in {place.room for place in python_client.places().places}
    with pytest.raises(OneMapError, match="No pose of the robot"):
        python_client.name_place("kitchen")


def test_places_on_the_command_line(url: str, mapper: NamingMapper) -> None:
    runner = CliRunner()

    def said(*words: str, code: int = 0) -> str:
        result = runner.invoke(app, ["places", *words, "--url", url])
        assert result.exit_code == code, result.output
        return result.output

    corners = "0,0 2,0 2,1.5"
    assert "keep out" in said("name", "stairs", "--corners", corners, "--keep-out")
    said("name", "Nursery", "--at", "0.3,0.25")
    assert "suggested" in said()
    assert "Forgot stairs." in said("forget", "STAIRS")
    assert [*mapper.named] == ["nursery"]
    assert "Nothing was changed" in said("reset", code=1)
    assert "no zone is kept out" in said("reset", "--yes")
    assert mapper.named == {}
    assert "write x,y in metres" in said("name", "a", "--at", "1", code=2)
