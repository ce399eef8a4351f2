"""Event streams, and WebSockets on which only the gateway speaks after a first message at most."""
# Talks: notices that a client left.

from __future__ import annotations

from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager, suppress

import anyio
from fastapi import WebSocket, WebSocketDisconnect
from fastapi.sse import ServerSentEvent

from onemap_gateway.http.problems import HttpProblem
from onemap_gateway.http.security import BODY_TIMEOUT_S, LIVE_PROTOCOL
from onemap_gateway.present.formats import finite

GOING_AWAY = 1001  # the gateway stops
REFUSED = 1008  # what was asked for cannot be answered
RETRY_MS = 2000  # until a browser connects again
# Half of the images whose embedding the mapper keeps: with more than it keeps, each look at the
# map would have to be embedded anew, and single queries need some of them too.
MAX_IMAGE_STREAMS = 16


class ImageStreams:
    """Places for the standing queries with an image of one robot; for one event loop."""

    def __init__(self) -> None:
        self.open = 0

    @contextmanager
    def place(self, image: bytes | None) -> Iterator[None]:
        """Hold a place as long as the query is followed, if it has an image.

        Raises HttpProblem ``busy`` if all are taken.
        """
        taken = int(image is not None)
        if self.open + taken > MAX_IMAGE_STREAMS:
            raise HttpProblem(
                "busy",
                f"{self.open} standing queries with an image are open, and no more are possible: "
                "close one of them, or ask now and then with POST /v1/queries.",
                service="gateway",
            )
        self.open += taken
        try:
            yield
        finally:
            self.open -= taken


def problem_event(problem: HttpProblem) -> ServerSentEvent:
    """Why there are no events now."""
    return ServerSentEvent(event="problem", data=finite(problem.document))


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
