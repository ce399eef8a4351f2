"""Questions to services: answered, refused, or given up in time."""

from __future__ import annotations

import threading
from collections.abc import Iterator

import anyio
import pytest

from onemap_gateway.bus.rpc import RpcClient
from onemap_gateway.http.problems import HttpProblem
from onemap_shared import keys
from onemap_shared.memory_bus import MemoryRouter
from onemap_shared.messages import MapClear, MapSummary, SearchId, SearchStatus
from onemap_shared.transport import RequestRejected
from tests.gateway.fakes import FakeMapper, FakePlanner, search

NEWEST = SearchId()


@pytest.fixture
def hung(hub: MemoryRouter) -> Iterator[MemoryRouter]:
    """A planner that never answers, until the test is over."""
    bus, release = hub.bus("planner"), threading.Event()

    def wait(_request: SearchId) -> SearchStatus:
        release.wait()
        return search()

    bus.serve(keys.SEARCH_GET, wait)
    yield hub
    release.set()
    bus.close()


def problem_of(rpc: RpcClient) -> HttpProblem:
    with pytest.raises(HttpProblem) as refusal:
        anyio.run(rpc.call, keys.SEARCH_GET, NEWEST)
    return refusal.value


def test_an_answer_comes_back(hub: MemoryRouter, planner: FakePlanner) -> None:
    planner.status = search("s9")
    rpc = RpcClient(hub.bus(), 2.0, 2)
    assert anyio.run(rpc.call, keys.SEARCH_GET, NEWEST).search_id == "s9"


def test_nobody_there_is_said_at_once(hub: MemoryRouter) -> None:
    problem = problem_of(RpcClient(hub.bus(), 2.0, 2))
    assert (problem.kind, problem.extra["service"]) == ("unavailable", "planner")


def test_a_refusal_keeps_its_code(hub: MemoryRouter, planner: FakePlanner) -> None:
    assert problem_of(RpcClient(hub.bus(), 2.0, 2)).kind == "unknown_search"


def test_silence_is_given_up(hung: MemoryRouter) -> None:
    problem = problem_of(RpcClient(hung.bus(), 0.05, 2))
    assert (problem.kind, problem.extra["service"]) == ("timeout", "planner")


def test_a_crowd_before_a_hung_service_is_sent_away_too(hung: MemoryRouter) -> None:
    rpc, outcomes = RpcClient(hung.bus(), 0.4, 1), list[str]()

    async def one() -> None:
        try:
            await rpc.call(keys.SEARCH_GET, NEWEST)
        except HttpProblem as problem:
            outcomes.append(problem.kind)

    async def crowd() -> None:
        async with anyio.create_task_group() as tasks:
            for _ in range(20):
                tasks.start_soon(one)

    anyio.run(crowd)
    assert outcomes == ["timeout"] * 20


def test_a_hung_service_does_not_hold_up_another(hung: MemoryRouter) -> None:
    FakeMapper(hung)
    rpc = RpcClient(hung.bus(), 0.5, 1)
    order: list[str] = []

    async def ask_planner() -> None:
        try:
            await rpc.call(keys.SEARCH_GET, NEWEST)
        except HttpProblem:
            order.append("planner")

    async def both() -> None:
        async with anyio.create_task_group() as tasks:
            tasks.start_soon(ask_planner)
            await rpc.call(keys.MAP_CLEAR, keys.MAP_CLEAR.request())
            order.append("mapper")

    anyio.run(both)
    assert order == ["mapper", "planner"]


def hangs(service: str) -> str:
    return f"The {service} hangs."


def test_nobody_there_is_a_timeout_where_the_service_is_known_to_hang(hub: MemoryRouter) -> None:
    problem = problem_of(RpcClient(hub.bus(), 2.0, 2, hangs))
    assert (problem.kind, problem.extra["service"]) == ("timeout", "planner")
    assert problem.detail == "The planner hangs."


def test_a_hung_service_behind_the_one_asked_is_told_the_same_way(hub: MemoryRouter) -> None:
    bus = hub.bus("mapper")

    def refuse(_request: MapClear) -> MapSummary:
        raise RequestRejected("perception_missing", "perception does not run")

    bus.serve(keys.MAP_CLEAR, refuse)
    with pytest.raises(HttpProblem, match="perception hangs") as refused:
        anyio.run(RpcClient(hub.bus(), 2.0, 2, hangs).call, keys.MAP_CLEAR, MapClear())
    assert (refused.value.kind, refused.value.extra["service"]) == ("timeout", "perception")
