"""WebSockets on which only the gateway speaks, after a first message at most."""
# Talks: notices that a client left.

from __future__ import annotations

from collections.abc import Awaitable, Callable
from contextlib import suppress

import anyio
from fastapi import WebSocket, WebSocketDisconnect

from onemap_gateway.http.problems import HttpProblem
from onemap_gateway.http.security import BODY_TIMEOUT_S, LIVE_PROTOCOL

GOING_AWAY = 1001  # the gateway stops
REFUSED = 1008  # what was asked for cannot be answered


async def accept(socket: WebSocket) -> None:
    """Accept the socket, with the protocol beside which a browser sends its token."""
    offered = LIVE_PROTOCOL in socket.scope.get("subprotocols", ())
    await socket.accept(LIVE_PROTOCOL if offered else None)


async def first_message(socket: WebSocket) -> str | bytes:
    """What the client of an accepted socket sends first.

    Raises HttpProblem ``slow_body`` if that takes too long, WebSocketDisconnect if it leaves.
    """
    try:
        with anyio.fail_after(BODY_TIMEOUT_S):
            message = await socket.receive()
    except TimeoutError:
        raise HttpProblem(
            "slow_body",
            f"No message came within {BODY_TIMEOUT_S:g} s: send the body of POST /v1/queries, or "
            "give 'text' in the address.",
        ) from None
    if message["type"] == "websocket.disconnect":
        raise WebSocketDisconnect(message.get("code", 1000))
    content: str | bytes = message.get("text") or message.get("bytes") or ""
    return content


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
