"""Standing queries: an event for each change of an answer, and none without one."""

from __future__ import annotations

import json
from base64 import b64encode
from collections.abc import AsyncIterator, Callable
from contextlib import closing
from dataclasses import replace
from typing import Any

import anyio
import httpx
import pytest
from fastapi.sse import ServerSentEvent
from starlette.testclient import TestClient

from onemap.connection import stream_messages
from onemap_gateway.config import GatewayConfig
from onemap_gateway.http.context import GatewayContext
from onemap_gateway.http.queries import QueryIntervals, query_events
from onemap_gateway.http.schemas import QueryRequest
from onemap_gateway.http.shared_results import MAX_IMAGE_STREAMS
from onemap_gateway.service import build
from onemap_shared import keys
from onemap_shared import messages as m
from onemap_shared.memory_bus import MemoryRouter
from onemap_shared.messages import MAX_IMAGE_BYTES
from onemap_shared.transport import RequestRejected
from tests.gateway.fakes import (
    WAIT_S,
    FakeMapper,
    client_of,
    gateway_on,
    revision,
    state_reached,
)
from tests.shared.samples import PNG

BODY: dict[str, Any] = {"image": b64encode(PNG).decode()}
FAST = QueryIntervals(poll_s=0.01, query_s=0.0)
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


async def next_event(events: Events) -> tuple[str, dict[str, Any]]:
    with anyio.fail_after(WAIT_S):
        event = await events.__anext__()
    assert event.event is not None
    return event.event, event.data


def listen(
    router: MemoryRouter, texts: list[str], scenario: Callable[[GatewayContext, Events], Any]
) -> None:
    with gateway_on(router) as gateway:
        events = query_events(gateway, QueryRequest(texts=texts), FAST)
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


def test_an_unknown_word_ends_the_stream(router: MemoryRouter) -> None:
    FakeMapper(router)

    async def scenario(_gateway: GatewayContext, events: Events) -> None:
        name, problem = await next_event(events)
        assert (name, problem["status"]) == ("problem", 422)
        with pytest.raises(StopAsyncIteration):
            await next_event(events)

    listen(router, ["flurb"], scenario)


def test_an_image_is_answered_over_a_socket_and_again_when_it_changes(
    router: MemoryRouter,
) -> None:
    mapper = ChangingMapper(router)
    body = {**BODY, "max_regions": 1}
    with closing(build(router.bus("gateway"), GatewayConfig(port=0))) as worker:
        address = f"http://127.0.0.1:{worker.port}/v1/queries/events"
        with httpx.stream("POST", address, json=body, timeout=WAIT_S, trust_env=False) as stream:
            messages = stream_messages(stream.iter_bytes())
            first = json.loads(next(messages).data)
            assert (first["text"], first["calibrated"]) == ("image", False)
            assert len(first["regions"]) == 1
            mapper.moved_m = 0.3
            mapper.announce(1)
            changed = json.loads(next(messages).data)
            assert changed["regions"][0]["centre_m"] == pytest.approx([0.65, 1.45])
    assert set(mapper.images) == {PNG}


@pytest.mark.parametrize(
    ("body", "reason"),
    [
        ({}, "exactly one of 'text'"),
        ({"text": "flurb"}, "flurb"),
        ({"image": "R0lGODlh"}, "no PNG and no JPEG"),
        ({"image": b64encode(bytes(MAX_IMAGE_BYTES + 1)).decode()}, "the limit is 524288"),
        ({"text": "sofa", "include_grid": True}, "'include_grid' is for POST /v1/queries"),
    ],
)
def test_a_body_that_cannot_be_followed_is_refused_before_the_stream(
    client: TestClient, body: dict[str, object], reason: str
) -> None:
    answer = client.post("/v1/queries/events", json=body)
    assert answer.status_code == 422
    assert reason in answer.json()["detail"]


@pytest.mark.parametrize("code", ["bad_image", "no_image_queries"])
def test_an_image_that_perception_refuses_frees_its_place(router: MemoryRouter, code: str) -> None:
    FakeMapper(router, image_problem=RequestRejected(code, "why: do this"))
    with gateway_on(router) as gateway:
        answer = client_of(gateway).post("/v1/queries/events", json=BODY)
        assert (answer.status_code, answer.json()["type"]) == (422, f"/docs#problem-{code}")
        assert gateway.image_streams.open == 0


def test_a_stream_with_an_image_holds_a_place_until_it_ends(router: MemoryRouter) -> None:
    held: list[int] = []
    refusals = iter([("empty_map", "nothing has been seen yet"), ("bad_image", "one colour only")])
    with gateway_on(router) as gateway:

        def similarity(_request: m.ImageSimilarityRequest) -> m.SimilarityReply:
            held.append(gateway.image_streams.open)
            raise RequestRejected(*next(refusals))

        router.bus("mapper").serve(keys.MAP_IMAGE_SIMILARITY, similarity)
        answer = client_of(gateway).post("/v1/queries/events", json=BODY)
        assert (answer.status_code, answer.text.count("event: problem")) == (200, 1)
        assert "#problem-bad_image" in answer.text
        assert (held, gateway.image_streams.open) == ([1, 1], 0)


def test_one_stream_too_many_with_an_image_is_refused(router: MemoryRouter) -> None:
    FakeMapper(router)
    with gateway_on(router) as gateway:
        gateway.image_streams.open = MAX_IMAGE_STREAMS
        refused = client_of(gateway).post("/v1/queries/events", json=BODY)
    assert (refused.status_code, refused.headers["Retry-After"]) == (503, "2")
    assert "close one of them" in refused.json()["detail"]


@pytest.mark.parametrize(
    ("asked", "reason"),
    [
        ("", "text"),
        ("text=", "empty"),
        ("text=flurb", "flurb"),
        ("text=sofa&area_m=1,2", "area_m"),
        ("text=sofa&area_m=here", "area_m"),
        ("text=sofa&area_m=1,0,0,1", "x_min < x_max"),
        ("text=sofa&max_regions=0", "max_regions"),
        ("&".join(["text=sofa"] * 21), "text"),
    ],
)
def test_what_cannot_be_followed_is_refused_before_the_stream(
    client: TestClient, asked: str, reason: str
) -> None:
    answer = client.get(f"/v1/queries/events?{asked}")
    assert answer.status_code == 422
    assert reason in answer.json()["detail"]
