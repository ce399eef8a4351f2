"""What is received: the state, the latencies of frames, the cache, calls to services."""

from __future__ import annotations

import threading
from collections.abc import Iterator

import anyio
import pytest

from onemap_gateway.bus import live_state
from onemap_gateway.bus.rpc import RpcClient
from onemap_gateway.bus.state_cache import StateCache
from onemap_gateway.present.service_status import hung_problem
from onemap_shared import keys
from onemap_shared.clock import SystemClock
from onemap_shared.messages import MapClear, SearchId, SearchRequest, SearchStatus
from onemap_shared.transport import QueryTimeout
from tests.gateway import fakes
from tests.gateway.fakes import FakeMapper, search, state_reached
from tests.memory_bus import MemoryRouter


def test_old_detections_and_paths_are_not_shown() -> None:
    state = live_state.LiveState().with_message(fakes.detections("sofa"), 0.0)
    state = state.with_message(fakes.planned_path((0, 0)), 0.0)
    assert state.detections_now(1.0) is not None
    assert state.detections_now(2.0) is None
    assert state.path_now(4.0) is not None
    assert state.path_now(6.0) is None
    assert live_state.LiveState().detections_now(0.0) is None
    assert live_state.LiveState().path_now(0.0) is None


def test_a_service_hangs_if_it_was_silent_before_its_token_went() -> None:
    now_s = [10.0]

    class SetClock(SystemClock):
        def monotonic_s(self) -> float:
            return now_s[0]

    router = MemoryRouter(SetClock())
    mapper = router.bus("mapper")
    cache = StateCache(router.bus("gateway"))
    mapper.publish(keys.heartbeat("mapper")).put(fakes.heartbeat("mapper"))
    assert state_reached(cache, lambda state: "mapper" in state.heartbeats)
    assert state_reached(cache, lambda state: "mapper" in state.alive)
    now_s[0] = 12.5
    assert hung_problem("mapper", cache.state_with_fresh_liveliness(), 12.5) == ""
    mapper.close()
    fresh = cache.state_with_fresh_liveliness()  # before the next poll of the tokens
    assert "its process hangs" in hung_problem("mapper", fresh, 12.5)
    cache.close()


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


def test_a_search_ages_while_calls_before_it_are_answered(router: MemoryRouter) -> None:
    planner, release, asked = router.bus("planner"), threading.Event(), list[SearchRequest]()

    def wait(_request: SearchId) -> SearchStatus:
        release.wait()
        return search()

    def start(request: SearchRequest) -> SearchStatus:
        asked.append(request)
        return search()

    planner.serve(keys.SEARCH_GET, wait)
    planner.serve(keys.SEARCH_START, start)
    rpc = RpcClient(router.bus("gateway"), 1)

    async def both() -> None:
        async with anyio.create_task_group() as tasks:
            tasks.start_soon(rpc.call, keys.SEARCH_GET, NEWEST, 60.0)
            await anyio.wait_all_tasks_blocked()
            request = SearchRequest(("sofa",), patience_s=60.0)
            tasks.start_soon(rpc.call, keys.SEARCH_START, request, 60.0)
            await anyio.wait_all_tasks_blocked()
            until_s = anyio.current_time() + 0.1
            while anyio.current_time() < until_s:
                pass
            release.set()

    anyio.run(both)
    assert asked[0].age_s >= 0.1
    assert asked[0].patience_s <= 59.9
