"""The TCP socket, and HTTP connections with limits.

How many, how long a request may take to come, how slow a reader. uvicorn waits for ever for the
first byte of a request, for the rest of its headers, and for a client that does not read; each
such connection holds a descriptor. What stops the robot is served beyond the number, too.
"""
# Talks: opens the socket, ends connections.

from __future__ import annotations

import asyncio
import errno
import resource
import socket
from http import HTTPStatus
from typing import Any, TypeGuard

from uvicorn.protocols.http.h11_impl import H11Protocol

from onemap_gateway.http.problems import HttpProblem, problem_response
from onemap_gateway.http.stops import StopsOnly
from onemap_shared.runner import StartError

REQUEST_TIMEOUT_S = 10.0  # from the connection, or the last response, to the end of the headers
MAX_CONNECTIONS = 256  # of all clients; a page has up to 7
READER_TIMEOUT_S = 20.0  # a client that takes nothing for so long is gone
STOP_CONNECTIONS = 16  # further ones, which only requests that stop the robot may use
RESERVED_DESCRIPTORS = 128 + STOP_CONNECTIONS  # for the bus, files and libraries


class LimitedConnection(H11Protocol):
    """One connection of a client, of ``connection_limit`` of all clients."""

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self._limit = connection_limit()
        self._deadline: asyncio.TimerHandle | None = None
        self._stalled: asyncio.TimerHandle | None = None
        self._stops_only: StopsOnly | None = None  # beyond the limit
        self._began_s = self.loop.time()

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Wait for a request, beyond the limit for one that stops the robot."""
        super().connection_made(transport)
        if len(self.connections) > self._limit:
            self._stops_only = StopsOnly(self.app, self._no_room())
            self.app = self._stops_only
            idle = [each for each in self.connections if _may_be_refused(each)]
            if len(idle) > STOP_CONNECTIONS:
                min(idle, key=lambda each: each._began_s).refuse(self._no_room())
        self._watch()

    def _no_room(self) -> HttpProblem:
        return HttpProblem(
            "busy",
            f"The gateway serves {self._limit} connections at once and has no room for another, "
            "except to stop the robot: try again.",
            service="gateway",
        )

    def handle_events(self) -> None:
        """Pass on what has arrived; the deadline ends with the headers."""
        super().handle_events()
        self._watch()

    def on_response_complete(self) -> None:
        """Wait for the next request."""
        super().on_response_complete()
        self._watch()

    def handle_websocket_upgrade(self, event: Any) -> None:
        """Leave the connection to the WebSocket, which has its own pings."""
        if self._stops_only is not None:
            self.refuse(self._no_room())
            return
        self._cancel()
        super().handle_websocket_upgrade(event)

    def pause_writing(self) -> None:
        """The client reads slower than the gateway writes."""
        super().pause_writing()
        self._expect_reading()

    def resume_writing(self) -> None:
        """The client reads again."""
        super().resume_writing()
        if self._stalled is not None:
            self._stalled.cancel()

    def connection_lost(self, exc: Exception | None) -> None:
        """End the timers with the connection."""
        self._cancel()
        super().connection_lost(exc)

    def send_400_response(self, msg: str) -> None:
        """Say that the bytes are no HTTP request."""
        self.refuse(HttpProblem("http", f"{msg} Send HTTP/1.1 with headers below 64 kB."))

    def _expect_reading(self) -> None:
        """Give the connection up unless the client takes something within the limit."""
        unsent = self.transport.get_write_buffer_size()

        def look() -> None:
            if self.transport.get_write_buffer_size() < unsent:
                self._expect_reading()
            else:
                self.transport.abort()

        self._stalled = self.loop.call_later(READER_TIMEOUT_S, look)

    def refuse(self, problem: HttpProblem) -> None:
        """End the connection with a response."""
        self.transport.write(raw_response(problem))
        self.transport.close()

    def _watch(self) -> None:
        """Run the deadline exactly while no request is being answered."""
        if self.cycle is not None and not self.cycle.response_complete:
            self._cancel()
        elif self._deadline is None and self.transport.get_protocol() is self:
            # abort: close() would wait for a client that does not read
            self._deadline = self.loop.call_later(REQUEST_TIMEOUT_S, self.transport.abort)

    def _cancel(self) -> None:
        for timer in (self._deadline, self._stalled):
            if timer is not None:
                timer.cancel()
        self._deadline = self._stalled = None


def _may_be_refused(connection: object) -> TypeGuard[LimitedConnection]:
    """Whether a connection is beyond the limit, without a request that stops the robot."""
    if not isinstance(connection, LimitedConnection) or connection._stops_only is None:
        return False
    return not connection._stops_only.stopping


def raw_response(problem: HttpProblem) -> bytes:
    """The response to what is no request, or before there is one."""
    response = problem_response(problem)
    headers = [*response.raw_headers, (b"connection", b"close")]
    lines = [f"HTTP/1.1 {problem.status} {HTTPStatus(problem.status).phrase}".encode()]
    lines += [name + b": " + value for name, value in headers]
    return b"\r\n".join([*lines, b"", bytes(response.body)])


def connection_limit() -> int:
    """``MAX_CONNECTIONS``, or fewer where this process may not open so many descriptors."""
    allowed, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    if allowed == resource.RLIM_INFINITY:
        return MAX_CONNECTIONS
    return max(min(MAX_CONNECTIONS, allowed - RESERVED_DESCRIPTORS), 1)


BACKLOG = 128


def listen(host: str, port: int) -> socket.socket:
    """A listening socket; raises ``StartError`` with the reason and what to change."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        listener = socket.create_server((host, port), family=family, backlog=BACKLOG)
    except OSError as problem:
        reason = {
            errno.EADDRINUSE: "another program uses it; stop that, or choose another port with "
            f"'gateway.port' (ONEMAP__GATEWAY__PORT={port + 1})",
            errno.EACCES: "ports below 1024 need privileges; choose another with 'gateway.port'",
            errno.EADDRNOTAVAIL: "this machine has no such address; correct 'gateway.host'",
        }.get(problem.errno or 0, f"{problem.strerror or problem}; correct 'gateway.host'")
        raise StartError(
            f"cannot listen on {host} port {port}: {reason}",
            temporary=problem.errno == errno.EADDRINUSE,
        ) from problem
    # Its connections inherit this; asyncio sets it only on sockets that name their protocol.
    # Without it a response on a kept connection waits 40 ms for the client's acknowledgement.
    listener.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    return listener
