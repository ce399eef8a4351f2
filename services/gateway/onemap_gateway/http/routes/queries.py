"""Where is it?"""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import suppress
from functools import partial
from typing import Annotated, Any

from fastapi import APIRouter, Depends, Query, WebSocket, WebSocketDisconnect
from fastapi.sse import EventSourceResponse, ServerSentEvent

from onemap.replies import QueryListReply, QueryResult
from onemap_gateway.http.context import GatewayContext, GatewayDep, get_gateway
from onemap_gateway.http.problems import BODY, HttpProblem, problem_responses
from onemap_gateway.http.queries import (
    answers,
    check_answerable,
    problem_event,
    query_events,
    standing_query,
    standing_query_of,
)
from onemap_gateway.http.schemas import QueryRequest, StandingRequest
from onemap_gateway.http.sockets import GOING_AWAY, REFUSED, accept, first_message, speak
from onemap_gateway.present.formats import json_text

router = APIRouter(prefix="/v1", tags=["queries"])

EVENTS: dict[str, Any] = {
    "description": "Server-sent events: `answer` with the answer to one text, first to each and "
    "then whenever its verdict or its regions change; `problem` while there is none.",
    "content": {"text/event-stream": {"schema": {"type": "string"}}},
}


@router.post(
    "/queries", summary="Where is it?", responses=problem_responses(*BODY, 401, 409, 422, 503)
)
async def ask_where(request: QueryRequest, gateway: GatewayDep) -> QueryResult | QueryListReply:
    """Whether it is on the map, and regions that look like it, best first; no robot moves.

    An `image`, a crop of one thing, is asked for as a text is, but its scores only rank.
    With `texts` the reply is a list, `answers`, in their order. `verdict` says `found`, `not_here`,
    or `not_looked_yet`; `looked` how much of the reachable area was looked at, and where to look
    next.
    """
    replies = await answers(gateway, request)
    return replies[0] if request.texts is None else QueryListReply(answers=tuple(replies))


async def standing_request(
    gateway: GatewayDep,
    text: Annotated[
        list[str], Query(min_length=1, max_length=20, description="May be repeated, up to 20.")
    ],
    negative: Annotated[
        list[str], Query(max_length=10, description="What it must not be; may be repeated.")
    ] = [],  # noqa: B006 (FastAPI copies it)
    area_m: Annotated[
        str, Query(description="x_min,y_min,x_max,y_max in metres.", examples=["0,-2,4,3"])
    ] = "",
    max_regions: Annotated[int, Query(ge=1, le=100)] = 5,
) -> QueryRequest:
    """The request of a stream; what cannot be answered is refused before the stream begins."""
    request = standing_query(text, negatives=negative, area_m=area_m, max_regions=max_regions)
    await check_answerable(gateway, request)
    return request


@router.get(
    "/queries/events",
    summary="Tell me when it changes",
    response_class=EventSourceResponse,
    responses={200: EVENTS, **problem_responses(422, 503)},
)
async def follow_queries(
    request: Annotated[QueryRequest, Depends(standing_request)], gateway: GatewayDep
) -> AsyncIterator[ServerSentEvent]:
    """Standing queries: the answers, again whenever they change; the stream has no end."""
    async for event in query_events(gateway, request):
        yield event


async def standing_body(
    request: StandingRequest, gateway: GatewayDep
) -> AsyncIterator[QueryRequest]:
    """The request of a stream in a body, refused as one in an address; with a place if it needs
    one, until the stream has ended."""
    with gateway.image_streams.place(request):
        await check_answerable(gateway, request)
        yield request


@router.post(
    "/queries/events",
    summary="Tell me when it changes, also for an image",
    response_class=EventSourceResponse,
    responses={200: EVENTS, **problem_responses(*BODY, 401, 422, 503)},
)
async def follow_query_body(
    request: Annotated[QueryRequest, Depends(standing_body)], gateway: GatewayDep
) -> AsyncIterator[ServerSentEvent]:
    """The same, asked with the body of `POST /v1/queries`, which may hold an `image`.

    At most 16 streams with an image are open at once.
    """
    async for event in query_events(gateway, request):
        yield event


@router.websocket("/queries/live")
async def follow_queries_live(socket: WebSocket) -> None:
    """The same over a WebSocket: objects with ``event``, ``answer`` or ``problem``, and ``data``.

    Without parameters in the address the client's first message is the body of a POST. A browser
    cannot read why a socket was refused, so the reason is the first and only message then.
    """
    gateway = get_gateway(socket)
    await accept(socket)
    with suppress(WebSocketDisconnect):
        try:
            request = await _socket_request(socket)
            with gateway.image_streams.place(request):
                await speak(socket, partial(_send_changes, socket, gateway, request))
        except HttpProblem as problem:
            await _refuse(socket, problem)


async def _socket_request(socket: WebSocket) -> QueryRequest:
    """What the address asks for, or the first message; HttpProblem if neither can be."""
    asked = socket.query_params
    if not asked:
        return standing_query_of(await first_message(socket))
    regions = asked.get("max_regions", "5")
    return standing_query(
        asked.getlist("text"),
        negatives=asked.getlist("negative"),
        area_m=asked.get("area_m", ""),
        max_regions=int(regions) if regions.isdecimal() else regions,
    )


async def _send_changes(socket: WebSocket, gateway: GatewayContext, request: QueryRequest) -> None:
    try:
        await check_answerable(gateway, request)
    except HttpProblem as problem:  # a task group would wrap it
        await _refuse(socket, problem)
        return
    async for event in query_events(gateway, request):
        await _send(socket, event)
    await socket.close(GOING_AWAY if gateway.cache.closing else REFUSED)


async def _refuse(socket: WebSocket, problem: HttpProblem) -> None:
    await _send(socket, problem_event(problem))
    await socket.close(REFUSED)


async def _send(socket: WebSocket, event: ServerSentEvent) -> None:
    await socket.send_text(json_text({"event": event.event, "data": event.data}))
