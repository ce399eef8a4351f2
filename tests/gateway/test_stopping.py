"""A stop has a way of its own through the gateway: nothing that only reads is before it."""

from __future__ import annotations

import inspect
import select
import socket
import threading
from collections.abc import Iterator
from contextlib import ExitStack, closing
from pathlib import Path
from typing import Any

import httpx
import pytest
from fastapi.routing import APIRoute
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from onemap_gateway import connections
from onemap_gateway.config import GatewayConfig
from onemap_gateway.http.context import Paces
from onemap_gateway.http.routes import agents, searches
from onemap_gateway.service import GatewayWorker
from onemap_shared import messages as m
from tests.gateway.fakes import WAIT_S, FakePlanner, search
from tests.gateway.test_connections import eventually
from tests.memory_bus import MemoryRouter

READERS = 64
REPLAY = "/v1/searches/s1/replay"
CURRENT = "/v1/searches/current"
TOOL = {"jsonrpc": "2.0", "id": 1, "method": "tools/call", "params": {"name": "stop"}}


class SlowPlanner(FakePlanner):
    """Reads a record only when the test lets it; stops at once."""

    def __post_init__(self) -> None:
        self.reads, self.asked, self.release = 0, threading.Event(), threading.Event()
        super().__post_init__()

    def _record(self, request: m.SearchId) -> m.SearchRecord:
        self.reads += 1
        self.asked.set()
        self.release.wait(WAIT_S)
        return super()._record(request)


@pytest.fixture
def slow(router: MemoryRouter) -> Iterator[SlowPlanner]:
    planner = SlowPlanner(router.space("r1"), search("s1"))
    own = FakePlanner(router, search("s1"))
    yield planner
    planner.release.set()
    planner.bus.close()
    own.bus.close()


@pytest.fixture
def worker(router: MemoryRouter, slow: SlowPlanner) -> Iterator[GatewayWorker]:
    config = GatewayConfig(port=0, robots={"r1": "r1"})
    patient = Paces(call_timeout_s=WAIT_S)  # nobody gives up before the test is over
    with closing(GatewayWorker(router.bus("gateway"), config, patient)) as worker:
        yield worker


def opened(worker: GatewayWorker, path: str = "") -> socket.socket:
    """A connection, with a request for ``path`` if that is given."""
    client = socket.create_connection(("127.0.0.1", worker.port), timeout=WAIT_S)
    if path:
        client.sendall(f"GET {path} HTTP/1.1\r\nHost: localhost\r\n\r\n".encode())
    return client


@pytest.fixture
def readers(worker: GatewayWorker, slow: SlowPlanner) -> Iterator[list[socket.socket]]:
    """Clients that wait for a replay of the robot r1, the first of them in its planner."""
    with ExitStack() as stack:
        yield [stack.enter_context(opened(worker, f"/robots/r1{REPLAY}")) for _ in range(READERS)]
        slow.release.set()


@pytest.fixture
def client(worker: GatewayWorker) -> Iterator[httpx.Client]:
    address = f"http://127.0.0.1:{worker.port}/robots/r1"
    with httpx.Client(base_url=address, timeout=WAIT_S, trust_env=False) as client:
        yield client


def stopped(client: httpx.Client, way: str) -> str:
    """Stop the robot, with a request or as an agent does; the state of its search then."""
    if way == "agent":
        answer = client.post("/mcp", json=TOOL, headers={"Accept": "application/json"}).json()
        document: dict[str, Any] = answer["result"]["structuredContent"]
    else:
        document = client.delete(CURRENT).json()
    return str(document["state"])


@pytest.mark.parametrize("way", ["request", "agent"])
def test_readers_do_not_delay_a_stop(
    slow: SlowPlanner, readers: list[socket.socket], client: httpx.Client, way: str
) -> None:
    assert slow.asked.wait(WAIT_S)
    assert stopped(client, way) == "cancelled"
    answered, _, _ = select.select(readers, [], [], 0)
    assert answered == []


@pytest.mark.parametrize("way", ["request", "agent"])
def test_a_stop_is_served_beyond_the_limit_of_connections(
    worker: GatewayWorker, readers: list[socket.socket], client: httpx.Client, way: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    monkeypatch.setattr(connections, "MAX_CONNECTIONS", 1)
    with ExitStack() as stack:
        for _ in range(2 * connections.STOP_CONNECTIONS):  # that never send a request
            stack.enter_context(opened(worker))
        assert stopped(client, way) == "cancelled"
        refused = httpx.get(f"{client.base_url}v1/status", timeout=WAIT_S)
        assert (refused.status_code, refused.headers["Connection"]) == (503, "close")
        assert "except to stop the robot" in refused.json()["detail"]
        with pytest.raises(InvalidStatus, match="503"):
            connect(f"ws://127.0.0.1:{worker.port}/v1/live")


SLOW_IMPORT = """
from tests.gateway import test_stopping
test_stopping.IMPORTING.set()
test_stopping.IMPORTED.wait(test_stopping.WAIT_S)
raise ModuleNotFoundError("slow")
"""
IMPORTING, IMPORTED = threading.Event(), threading.Event()


def test_an_import_of_the_tools_for_agents_does_not_delay_a_stop(
    worker: GatewayWorker, client: httpx.Client, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nor does a second request, which finds the module half imported."""
    (tmp_path / "slow_tools.py").write_text(SLOW_IMPORT, encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(agents, "TOOLS", "slow_tools")
    request = b"POST /mcp HTTP/1.1\r\nHost: localhost\r\nContent-Length: 0\r\n\r\n"
    with opened(worker) as first, opened(worker) as second:
        first.sendall(request)
        assert IMPORTING.wait(WAIT_S)
        second.sendall(request)
        assert stopped(client, "request") == "cancelled"
        IMPORTED.set()
        assert b" 501 " in first.recv(64)
        assert b" 501 " in second.recv(64)


def test_a_stop_needs_no_thread_that_all_requests_share() -> None:
    (route,) = (
        each
        for each in searches.router.routes
        if isinstance(each, APIRoute) and each.methods == {"DELETE"}
    )
    calls = [route.endpoint, *(each.call for each in route.dependant.dependencies)]
    assert [each for each in calls if not inspect.iscoroutinefunction(each)] == []


def test_work_for_clients_that_have_gone_is_not_done(
    worker: GatewayWorker, slow: SlowPlanner, readers: list[socket.socket], client: httpx.Client
) -> None:
    assert slow.asked.wait(WAIT_S)
    for reader in readers:
        reader.close()
    held = worker._server.server_state.connections
    assert eventually(lambda: not held)
    slow.release.set()
    assert client.get(REPLAY).json()["search"]["id"] == "s1"
    assert slow.reads < READERS / 2  # those that were in the planner before, and this one
