"""Connections of clients that are slow, too many, or no HTTP; the port."""

from __future__ import annotations

import asyncio
import resource
import select
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing
from types import SimpleNamespace

import pytest

from onemap_gateway import connections
from onemap_gateway.config import GatewayConfig
from onemap_gateway.connections import (
    RESERVED_DESCRIPTORS,
    STOP_CONNECTIONS,
    LimitedConnection,
    connection_limit,
    listen,
)
from onemap_gateway.service import GatewayWorker, build
from onemap_shared.runner import StartError
from tests.gateway.fakes import WAIT_S
from tests.memory_bus import MemoryRouter

LIMIT = 8
WEBSOCKET = (
    "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
    "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
)
REQUEST = b"GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n"


@pytest.fixture
def worker(router: MemoryRouter, monkeypatch: pytest.MonkeyPatch) -> Iterator[GatewayWorker]:
    monkeypatch.setattr(connections, "REQUEST_TIMEOUT_S", WAIT_S)
    monkeypatch.setattr(connections, "READER_TIMEOUT_S", 1)
    monkeypatch.setattr(connections, "MAX_CONNECTIONS", LIMIT)
    with closing(build(router.bus("gateway"), GatewayConfig(port=0))) as worker:
        yield worker


def opened(worker: GatewayWorker, sent: bytes = b"") -> socket.socket:
    client = socket.create_connection(("127.0.0.1", worker.port), timeout=WAIT_S)
    client.sendall(sent)
    return client


def everything(client: socket.socket) -> bytes:
    """All that arrives until the gateway ends the connection."""
    parts = []
    try:
        while part := client.recv(65536):
            parts.append(part)
    except ConnectionResetError:
        pass
    return b"".join(parts)


def eventually(condition: Callable[[], bool]) -> bool:
    """Whether the condition holds before ``WAIT_S`` has passed."""
    deadline_s = time.monotonic() + WAIT_S
    while not condition():
        if time.monotonic() > deadline_s:
            return False
    return True


def test_more_connections_than_there_is_room_for_get_a_problem(worker: GatewayWorker) -> None:
    with ExitStack() as stack:
        held = [stack.enter_context(opened(worker, REQUEST)) for _ in range(LIMIT)]
        assert all(b"200 OK" in client.recv(4096) for client in held)
        answer = everything(stack.enter_context(opened(worker, REQUEST)))
        assert answer.startswith(b"HTTP/1.1 503 ")
        assert b"room for another" in answer
        held[0].close()
        assert eventually(lambda: b"200 OK" in reply(worker))


