"""The state, several times a second."""
# Talks: waits between two states.

from __future__ import annotations

from functools import partial

import anyio
from fastapi import APIRouter, WebSocket

from onemap_gateway.http.context import GatewayContext, get_gateway
from onemap_gateway.http.sockets import GOING_AWAY, accept, speak
from onemap_gateway.present.json_text import json_text
from onemap_gateway.present.live import live_document

router = APIRouter(prefix="/v1")


@router.websocket("/live")
async def follow(socket: WebSocket) -> None:
    """Send the newest state until the client leaves; its messages are ignored.

    Each client has its own loop and gets the state of the moment in which it is ready for
    more: a slow one misses states and delays no other client.
    """
    await accept(socket)
    await speak(socket, partial(_send_states, socket, get_gateway(socket)))


async def _send_states(socket: WebSocket, gateway: GatewayContext) -> None:
    first = True
    while not gateway.cache.closing:
        document = live_document(
            gateway.cache.state,
            gateway.fault(),
            now_s=gateway.cache.now_s(),
            now_ns=gateway.now_ns(),
            with_trail=first,
        )
        await socket.send_text(json_text(document))
        first = False
        await anyio.sleep(1 / gateway.config.live_rate_hz)
    await socket.close(GOING_AWAY)
