"""The gateway as a process: real sockets, and an end within two seconds."""

from __future__ import annotations

import json
import socket
import threading
from collections.abc import Iterator

import httpx
import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

from onemap_gateway.config import GatewayConfig
from onemap_gateway.service import GatewayWorker, HttpServer, build
from onemap_shared import keys
from tests.gateway import fakes
from tests.gateway.fakes import WAIT_S, FakePlanner
from tests.memory_bus import MemoryRouter

TEST = GatewayConfig(port=0)


@pytest.fixture
def worker(router: MemoryRouter) -> Iterator[GatewayWorker]:
    worker = build(router.bus("gateway"), TEST)
    yield worker
    worker.close()


def drain(live: ClientConnection) -> None:
    while True:
        live.recv(timeout=WAIT_S)


def steps(worker: GatewayWorker, count: int) -> None:
    for _ in range(count):
        worker.step(0.01)


def client_for(worker: GatewayWorker) -> httpx.Client:
    return httpx.Client(base_url=f"http://127.0.0.1:{worker.port}", timeout=WAIT_S)


def test_an_event_loop_that_hangs_takes_the_process_down(
    worker: GatewayWorker, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("onemap_shared.watchdog.HANG_LIMIT_S", 0.2)
    hanging, release = threading.Event(), threading.Event()

    async def hang(_server: HttpServer, _counter: int) -> bool:
        hanging.set()
        release.wait(WAIT_S)
        return False

    monkeypatch.setattr(HttpServer, "on_tick", hang)
    assert hanging.wait(WAIT_S)
    with pytest.raises(RuntimeError, match="the HTTP server has made no progress"):
        steps(worker, 1000)
    release.set()


def test_a_client_that_does_not_read_delays_no_other(
    worker: GatewayWorker, router: MemoryRouter
) -> None:
    odometry = router.bus("simulator").publish(keys.ROBOT_ODOMETRY)
    address = f"ws://127.0.0.1:{worker.port}/v1/live"
    with connect(address, max_queue=1, close_timeout=0.1), connect(address) as quick:
        for index in range(4):
            odometry.put(fakes.odometry(float(index), 0.0, sequence=index))
            json.loads(quick.recv(timeout=WAIT_S))
        while json.loads(quick.recv(timeout=WAIT_S))["robot"]["x_m"] < 3:
            pass


def test_it_ends_though_clients_hold_on(router: MemoryRouter) -> None:
    planner = FakePlanner(router, fakes.search("s1"))
    worker = build(router.bus("gateway"), TEST)
    with (
        connect(f"ws://127.0.0.1:{worker.port}/v1/live") as live,
        client_for(worker) as client,
        client.stream("GET", "/v1/searches/s1/events") as events,
    ):
        live.recv(timeout=WAIT_S)
        next(events.iter_lines())
        closing = threading.Thread(target=worker.close)
        closing.start()
        closing.join(WAIT_S)
        assert not closing.is_alive()
        with pytest.raises(ConnectionClosed) as end:
            drain(live)
        assert end.value.rcvd is not None
        assert end.value.rcvd.code in {1001, 1012}  # ours, or the server's: whichever is first
    with pytest.raises(RuntimeError, match="ended by itself"):
        worker.step(0.0)
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(("127.0.0.1", worker.port), timeout=WAIT_S)
    planner.bus.close()


@pytest.mark.parametrize(("token", "warned"), [("0123", True), ("f" * 32, False)])
def test_a_token_that_can_be_guessed_is_named(
    router: MemoryRouter, caplog: pytest.LogCaptureFixture, token: str, warned: bool
) -> None:
    config = GatewayConfig.model_validate({"host": "0.0.0.0", "port": 0, "token": token})
    build(router.bus("gateway"), config).close()
    assert ("'gateway.token' has 4 characters" in caplog.text) == warned
