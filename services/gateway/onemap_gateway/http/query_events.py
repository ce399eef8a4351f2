"""Standing queries: the answers to some texts as server-sent events, whenever they change."""

from __future__ import annotations

import math
from collections.abc import AsyncIterator
from dataclasses import dataclass

import anyio
from fastapi.sse import ServerSentEvent

from onemap_gateway.http.context import GatewayContext
from onemap_gateway.http.events import RETRY_MS
from onemap_gateway.http.problems import HttpProblem
from onemap_gateway.http.queries import answers
from onemap_gateway.http.schemas import QueryRequest
from onemap_gateway.present.json_text import finite
from onemap_gateway.present.queries import QueryReply, differ

# What ends by itself: the stream stays open and says why there are no answers now.
PASSING = frozenset({"empty_map", "unavailable", "timeout", "busy", "encoder_mismatch"})

NEVER = -1  # no revision of a map


@dataclass(frozen=True, slots=True)
class QueryIntervals:
    """Seconds between two looks for a new revision, and between two questions to the map."""

    poll_s: float = 0.1
    query_s: float = 0.5


async def query_events(
    gateway: GatewayContext, request: QueryRequest, intervals: QueryIntervals | None = None
) -> AsyncIterator[ServerSentEvent]:
    """The answer to each text, and again whenever its regions or its verdict change.

    Asks only after a new revision of the map. While there is no answer, as of an empty map, the
    stream stays open and sends an event ``problem``; any other problem ends it.
    """
    intervals = intervals or QueryIntervals()
    sent: dict[str, QueryReply] = {}
    asked_revision: int | None = NEVER
    asked_s = -math.inf
    last_problem = ""
    retry: int | None = RETRY_MS
    while not gateway.cache.closing:
        now_s, revision = gateway.cache.now_s(), gateway.map_revision()
        if revision != asked_revision and now_s - asked_s >= intervals.query_s:
            asked_revision, asked_s = revision, now_s
            try:
                replies, last_problem = await answers(gateway, request), ""
            except HttpProblem as problem:
                replies, asked_revision = [], NEVER  # ask again, though nothing new is announced
                if problem.detail != last_problem:
                    last_problem = problem.detail
                    yield ServerSentEvent(event="problem", data=finite(problem.document))
                if problem.code not in PASSING:
                    return
            for reply in replies:
                if reply.text not in sent or differ(sent[reply.text], reply):
                    sent[reply.text] = reply
                    document = finite(reply.model_dump(mode="json"))
                    yield ServerSentEvent(event="answer", data=document, retry=retry)
                    retry = None
        await anyio.sleep(intervals.poll_s)
