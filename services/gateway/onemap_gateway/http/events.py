"""A search told as server-sent events."""

from __future__ import annotations

import json
from collections.abc import AsyncIterator
from dataclasses import dataclass

import anyio

from onemap_gateway.http.context import GatewayContext
from onemap_gateway.http.problems import HttpProblem
from onemap_gateway.present.views import search_report
from onemap_shared import keys
from onemap_shared.messages import SearchId, SearchStatus

MEDIA_TYPE = "text/event-stream"
KEEP_ALIVE = b": keep-alive\n\n"
RETRY = b"retry: 2000\n\n"  # milliseconds until a browser connects again


@dataclass(frozen=True, slots=True)
class EventIntervals:
    """Seconds between two looks at the snapshot, two questions to the planner, two comments."""

    poll_s: float = 0.1
    query_s: float = 2.0
    keep_alive_s: float = 10.0


async def search_events(
    gateway: GatewayContext,
    first: SearchStatus,
    *,
    count: int,
    intervals: EventIntervals | None = None,
) -> AsyncIterator[bytes]:
    """Every change of the search from ``first`` on; ends after its final state.

    ``count`` is the snapshot's ``search_count`` from before ``first`` was asked for. While the
    planner is away the stream stays open and says so in an event ``problem``; a planner that is
    back and does not know the search any more ends it with that problem.
    """
    intervals = intervals or EventIntervals()
    last, trouble = first, ""
    asked_s = spoken_s = gateway.cache.now_s()
    yield RETRY + _status(gateway, first)
    while last.active and not gateway.cache.closing:
        await anyio.sleep(intervals.poll_s)
        state, now_s = gateway.cache.state, gateway.cache.now_s()
        fresh = state.statuses_since(count)
        count = state.search_count
        if now_s - asked_s >= intervals.query_s:
            asked_s = now_s
            try:
                request = SearchId(first.search_id)
                fresh = (*fresh, await gateway.call(keys.SEARCH_GET, request))
                trouble = ""
            except HttpProblem as problem:
                if problem.detail != trouble:
                    trouble, spoken_s = problem.detail, now_s
                    yield _event("problem", problem.document)
                if problem.kind == "unknown_search":
                    return
        for status in fresh:
            if supersedes(status, last):
                last, spoken_s = status, now_s
                yield _status(gateway, status)
        if now_s - spoken_s >= intervals.keep_alive_s:
            spoken_s = now_s
            yield KEEP_ALIVE


def supersedes(status: SearchStatus, last: SearchStatus) -> bool:
    """Whether ``status`` is a later state of the same search, which had not ended.

    The end is later than anything, though a status that was made in the same instant may bear a
    later time.
    """
    same = status.search_id == last.search_id and last.active
    later = status.updated_ns >= last.updated_ns or not status.active
    return same and status != last and later


def _status(gateway: GatewayContext, status: SearchStatus) -> bytes:
    return _event("status", search_report(status, gateway.now_ns()).model_dump(mode="json"))


def _event(name: str, document: object) -> bytes:
    return f"event: {name}\ndata: {json.dumps(document)}\n\n".encode()