@pytest.mark.parametrize("stopping", [False, True])
def test_a_burst_of_connections_leaves_no_more_than_there_is_room_for(
    worker: GatewayWorker, stopping: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """All are accepted in one turn of the event loop, before any of them is closed."""
    monkeypatch.setattr(connections, "StopsOnly", lambda *_: SimpleNamespace(stopping=stopping))
    held, accept = worker._server.server_state.connections, threading.Event()
    with ExitStack() as stack:
        clients = [stack.enter_context(opened(worker))]
        assert eventually(lambda: bool(held))
        (first,) = held
        first.loop.call_soon_threadsafe(accept.wait, WAIT_S)
        for _ in range(LIMIT + 4 * STOP_CONNECTIONS):
            clients.append(stack.enter_context(opened(worker)))
        accept.set()
        surplus = len(clients) - LIMIT - STOP_CONNECTIONS
        assert eventually(lambda: len(select.select(clients, [], [], 0)[0]) == surplus)
        assert len(held) == LIMIT + STOP_CONNECTIONS


def reply(worker: GatewayWorker) -> bytes:
    with opened(worker) as client:
        try:
            client.sendall(REQUEST.replace(b"\r\n\r\n", b"\r\nConnection: close\r\n\r\n"))
        except OSError:
            return b""
        return everything(client)


@pytest.fixture
def begun(monkeypatch: pytest.MonkeyPatch) -> list[LimitedConnection]:
    """The connections, each once it waits for a request."""
    begun: list[LimitedConnection] = []
    begin = LimitedConnection.connection_made

    def connection_made(connection: LimitedConnection, transport: asyncio.Transport) -> None:
        begin(connection, transport)
        begun.append(connection)

    monkeypatch.setattr(LimitedConnection, "connection_made", connection_made)
    return begun


@pytest.mark.parametrize("sent", [b"", REQUEST[:-2]], ids=["nothing", "a part"])
def test_a_request_that_does_not_come_is_not_waited_for(
    worker: GatewayWorker, sent: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(connections, "REQUEST_TIMEOUT_S", 0.1)
    with opened(worker, sent) as client:
        assert everything(client) == b""


def test_nor_is_the_rest_of_a_second_request(
    worker: GatewayWorker, begun: list[LimitedConnection], monkeypatch: pytest.MonkeyPatch
) -> None:
    with opened(worker) as client:
        assert eventually(lambda: bool(begun))
        monkeypatch.setattr(connections, "REQUEST_TIMEOUT_S", 0.1)
        client.sendall(REQUEST + REQUEST[:-2])
        assert everything(client).count(b"200 OK") == 1


def test_a_body_that_breaks_off_gets_one_answer(
    worker: GatewayWorker, caplog: pytest.LogCaptureFixture
) -> None:
    head = b"POST /v1/queries HTTP/1.1\r\nHost: elsewhere\r\nTransfer-Encoding: chunked\r\n\r\n"
    for body in (b"no size\r\n", b'5\r\n{"textX\r\n'):
        with opened(worker, head + body) as client:
            assert everything(client).startswith(b"HTTP/1.1 4")
    assert [each.getMessage() for each in caplog.records if each.levelname == "ERROR"] == []


def test_what_was_asked_for_may_be_read_for_ever(
    worker: GatewayWorker, begun: list[LimitedConnection]
) -> None:
    request = f"GET /v1/live HTTP/1.1\r\nHost: localhost\r\n{WEBSOCKET}".encode()
    with opened(worker, request) as client:
        assert b"101 Switching Protocols" in client.recv(4096)
        (connection,) = begun
        assert connection._deadline is not None
        assert connection._deadline.cancelled()


def test_a_client_that_does_not_read_is_given_up(worker: GatewayWorker) -> None:
    held = worker._server.server_state.connections
    address = b"GET /static/swagger-ui/swagger-ui-bundle.js HTTP/1.1\r\nHost: localhost\r\n\r\n"
    with opened(worker, 20 * address):
        assert eventually(lambda: bool(held))
        assert eventually(lambda: not held)


@pytest.mark.parametrize(
    ("allowed", "limit"), [(1024, 256), (200, 200 - RESERVED_DESCRIPTORS), (16, 1), (-1, 256)]
)
def test_the_limit_stays_below_that_of_descriptors(
    allowed: int, limit: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert resource.RLIM_INFINITY == -1
    monkeypatch.setattr(resource, "getrlimit", lambda _which: (allowed, allowed))
    assert connection_limit() == limit


def test_connections_do_not_wait_to_send_nor_for_clients_that_are_gone() -> None:
    with listen("127.0.0.1", 0) as listener, socket.create_connection(listener.getsockname()):
        connection, _ = listener.accept()
        with connection:
            assert connection.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY)
            assert connection.getsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE)
            probes = (socket.TCP_KEEPIDLE, socket.TCP_KEEPINTVL)
            before_s = [connection.getsockopt(socket.IPPROTO_TCP, each) for each in probes]
            assert sum(before_s) <= connections.READER_TIMEOUT_S  # the first, and its time-out


def test_a_port_in_use_is_refused_with_what_to_do() -> None:
    with listen("127.0.0.1", 0) as first:
        port = first.getsockname()[1]
        with pytest.raises(StartError, match=r"another program uses it.*gateway\.port") as error:
            listen("127.0.0.1", port)
        assert error.value.temporary
