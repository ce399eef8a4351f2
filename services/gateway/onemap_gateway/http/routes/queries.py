"""Where is it? Queries of the map."""
# Talks: asks for several texts at once.

from __future__ import annotations

import asyncio
from typing import Annotated

from fastapi import APIRouter, Query
from pydantic import ValidationError

from onemap.replies import QueryListReply, QueryResult
from onemap_gateway.http.context import GatewayContext, GatewayDep
from onemap_gateway.http.problems import (
    HttpProblem,
    from_validation_error,
    problem_responses,
)
from onemap_gateway.http.schemas import IMAGE_NAME, Described, QueryRequest
from onemap_gateway.http.sentences import WordsReply, understand
from onemap_gateway.present.queries import IMAGE_SUBJECT, query_result, with_scores
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


router = APIRouter(prefix="/v1", tags=["queries"])


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
