"""WebSockets on which only the gateway speaks."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from contextlib import suppress

import anyio
from fastapi import WebSocket, WebSocketDisconnect

from onemap_gateway.http.security import LIVE_PROTOCOL

GOING_AWAY = 1001  # the gateway stops
REFUSED = 1008  # what was asked for cannot be answered


async def speak(socket: WebSocket, sending: Callable[[], Awaitable[None]]) -> None:
    """Accept the socket and run ``sending`` until it ends or the client leaves.

    What the client sends is ignored. ``sending`` waits for a client that takes its messages
    slowly, so it sends what is newest when the client is ready, and nothing queues.
    """
    offered = LIVE_PROTOCOL in socket.scope.get("subprotocols", ())
    await socket.accept(LIVE_PROTOCOL if offered else None)
    async with anyio.create_task_group() as tasks:
        tasks.start_soon(_until_gone, socket, tasks.cancel_scope)
        with suppress(WebSocketDisconnect):
            await sending()
        tasks.cancel_scope.cancel()


async def _until_gone(socket: WebSocket, scope: anyio.CancelScope) -> None:
    while (await socket.receive())["type"] != "websocket.disconnect":
        pass
    scope.cancel()
