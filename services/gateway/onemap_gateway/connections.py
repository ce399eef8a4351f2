"""The TCP socket, and a limit of connections beyond which only stops of the robot are served.

uvicorn's own limit refuses whatever comes, and it waits for ever for the first request and for the
rest of its headers; each connection holds a descriptor.
"""
# Talks: opens the socket, ends connections.

from __future__ import annotations

import asyncio
import errno
import resource
import socket
from collections.abc import Sequence
from typing import Any

from uvicorn.protocols.http.h11_impl import H11Protocol

from onemap_gateway.http.stops import StopsOnly
from onemap_shared.runner import StartError

MAX_CONNECTIONS = 256  # of all clients; a page has up to 7
REQUEST_TIMEOUT_S = 10.0  # from the connection, or the last response, to the end of the headers
READER_TIMEOUT_S = 20  # a client that takes nothing for so long, or is not there, is gone
PROBE_S = 5  # between two questions of the kernel to a silent client whether it is there
STOP_CONNECTIONS = 16  # further ones that wait for a request to stop the robot, and that serve one
RESERVED_DESCRIPTORS = 128 + 2 * STOP_CONNECTIONS  # for the bus, files and libraries
ANSWERABLE = ("IDLE", "SEND_RESPONSE")  # states of h11 in which a response may begin
BACKLOG = 128  # connections that the kernel holds, and that are accepted in one turn of the loop


class LimitedConnection(H11Protocol):
    """One connection of a client, of ``connection_limit`` of all clients.

    stops_only: serves it beyond the limit; None within it.
    """

    stops_only: StopsOnly | None = None

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self.began_s = self.loop.time()
        self._deadline: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Wait for a request, beyond the limit for one that stops the robot."""
        super().connection_made(transport)
        self._expect_request()
        limit = connection_limit()
        if len(self.connections) <= limit:
            return
        self.app = self.stops_only = StopsOnly(self.app, limit)
        self.ws_protocol_class = None  # a WebSocket is answered as any other request
        _make_room([each for each in self.connections if isinstance(each, LimitedConnection)])

    def _expect_request(self) -> None:
        """Close the connection unless the headers of a request arrive in time.

        What is still to be sent is sent before.
        """
        self._cancel()
        self._deadline = self.loop.call_later(REQUEST_TIMEOUT_S, self.transport.close)

    def _cancel(self) -> None:
        if self._deadline is not None:
            self._deadline.cancel()

    def handle_events(self) -> None:
        """Pass on what has arrived; the deadline ends with the headers."""
        before = self.scope
        super().handle_events()
        if self.scope is not before:
            self._cancel()

    def on_response_complete(self) -> None:
        """Wait for the next request, which may be here already."""
        self._expect_request()
        super().on_response_complete()

    def send_400_response(self, msg: str) -> None:
        """Say that the bytes are no HTTP request, if no response has begun; then nothing else is
        sent, by whom a broken body has reached either."""
        if self.cycle is not None:
            self.cycle.disconnected = True
            self.cycle.message_event.set()
        if self.conn.our_state.__name__ in ANSWERABLE:
            super().send_400_response(msg)
        else:
            self.transport.close()

    def connection_lost(self, exc: Exception | None) -> None:
        """End the deadline with the connection."""
        self._cancel()
        super().connection_lost(exc)


def _make_room(connections: Sequence[LimitedConnection]) -> None:
    """Give up the oldest beyond the limit, of those that wait and of those that stop the robot."""
    for stopping in (False, True):
        alike = [
            each
            for each in connections
            if each.stops_only is not None
            and each.stops_only.stopping is stopping
            and not each.transport.is_closing()
        ]
        for surplus in sorted(alike, key=lambda each: each.began_s)[:-STOP_CONNECTIONS]:
            surplus.transport.abort()


def connection_limit() -> int:
    """``MAX_CONNECTIONS``, or fewer where this process may not open so many descriptors."""
    allowed, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    if allowed == resource.RLIM_INFINITY:
        return MAX_CONNECTIONS
    return max(min(MAX_CONNECTIONS, allowed - RESERVED_DESCRIPTORS), 1)


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
    # Its connections inherit these. Without the first, which asyncio sets only on sockets that name
    # their protocol, a response on a kept connection waits 40 ms for an acknowledgement.
    listener.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    listener.setsockopt(socket.IPPROTO_TCP, socket.TCP_KEEPIDLE, PROBE_S)
    listener.setsockopt(socket.IPPROTO_TCP, socket.TCP_KEEPINTVL, PROBE_S)
    listener.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, READER_TIMEOUT_S * 1000)
    return listener
