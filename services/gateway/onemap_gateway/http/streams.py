"""Event streams, and WebSockets on which only the gateway speaks."""
# Talks: notices that a client left.

from __future__ import annotations

from collections.abc import Awaitable, Callable
from contextlib import suppress

import anyio
from fastapi import WebSocket, WebSocketDisconnect
from fastapi.sse import ServerSentEvent

from onemap_gateway.http.problems import HttpProblem
from onemap_gateway.http.security import LIVE_PROTOCOL
from onemap_gateway.present.formats import finite

GOING_AWAY = 1001  # the gateway stops
RETRY_MS = 2000  # until a browser connects again


def problem_event(problem: HttpProblem) -> ServerSentEvent:
    """Why there are no events now."""
    return ServerSentEvent(event="problem", data=finite(problem.document))


async def accept(socket: WebSocket) -> None:
    """Accept the socket, with the protocol beside which a browser sends its token."""
    offered = LIVE_PROTOCOL in socket.scope.get("subprotocols", ())
    await socket.accept(LIVE_PROTOCOL if offered else None)


async def speak(socket: WebSocket, sending: Callable[[], Awaitable[None]]) -> None:
    """Run ``sending`` on an accepted socket until it ends or the client leaves.

    What the client sends is ignored. ``sending`` waits for a client that takes its messages
    slowly, so it sends what is newest when the client is ready, and nothing queues.
    """
    async with anyio.create_task_group() as tasks:
        tasks.start_soon(_until_gone, socket, tasks.cancel_scope)
        with suppress(WebSocketDisconnect):
            await sending()
        tasks.cancel_scope.cancel()


async def _until_gone(socket: WebSocket, scope: anyio.CancelScope) -> None:
    while (await socket.receive())["type"] != "websocket.disconnect":
        pass
    scope.cancel()
