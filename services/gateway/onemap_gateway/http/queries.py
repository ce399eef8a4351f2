"""Queries of the map, and standing ones: answers that come again whenever they change."""
# Talks: asks for several texts at once, and waits between two answers.

from __future__ import annotations

import asyncio
import math
from collections.abc import AsyncIterator, Sequence
from typing import Any

import anyio
from fastapi.sse import ServerSentEvent
from pydantic import ValidationError

from onemap.replies import QueryResult
from onemap_gateway.http.context import GatewayContext
from onemap_gateway.http.problems import HttpProblem, from_validation_errors
from onemap_gateway.http.schemas import IMAGE_NAME, QueryRequest, StandingRequest
from onemap_gateway.present.formats import finite
from onemap_gateway.present.queries import IMAGE_SUBJECT, differ, query_result, with_scores
from onemap_shared import keys
from onemap_shared.messages import ImageSimilarityRequest, SearchView, SimilarityRequest


async def answers(gateway: GatewayContext, request: QueryRequest) -> list[QueryResult]:
    """The answers to the texts, in their order, or to the image; HttpProblem if one fails."""
    asked = [answer(gateway, each) for each in request.requests(robot_xy_m(gateway))]
    found = []
    for reply in await asyncio.gather(*asked, return_exceptions=True):
        if isinstance(reply, BaseException):
            raise reply
        found.append(reply)
    return found


async def answer(
    gateway: GatewayContext, request: SimilarityRequest | ImageSimilarityRequest
) -> QueryResult:
    """The answer to one text or image."""
    if isinstance(request, ImageSimilarityRequest):
        reply = await gateway.call(keys.MAP_IMAGE_SIMILARITY, request)
        return query_result(reply, gateway.now_ns(), subject=IMAGE_SUBJECT)
    reply = await gateway.call(keys.MAP_SIMILARITY, request)
    return query_result(reply, gateway.now_ns())


async def image_view(gateway: GatewayContext, image: bytes) -> SearchView:
    """The map, with the score of each cell against what an image shows."""
    query = SimilarityRequest(IMAGE_NAME, max_regions=1, include_grid=True)
    reply = await gateway.call(keys.MAP_IMAGE_SIMILARITY, ImageSimilarityRequest(image, query))
    return with_scores(await gateway.view(), reply)


def robot_xy_m(gateway: GatewayContext) -> tuple[float, ...]:
    """x, y of the robot in metres, empty if nothing is known of it."""
    odometry = gateway.cache.state.odometry
    if odometry is None:
        return ()
    x_m, y_m = odometry.message.T_map_body[:2, 3]
    return (float(x_m), float(y_m))


# What ends by itself: the stream stays open and says why there are no answers now.
PASSING = frozenset({"empty_map", "unavailable", "timeout", "busy", "encoder_mismatch"})
RETRY_MS = 2000  # until a browser connects again

NEVER = -1  # no revision of a map


def standing_query(
    texts: Sequence[str], *, negatives: Sequence[str], area_m: str, max_regions: int | str
) -> QueryRequest:
    """The request that an address describes; HttpProblem if it is none.

    area_m: x_min,y_min,x_max,y_max in metres; empty for all of the map.
    """
    body: dict[str, Any] = {
        "texts": list(texts), "negatives": list(negatives), "max_regions": max_regions,
    }  # fmt: skip
    try:
        if area_m:
            body["area_m"] = tuple(float(part) for part in area_m.split(","))
        return StandingRequest.model_validate(body)
    except ValidationError as error:
        raise _refused(error, "query") from None
    except ValueError:
        raise HttpProblem(
            "invalid", "'area_m' is no x_min,y_min,x_max,y_max in metres, as in 0,-2,4,3."
        ) from None


def standing_query_of(message: str | bytes) -> QueryRequest:
    """The request that a message holds, JSON as the body of a POST; HttpProblem if it is none."""
    try:
        return StandingRequest.model_validate_json(message)
    except ValidationError as error:
        raise _refused(error, "body") from None


def _refused(error: ValidationError, part: str) -> HttpProblem:
    wrong = [{**each, "loc": (part, *each["loc"])} for each in error.errors()]
    return from_validation_errors(wrong)


async def check_answerable(gateway: GatewayContext, request: QueryRequest) -> None:
    """HttpProblem if the request will never be answered, as one with an unknown word."""
    try:
        await answers(gateway, request)
    except HttpProblem as problem:
        if problem.code not in PASSING:
            raise


async def query_events(
    gateway: GatewayContext, request: QueryRequest
) -> AsyncIterator[ServerSentEvent]:
    """The answer to each text, or to the image, and again whenever regions or verdict change.

    Asks only after a new revision of the map. While there is no answer, as of an empty map, it
    goes on and gives a problem; any other problem ends it.
    """
    sent: dict[str, QueryResult] = {}
    asked_revision: int | None = NEVER
    asked_s = -math.inf
    last_problem = ""
    while not gateway.cache.closing:
        now_s, revision = gateway.cache.now_s(), gateway.map_revision()
        if revision != asked_revision and now_s - asked_s >= gateway.paces.ask_map_s:
            asked_revision, asked_s = revision, now_s
            try:
                replies, last_problem = await answers(gateway, request), ""
            except HttpProblem as problem:
                replies, asked_revision = [], NEVER  # ask again, though nothing new is announced
                if problem.detail != last_problem:
                    last_problem = problem.detail
                    yield problem_event(problem)
                if problem.code not in PASSING:
                    return
            for reply in replies:
                if reply.text not in sent or differ(sent[reply.text], reply):
                    data = finite(reply.model_dump(mode="json"))
                    yield ServerSentEvent(
                        event="answer", data=data, retry=None if sent else RETRY_MS
                    )
                    sent[reply.text] = reply
        await anyio.sleep(gateway.paces.poll_s)


def problem_event(problem: HttpProblem) -> ServerSentEvent:
    """Why there are no events now."""
    return ServerSentEvent(event="problem", data=finite(problem.document))
