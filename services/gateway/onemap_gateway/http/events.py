"""The changes of a search as server-sent events."""
# Talks: waits between two events.

from __future__ import annotations

from collections.abc import AsyncIterator
from dataclasses import dataclass

import anyio
from fastapi.sse import ServerSentEvent

from onemap_gateway.http.context import GatewayContext
from onemap_gateway.http.problems import HttpProblem
from onemap_gateway.present.json_text import finite
from onemap_gateway.present.views import search_report
from onemap_shared import keys
from onemap_shared.messages import SearchId, SearchStatus

RETRY_MS = 2000  # until a browser connects again


@dataclass(frozen=True, slots=True)
class EventIntervals:
    """Seconds between two reads of the state cache, and between two calls of the planner."""

    poll_s: float = 0.1
    query_s: float = 2.0


async def search_events(
    gateway: GatewayContext,
    first: SearchStatus,
    *,
    count: int,
    intervals: EventIntervals | None = None,
) -> AsyncIterator[ServerSentEvent]:
    """Every change of the search from ``first`` on; ends after its final state.

    ``count`` is the snapshot's ``search_count`` from before ``first`` was requested. While the
    planner is away the stream stays open and sends an event ``problem``; a restarted planner that
    does not have the search any more ends the stream with that problem.
    """
    intervals = intervals or EventIntervals()
    last, last_problem = first, ""
    queried_s = gateway.cache.now_s()
    yield _status_event(gateway, first, retry=RETRY_MS)
    while last.active and not gateway.cache.closing:
        await anyio.sleep(intervals.poll_s)
        state, now_s = gateway.cache.state, gateway.cache.now_s()
        fresh = state.statuses_since(count)
        count = state.search_count
        if now_s - queried_s >= intervals.query_s:
            queried_s = now_s
            try:
                request = SearchId(first.search_id)
                fresh = (*fresh, await gateway.call(keys.SEARCH_GET, request))
                last_problem = ""
            except HttpProblem as problem:
                if problem.detail != last_problem:
                    last_problem = problem.detail
                    yield ServerSentEvent(event="problem", data=finite(problem.document))
                if problem.code == "unknown_search":
                    return
        for status in fresh:
            if supersedes(status, last):
                last = status
                yield _status_event(gateway, status)


def supersedes(status: SearchStatus, last: SearchStatus) -> bool:
    """Whether ``status`` is a later state of the same search, which had not ended.

    The final state counts as later even with an earlier time: one that was made in the same
    instant may carry it.
    """
    same = status.search_id == last.search_id and last.active
    later = status.updated_ns >= last.updated_ns or not status.active
    return same and status != last and later


def _status_event(
    gateway: GatewayContext, status: SearchStatus, retry: int | None = None
) -> ServerSentEvent:
    document = finite(search_report(status, gateway.now_ns()).model_dump(mode="json"))
    return ServerSentEvent(event="status", data=document, retry=retry)
