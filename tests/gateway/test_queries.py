"""Queries over HTTP, and standing ones as events and over a socket."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import AsyncIterator, Callable
from dataclasses import replace
from typing import Any

import anyio
import pytest
from fastapi.sse import ServerSentEvent
from starlette.testclient import TestClient

from onemap_gateway.http.context import GatewayContext
from onemap_gateway.http.routes.queries import query_events
from onemap_gateway.http.schemas import QueryRequest
from onemap_shared import keys
from onemap_shared import messages as m
from onemap_shared.messages import MAX_IMAGE_BYTES
from onemap_shared.transport import RequestRejected
from tests.gateway.fakes import (
    FakeMapper,
    client_of,
    client_on,
    gateway_on,
    next_event,
    odometry,
    revision,
    state_reached,
)
from tests.memory_bus import MemoryRouter
from tests.shared.samples import PNG

IMAGE = b64encode(PNG).decode()


def test_regions_come_back_best_first(client: TestClient) -> None:
    answer = client.post("/v1/queries", json={"text": "sofa"})
    assert answer.status_code == 200
    reply = answer.json()
    assert [region["rank"] for region in reply["regions"]] == [1, 2]
    assert reply["regions"][0]["centre_m"] == pytest.approx([0.35, 1.15])
    assert reply["regions"][1]["variance"] is None  # infinite: JSON has no such number
    assert reply["revision"] == 7
    assert reply["age_s"] > 0


def test_negatives_area_and_the_robots_place_reach_the_mapper(router: MemoryRouter) -> None:
    mapper = FakeMapper(router)
    with gateway_on(router) as gateway:
        router.bus("robot").publish(keys.ROBOT_ODOMETRY).put(odometry(1.0, 2.0))
        assert state_reached(gateway.cache, lambda state: state.odometry is not None)
        body = {"text": "sofa", "negatives": ["kettle"], "area_m": [0, -1, 2, 3]}
        assert client_of(gateway).post("/v1/queries", json=body).status_code == 200
    (asked,) = mapper.asked
    assert (asked.negatives, asked.area_m) == (("kettle",), (0.0, -1.0, 2.0, 3.0))
    assert asked.robot_xy_m == (1.0, 2.0)


@pytest.mark.parametrize(
    ("body", "reason"),
    [
        ({}, "exactly one of 'text'"),
        ({"text": "sofa", "texts": ["bed"]}, "exactly one of 'text'"),
        ({"texts": ["sofa"] * 21}, "texts"),
        ({"text": "sofa", "negatives": ["bed"] * 11}, "negatives"),
        ({"text": "sofa", "area_m": [1, 0, 0, 1]}, "x_min < x_max"),
        ({"text": "sofa", "area_m": [0, 0, 1, 1e9]}, "area_m"),
        ({"text": "sofa", "image": IMAGE}, "exactly one of 'text'"),
        ({"image": IMAGE, "negatives": ["bed"]}, "negatives"),
        ({"image": 5}, "must be a string"),
        ({"image": "söfa"}, "no base64"),
        ({"image": b64encode(b"GIF89a").decode()}, "no PNG and no JPEG"),
        ({"image": b64encode(PNG.replace(b"\x40", b"\x08")).decode()}, "8 x 48 pixels"),
        ({"image": b64encode(bytes(MAX_IMAGE_BYTES + 1)).decode()}, "the limit is 524288"),
    ],
)
def test_what_cannot_be_asked_is_refused_with_the_reason(
    client: TestClient, body: dict[str, object], reason: str
) -> None:
    answer = client.post("/v1/queries", json=body)
    assert answer.status_code == 422
    assert reason in answer.json()["detail"]


@pytest.mark.parametrize(
    "written", [IMAGE, f"data:image/png;base64,{IMAGE}", f"{IMAGE[:8]}\n{IMAGE[8:]}"]
)
def test_an_image_is_asked_for_as_a_text_is(router: MemoryRouter, written: str) -> None:
    mapper = FakeMapper(router)
    with client_on(router) as client:
        body = {"image": written, "area_m": [0, -1, 2, 3], "max_regions": 1}
        reply = client.post("/v1/queries", json=body).json()
    assert mapper.images == [PNG]
    assert (mapper.asked[0].area_m, len(reply["regions"])) == ((0.0, -1.0, 2.0, 3.0), 1)
    assert (reply["text"], reply["calibrated"]) == ("image", False)
    assert reply["sentence"].startswith("What the image shows is at (0.35, 1.15) m")
    mapper.bus.close()


Events = AsyncIterator[ServerSentEvent]


class ChangingMapper(FakeMapper):
    """A mapper whose best region moves, and whose revisions are announced."""

    moved_m = 0.0
    empty = False

    def similarity(self, request: m.SimilarityRequest) -> m.SimilarityReply:
        if self.empty:
            raise RequestRejected("empty_map", "the map is empty: nothing has been seen yet")
        reply = super().similarity(request)
        return replace(reply, centres_m=reply.centres_m + self.moved_m)

    def announce(self, number: int) -> None:
        self.bus.publish(keys.MAP_REVISION).put(revision(number))


def listen(
    router: MemoryRouter, texts: list[str], scenario: Callable[[GatewayContext, Events], Any]
) -> None:
    with gateway_on(router) as gateway:
        events = query_events(gateway, QueryRequest.model_validate({"texts": texts}))
        anyio.run(scenario, gateway, events)


def test_each_text_is_answered_and_again_only_when_it_changes(router: MemoryRouter) -> None:
    mapper = ChangingMapper(router)

    async def scenario(gateway: GatewayContext, events: Events) -> None:
        first = [(await next_event(events))[1] for _ in range(2)]
        assert [(one["text"], one["verdict"]) for one in first] == [
            ("sofa", "found"),
            ("kite", "not_looked_yet"),
        ]
        for number, moved_m in ((1, 0.0), (2, 0.05), (3, 0.3)):
            mapper.moved_m = moved_m
            mapper.announce(number)
            await anyio.to_thread.run_sync(
                state_reached,
                gateway.cache,
                lambda state, wanted=number: (
                    state.revision and state.revision.message.revision == wanted
                ),
            )
            if number == 3:
                name, changed = await next_event(events)
                assert (name, changed["text"]) == ("answer", "sofa")
                assert changed["regions"][0]["centre_m"] == pytest.approx([0.65, 1.45])

    listen(router, ["sofa", "kite"], scenario)


def test_an_empty_map_is_a_problem_that_passes(router: MemoryRouter) -> None:
    mapper = ChangingMapper(router)
    mapper.empty = True

    async def scenario(_gateway: GatewayContext, events: Events) -> None:
        name, problem = await next_event(events)
        assert (name, problem["status"]) == ("problem", 409)
        mapper.empty = False
        name, answer = await next_event(events)
        assert (name, answer["text"]) == ("answer", "sofa")

    listen(router, ["sofa"], scenario)


@pytest.mark.parametrize(
    ("body", "reason"),
    [
        ({}, "text"),
        ({"text": "flurb"}, "flurb"),
        ({"text": "sofa", "area_m": [1, 0, 0, 1]}, "x_min < x_max"),
        ({"texts": ["sofa"] * 21}, "texts"),
        ({"image": IMAGE}, "'image' is for POST /v1/queries"),
    ],
)
def test_what_cannot_be_followed_is_refused_before_the_stream(
    client: TestClient, body: dict[str, Any], reason: str
) -> None:
    answer = client.post("/v1/queries/events", json=body)
    assert answer.status_code == 422
    assert reason in answer.json()["detail"]
