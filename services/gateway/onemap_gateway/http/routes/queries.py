"""Where is it? Queries of the map, and standing ones, whose answers come again as they change."""
# Talks: asks for several texts at once, and waits between two answers.

from __future__ import annotations

import asyncio
import math
from collections.abc import AsyncIterator
from typing import Annotated

import anyio
from fastapi import APIRouter, Depends, Query
from fastapi.sse import EventSourceResponse, ServerSentEvent
from pydantic import ValidationError

from onemap.replies import QueryListReply, QueryResult
from onemap_gateway.http.context import GatewayContext, GatewayDep
from onemap_gateway.http.problems import (
    HttpProblem,
    content,
    from_validation_error,
    problem_responses,
)
from onemap_gateway.http.schemas import IMAGE_NAME, Described, QueryRequest, StandingRequest
from onemap_gateway.http.sentences import WordsReply, understand
from onemap_gateway.http.streams import RETRY_MS, problem_event
from onemap_gateway.present.formats import finite
from onemap_gateway.present.queries import IMAGE_SUBJECT, differ, query_result, with_scores
from onemap_shared import keys
from onemap_shared.messages import ImageSimilarityRequest, SearchView, SimilarityRequest
from onemap_shared.sentence import listed_sentences


async def answers(gateway: GatewayContext, request: QueryRequest) -> list[QueryResult]:
    """The answers to the texts, in their order, or to the image; HttpProblem if one fails."""
    understood = await understand(gateway, request.described)
    if any(each.stay_out for each in understood.sentences):
        raise HttpProblem(
            "invalid", "A query moves no robot: 'stay out of' is for searches, leave it out."
        )
    requests = request.requests(gateway.robot_xy_m(), understood.sentences)
    subjects = [repr(str(each)) for each in understood.sentences] or [IMAGE_SUBJECT]
    calls = [answer(gateway, *each) for each in zip(requests, subjects, strict=True)]
    answered: list[QueryResult] = []
    for reply in await asyncio.gather(*calls, return_exceptions=True):
        if isinstance(reply, BaseException):
            raise reply
        answered.append(reply)
    for index, (sentence, each) in enumerate(
        zip(understood.sentences, request.described, strict=True)
    ):
        update = {
            "text": each.text,
            "request": str(sentence),
            "understood": understood.in_words(sentence),
            "stands_for": understood.names(sentence),
        }
        answered[index] = answered[index].model_copy(update=update)
    return answered


async def answer(
    gateway: GatewayContext, request: SimilarityRequest | ImageSimilarityRequest, subject: str
) -> QueryResult:
    """The answer to one text or image; subject: of its sentences."""
    if isinstance(request, ImageSimilarityRequest):
        reply = await gateway.call(keys.MAP_IMAGE_SIMILARITY, request)
    else:
        reply = await gateway.call(keys.MAP_SIMILARITY, request)
    return query_result(reply, gateway.now_ns(), subject=subject)


async def image_view(gateway: GatewayContext, image: bytes) -> SearchView:
    """The map, with the score of each cell against what an image shows."""
    query = SimilarityRequest(IMAGE_NAME, max_regions=1, include_grid=True)
    reply = await gateway.call(keys.MAP_IMAGE_SIMILARITY, ImageSimilarityRequest(image, query))
    return with_scores(await gateway.view(), reply)


# What ends by itself: the stream stays open and says why there are no answers now.
PASSING = frozenset({"empty_map", "unavailable", "timeout", "busy", "encoder_mismatch"})
NEVER = -1  # no revision of a map


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
    """The answer to each text, and again whenever its regions or verdict change.

    Asks only after a new revision of the map. While there is no answer, as of an empty map, it
    goes on and gives a problem; any other problem ends it.
    """
    sent: dict[int, QueryResult] = {}
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
            for index, reply in enumerate(replies):
                if index not in sent or differ(sent[index], reply):
                    data, retry = finite(reply.model_dump(mode="json")), None if sent else RETRY_MS
                    yield ServerSentEvent(event="answer", data=data, retry=retry)
                    sent[index] = reply
        await anyio.sleep(gateway.paces.poll_s)


router = APIRouter(prefix="/v1", tags=["queries"])

EVENTS = content(
    "text/event-stream",
    "Server-sent events: `answer` with the answer to one text, first to each and then whenever "
    "its verdict or its regions change; `problem` while there is none.",
)


@router.post("/queries", summary="Where is it?", responses=problem_responses(409, 422, 503))
async def ask_where(request: QueryRequest, gateway: GatewayDep) -> QueryResult | QueryListReply:
    """Whether it is on the map, and regions that look like it, best first; no robot moves.

    An `image`, a crop of one thing, is asked for as a text is, but its scores only rank.
    With `texts` the reply is a list, `answers`, in their order. `verdict` says `found`, `not_here`,
    or `not_looked_yet`; `looked` how much of the reachable area was looked at, and where to look
    next.
    """
    replies = await answers(gateway, request)
    return replies[0] if request.texts is None else QueryListReply(answers=tuple(replies))


@router.get("/words", summary="How is it understood?", responses=problem_responses(422, 503))
async def read_words(
    text: Annotated[str, Query(examples=["the lamp next to the bed"])], gateway: GatewayDep
) -> WordsReply:
    """What a sentence means on this map, without asking where it is; 422 names wrong words."""
    try:
        described = [Described(text=each) for each in listed_sentences(text)]
    except ValidationError as error:
        raise from_validation_error(error) from None
    except ValueError as problem:
        raise HttpProblem("invalid", f"{problem}.", 422) from problem
    understood = await understand(gateway, described)
    return WordsReply(
        texts=tuple(each.text for each in described),
        understood=understood.in_words(),
        stands_for=understood.names(understood.sentences[-1]),
    )


async def standing_body(request: StandingRequest, gateway: GatewayDep) -> QueryRequest:
    """The request of a stream; what cannot be answered is refused before the stream begins."""
    await check_answerable(gateway, request)
    return request


@router.post(
    "/queries/events",
    summary="Tell me when it changes",
    response_class=EventSourceResponse,
    responses={200: EVENTS, **problem_responses(422, 503)},
)
async def follow_queries(
    request: Annotated[QueryRequest, Depends(standing_body)], gateway: GatewayDep
) -> AsyncIterator[ServerSentEvent]:
    """Standing queries, in words: the answers, again whenever they change, without end."""
    async for event in query_events(gateway, request):
        yield event
