"""A search as server-sent events: every change, across a restart of the planner, to its end."""

from __future__ import annotations

from collections.abc import AsyncIterator, Callable
from typing import Any

import anyio
from fastapi.sse import ServerSentEvent

from onemap_gateway.http.context import GatewayContext
from onemap_gateway.http.routes.searches import EventIntervals, search_events, supersedes
from onemap_shared.memory_bus import MemoryRouter
from onemap_shared.messages import SearchState
from tests.gateway.fakes import WAIT_S, FakePlanner, gateway_on, search

FAST = EventIntervals(poll_s=0.01, query_s=0.05)


async def next_event(events: AsyncIterator[ServerSentEvent]) -> tuple[str, dict[str, Any]]:
    """Name and data of the next event."""
    with anyio.fail_after(WAIT_S):
        event = await events.__anext__()
    assert event.event is not None
    return event.event, event.data


async def is_over(events: AsyncIterator[ServerSentEvent]) -> bool:
    with anyio.fail_after(WAIT_S):
        return [event async for event in events] == []


def listen(
    router: MemoryRouter,
    scenario: Callable[[GatewayContext, AsyncIterator[ServerSentEvent]], Any],
    intervals: EventIntervals = FAST,
) -> None:
    """Run a scenario on the events of the search ``s1``."""
    with gateway_on(router) as gateway:
        events = search_events(gateway, search("s1"), count=0, intervals=intervals)
        anyio.run(scenario, gateway, events)


def test_every_change_is_sent_once_up_to_the_final_state(
    router: MemoryRouter, planner: FakePlanner
) -> None:
    async def scenario(gateway: GatewayContext, events: AsyncIterator[ServerSentEvent]) -> None:
        name, status = await next_event(events)
        assert (name, status["id"], status["state"]) == ("status", "s1", "exploring")
        for state in (SearchState.APPROACHING, SearchState.CONFIRMING, SearchState.FOUND):
            planner.move(state)
        states = [(await next_event(events))[1]["state"] for _ in range(3)]
        assert states == ["approaching", "confirming", "found"]
        assert await is_over(events)

    planner.status = search("s1")
    listen(router, scenario)


def test_the_stream_outlives_its_planner(router: MemoryRouter) -> None:
    old = FakePlanner(router, search("s1"))

    async def scenario(gateway: GatewayContext, events: AsyncIterator[ServerSentEvent]) -> None:
        await next_event(events)
        old.bus.close()
        name, problem = await next_event(events)
        assert (name, problem["service"]) == ("problem", "planner")
        new = FakePlanner(
            router, search("s1", SearchState.FOUND, updated_ns=search().updated_ns + 9)
        )
        name, status = await next_event(events)
        assert (name, status["state"]) == ("status", "found")
        assert await is_over(events)
        new.bus.close()

    listen(router, scenario)


def test_a_search_that_the_planner_forgot_ends_with_a_problem(
    router: MemoryRouter, planner: FakePlanner
) -> None:
    async def scenario(gateway: GatewayContext, events: AsyncIterator[ServerSentEvent]) -> None:
        await next_event(events)
        name, problem = await next_event(events)
        assert (name, problem["status"]) == ("problem", 404)
        assert await is_over(events)

    listen(router, scenario)


def test_a_final_search_is_sent_and_ends_the_stream(router: MemoryRouter) -> None:
    async def scenario(gateway: GatewayContext) -> None:
        events = search_events(gateway, search(state=SearchState.FOUND), count=0)
        assert (await next_event(events))[1]["state"] == "found"
        assert await is_over(events)

    with gateway_on(router) as gateway:
        anyio.run(scenario, gateway)


def test_the_stream_ends_when_the_gateway_goes_down(
    router: MemoryRouter, planner: FakePlanner
) -> None:
    async def scenario(gateway: GatewayContext, events: AsyncIterator[ServerSentEvent]) -> None:
        await next_event(events)
        gateway.cache.begin_close()
        assert await is_over(events)

    planner.status = search("s1")
    listen(router, scenario)


def test_a_later_state_of_the_same_search_supersedes() -> None:
    first = search("s1", updated_ns=5)
    assert supersedes(search("s1", SearchState.FOUND, updated_ns=6), first)
    assert not supersedes(first, first)
    assert not supersedes(search("s1", SearchState.APPROACHING, updated_ns=4), first)
    assert supersedes(search("s1", SearchState.FOUND, updated_ns=4), first)  # made in one instant
    assert not supersedes(search("s2", updated_ns=6), first)
    assert not supersedes(search("s1", updated_ns=7), search("s1", SearchState.FOUND, updated_ns=6))
