"""Where is it?"""

from __future__ import annotations

from collections.abc import AsyncIterator
from typing import Annotated

from fastapi import APIRouter, Depends, Query
from fastapi.sse import EventSourceResponse, ServerSentEvent
from pydantic import ValidationError

from onemap_gateway.http.context import GatewayDep
from onemap_gateway.http.problem_docs import BODY, problem_responses
from onemap_gateway.http.problems import HttpProblem, from_validation_errors
from onemap_gateway.http.queries import answers
from onemap_gateway.http.query_events import PASSING, query_events
from onemap_gateway.http.schemas import QueryRequest
from onemap_gateway.present.queries import QueryListReply, QueryReply

router = APIRouter(prefix="/v1", tags=["queries"])


@router.post(
    "/queries", summary="Where is it?", responses=problem_responses(*BODY, 401, 409, 422, 503)
)
async def ask_where(request: QueryRequest, gateway: GatewayDep) -> QueryReply | QueryListReply:
    """Whether it is on the map, and regions that look like it, best first; no robot moves.

    With `texts` the reply is a list, `answers`, in their order. `verdict` says `found`, `not_here`,
    or `not_looked_yet`; `looked` how much of the reachable area was looked at, and where to look
    next.
    """
    replies = await answers(gateway, request)
    return replies[0] if request.texts is None else QueryListReply(answers=replies)


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
    body = {"texts": text, "negatives": negative, "max_regions": max_regions}
    try:
        if area_m:
            body["area_m"] = tuple(float(part) for part in area_m.split(","))
        request = QueryRequest.model_validate(body)
    except ValidationError as error:
        wrong = [{**each, "loc": ("query", *each["loc"])} for each in error.errors()]
        raise from_validation_errors(wrong) from None
    except ValueError:
        raise HttpProblem(
            "invalid", "'area_m' is no x_min,y_min,x_max,y_max in metres, as in 0,-2,4,3."
        ) from None
    try:
        await answers(gateway, request)
    except HttpProblem as problem:
        if problem.code not in PASSING:
            raise
    return request


@router.get(
    "/queries/events",
    summary="Tell me when it changes",
    response_class=EventSourceResponse,
    responses={
        200: {
            "description": "Server-sent events: `answer` with the answer to one text, first to "
            "each and then whenever its verdict or its regions change; `problem` while there is "
            "none.",
            "content": {"text/event-stream": {"schema": {"type": "string"}}},
        },
        **problem_responses(422, 503),
    },
)
async def follow_queries(
    request: Annotated[QueryRequest, Depends(standing_request)], gateway: GatewayDep
) -> AsyncIterator[ServerSentEvent]:
    """Standing queries: the answers, again whenever they change; the stream has no end."""
    async for event in query_events(gateway, request):
        yield event
