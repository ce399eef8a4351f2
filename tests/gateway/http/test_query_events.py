"""Standing queries: an event for each change of an answer, and none without one."""

from __future__ import annotations

from collections.abc import AsyncIterator, Callable
from dataclasses import replace
from typing import Any

import anyio
import pytest
from fastapi.sse import ServerSentEvent
from starlette.testclient import TestClient

from onemap_gateway.http.context import GatewayContext
from onemap_gateway.http.query_events import QueryIntervals, query_events
from onemap_gateway.http.schemas import QueryRequest
from onemap_shared import keys
from onemap_shared import messages as m
from onemap_shared.memory_bus import MemoryRouter
from onemap_shared.transport import RequestRejected
from tests.gateway.fakes import WAIT_S, FakeMapper, gateway_on, revision, state_reached

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
