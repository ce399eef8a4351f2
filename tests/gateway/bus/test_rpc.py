"""Calls to services: answered, refused, or given up in time."""

from __future__ import annotations

import threading
from collections.abc import Iterator

import anyio
import pytest

from onemap_gateway.bus.rpc import RpcClient
from onemap_shared import keys
from onemap_shared.memory_bus import MemoryRouter
from onemap_shared.messages import MapClear, SearchId, SearchStatus
from onemap_shared.transport import NoReply, QueryTimeout, RemoteError
from tests.gateway.fakes import FakeMapper, FakePlanner, search

NEWEST = SearchId()


@pytest.fixture
def hung(router: MemoryRouter) -> Iterator[MemoryRouter]:
    """A planner that never answers, until the test is over."""
    bus, release = router.bus("planner"), threading.Event()

    def wait(_request: SearchId) -> SearchStatus:
        release.wait()
        return search()

    bus.serve(keys.SEARCH_GET, wait)
    yield router
    release.set()
    bus.close()


def test_an_answer_comes_back(router: MemoryRouter, planner: FakePlanner) -> None:
    planner.status = search("s9")
    rpc = RpcClient(router.bus(), 2)
    assert anyio.run(rpc.call, keys.SEARCH_GET, NEWEST, 2.0).search_id == "s9"


def test_an_absent_service_is_raised_at_once(router: MemoryRouter) -> None:
    with pytest.raises(NoReply):
        anyio.run(RpcClient(router.bus(), 2).call, keys.SEARCH_GET, NEWEST, 60.0)


def test_a_refusal_keeps_its_code(router: MemoryRouter, planner: FakePlanner) -> None:
    with pytest.raises(RemoteError) as refusal:
        anyio.run(RpcClient(router.bus(), 2).call, keys.SEARCH_GET, NEWEST, 2.0)
    assert refusal.value.code == "unknown_search"


def test_silence_is_given_up(hung: MemoryRouter) -> None:
    with pytest.raises(QueryTimeout):
        anyio.run(RpcClient(hung.bus(), 2).call, keys.SEARCH_GET, NEWEST, 0.05)


def test_callers_beyond_the_limit_give_up_in_time_too(hung: MemoryRouter) -> None:
    rpc, given_up = RpcClient(hung.bus(), 1), list[QueryTimeout]()

    async def one() -> None:
        try:
            await rpc.call(keys.SEARCH_GET, NEWEST, 0.4)
        except QueryTimeout as error:
            given_up.append(error)

    async def crowd() -> None:
        async with anyio.create_task_group() as tasks:
            for _ in range(20):
                tasks.start_soon(one)

    anyio.run(crowd)
    assert len(given_up) == 20


def test_a_hung_service_does_not_delay_another(hung: MemoryRouter) -> None:
    FakeMapper(hung)
    rpc = RpcClient(hung.bus(), 1)
    order: list[str] = []

    async def call_planner() -> None:
        try:
            await rpc.call(keys.SEARCH_GET, NEWEST, 0.5)
        except QueryTimeout:
            order.append("planner")

    async def both() -> None:
        async with anyio.create_task_group() as tasks:
            tasks.start_soon(call_planner)
            await rpc.call(keys.MAP_CLEAR, MapClear(), 0.5)
            order.append("mapper")

    anyio.run(both)
    assert order == ["mapper", "planner"]


def test_queries_have_threads_of_their_own(router: MemoryRouter) -> None:
    """As many at once as the mapper serves, whatever the limit for other calls."""
    count = keys.MAP_SIMILARITY.parallel
    rpc = RpcClient(router.bus(), 1)
    assert rpc._limiter(keys.MAP_SIMILARITY.key).total_tokens == count
    assert rpc._limiter(keys.MAP_SAVE.key).total_tokens == 1
    assert rpc._limiter(keys.MAP_SAVE.key) is rpc._limiter(keys.MAP_LOAD.key)
