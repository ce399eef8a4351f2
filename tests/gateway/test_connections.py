"""Connections of clients that are slow, too many, or no HTTP; the port."""

from __future__ import annotations

import resource
import socket
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack

import pytest
from websockets.sync.client import connect

from onemap_gateway import connections
from onemap_gateway.config import GatewayConfig
from onemap_gateway.connections import RESERVED_DESCRIPTORS, connection_limit, listen
from onemap_gateway.service import GatewayWorker, build
from onemap_shared.runner import StartError
from tests.gateway.fakes import WAIT_S
from tests.memory_bus import MemoryRouter

LIMIT = 8
REQUEST = b"GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n"


@pytest.fixture
def worker(router: MemoryRouter, monkeypatch: pytest.MonkeyPatch) -> Iterator[GatewayWorker]:
    monkeypatch.setattr(connections, "REQUEST_TIMEOUT_S", 0.1)
    monkeypatch.setattr(connections, "READER_TIMEOUT_S", 0.1)
    monkeypatch.setattr(connections, "MAX_CONNECTIONS", LIMIT)
    worker = build(
        router.bus("gateway"),
        GatewayConfig(
            port=0,
        ),
    )
    yield worker
    worker.close()


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


def ended_after(client: socket.socket, sent: bytes) -> bool:
    """Send; whether the gateway has ended the connection."""
    try:
        client.sendall(sent)
        return client.recv(1) == b""
    except TimeoutError:
        return False
    except OSError:
        return True


@pytest.mark.parametrize(
    "sent",
    [b"", b"GET /healthz HTTP/1.1\r\nHost:", REQUEST + b"GET / HTTP", b"POST / HTTP/1.1\r\nA: b"],
)
def test_a_request_that_does_not_come_ends_the_connection(
    worker: GatewayWorker, sent: bytes
) -> None:
    with opened(worker, sent) as client:
        assert everything(client).count(b"200 OK") == sent.startswith(REQUEST)


def test_headers_that_come_byte_by_byte_end_the_connection(worker: GatewayWorker) -> None:
    with opened(worker, b"GET / HTTP/1.1\r\nA: ") as client:
        client.settimeout(0.01)
        assert eventually(lambda: ended_after(client, b"a"))


def test_more_connections_than_there_is_room_for_get_a_problem(
    router: MemoryRouter, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(connections, "MAX_CONNECTIONS", LIMIT)
    worker = build(router.bus("gateway"), GatewayConfig(port=0))
    with ExitStack() as stack:
        held = [stack.enter_context(opened(worker, REQUEST)) for _ in range(LIMIT)]
        assert all(b"200 OK" in client.recv(4096) for client in held)
        answer = everything(stack.enter_context(opened(worker, REQUEST)))
        assert answer.startswith(b"HTTP/1.1 503 ")
        assert b"room for another" in answer
        held[0].close()
        assert eventually(lambda: b"200 OK" in reply(worker))
    worker.close()


def reply(worker: GatewayWorker) -> bytes:
    with opened(worker) as client:
        try:
            client.sendall(REQUEST.replace(b"\r\n\r\n", b"\r\nConnection: close\r\n\r\n"))
        except OSError:
            return b""
        return everything(client)


def test_a_live_socket_outlasts_the_deadline(worker: GatewayWorker) -> None:
    with connect(f"ws://127.0.0.1:{worker.port}/v1/live") as live:
        for _ in range(3):
            assert live.recv(timeout=WAIT_S)


def test_a_client_that_does_not_read_is_given_up(worker: GatewayWorker) -> None:
    held = worker._server.server_state.connections
    address = b"GET /static/swagger-ui/swagger-ui-bundle.js HTTP/1.1\r\nHost: localhost\r\n\r\n"
    with opened(worker, 20 * address):
        assert eventually(lambda: bool(held))
        assert eventually(lambda: not held)


def test_bytes_that_are_no_request_get_a_problem(worker: GatewayWorker) -> None:
    with opened(worker, b"\x16\x03\x01 hello\r\n\r\n") as client:
        answer = everything(client)
    head, _, body = answer.partition(b"\r\n\r\n")
    assert head.startswith(b"HTTP/1.1 400 Bad Request")
    assert b"application/problem+json" in head
    assert f"content-length: {len(body)}".encode() in head


@pytest.mark.parametrize(
    ("allowed", "limit"), [(1024, 256), (200, 200 - RESERVED_DESCRIPTORS), (16, 1), (-1, 256)]
)
def test_the_limit_stays_below_that_of_descriptors(
    allowed: int, limit: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert resource.RLIM_INFINITY == -1
    monkeypatch.setattr(resource, "getrlimit", lambda _which: (allowed, allowed))
    assert connection_limit() == limit


def test_connections_do_not_wait_to_send() -> None:
    with listen("127.0.0.1", 0) as listener, socket.create_connection(listener.getsockname()):
        connection, _ = listener.accept()
        with connection:
            assert connection.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY)


def test_a_port_in_use_is_refused_with_what_to_do() -> None:
    with listen("127.0.0.1", 0) as first:
        port = first.getsockname()[1]
        with pytest.raises(StartError, match=r"another program uses it.*gateway\.port") as error:
            listen("127.0.0.1", port)
        assert error.value.temporary
