"""Go and find, drive to a place, look at a place; the changes of a search as events."""
# Talks: waits between two events.

from __future__ import annotations

import re
from collections.abc import AsyncIterator, Awaitable, Sequence
from dataclasses import replace
from typing import Annotated

import anyio
from fastapi import APIRouter, Depends, Path, Response
from fastapi.sse import EventSourceResponse, ServerSentEvent

from onemap.search_replies import SearchListReply, SearchReplay, SearchSnapshot
from onemap_gateway.http.context import GatewayContext, GatewayDep
from onemap_gateway.http.problems import HttpProblem, content, problem_responses
from onemap_gateway.http.schemas import SearchStart
from onemap_gateway.http.sentences import understand
from onemap_gateway.http.streams import RETRY_MS, problem_event
from onemap_gateway.present.formats import finite
from onemap_gateway.present.replies import find_of, search_replay, search_snapshot
from onemap_shared import keys
from onemap_shared.messages import (
    KeptObject,
    SearchId,
    SearchListRequest,
    SearchState,
    SearchStatus,
)


async def search_events(
    gateway: GatewayContext, first: SearchStatus, *, count: int
) -> AsyncIterator[ServerSentEvent]:
    """Every change of the search from ``first`` on; ends after its final state.

    ``count`` is the snapshot's ``search_count`` from before ``first`` was requested. While the
    planner is away the stream stays open and sends an event ``problem``; a restarted planner that
    does not have the search any more ends the stream with that problem.
    """
    last, last_problem = first, ""
    queried_s = gateway.cache.now_s()
    finds = await gateway.finds(first)
    yield _status_event(first, finds, retry=RETRY_MS)
    while last.active and not gateway.cache.closing:
        await anyio.sleep(gateway.paces.poll_s)
        state, now_s = gateway.cache.state, gateway.cache.now_s()
        fresh = state.statuses_since(count)
        count = state.search_count
        if now_s - queried_s >= gateway.paces.ask_planner_s:
            queried_s = now_s
            try:
                request = SearchId(first.search_id)
                fresh = (*fresh, await gateway.call(keys.SEARCH_GET, request))
                last_problem = ""
            except HttpProblem as problem:
                if problem.detail != last_problem:
                    last_problem = problem.detail
                    yield problem_event(problem)
                if problem.code == "unknown_search":
                    return
        for status in fresh:
            if supersedes(status, last):
                if len(status.results) > len(last.results):
                    finds = await _finds_of(gateway, status)
                last = status
                yield _status_event(status, finds)


KEPT_S = 1.0  # from the end of an object until the mapper keeps it, at most


async def _finds_of(gateway: GatewayContext, status: SearchStatus) -> tuple[KeptObject, ...]:
    """What the mapper keeps, once the newest find of the search is among it."""
    until_s, newest = gateway.cache.now_s() + KEPT_S, status.results[-1]
    while True:
        finds = await gateway.finds(status)
        found = newest.outcome is SearchState.FOUND and find_of(newest, finds) is None
        if not found or gateway.cache.now_s() >= until_s:
            return finds
        await anyio.sleep(gateway.paces.poll_s)


def supersedes(status: SearchStatus, last: SearchStatus) -> bool:
    """Whether ``status`` is a later state of the same search, which had not ended.

    Later is what has taken longer, by the planner's monotonic clock, whatever its wall clock says.
    The final state always is: one that was made in the same instant may carry it.
    """
    same = status.search_id == last.search_id and last.active
    later = status.elapsed_s >= last.elapsed_s or not status.active
    return same and status != last and later


def _status_event(
    status: SearchStatus, finds: Sequence[KeptObject] = (), retry: int | None = None
) -> ServerSentEvent:
    document = finite(search_snapshot(status, finds).model_dump(mode="json"))
    return ServerSentEvent(event="status", data=document, retry=retry)


router = APIRouter(prefix="/v1/searches", tags=["searches"])
LOCATION = {"headers": {"Location": {"schema": {"type": "string"}}}}

ID_PATTERN = re.compile(r"[A-Za-z0-9_-]{1,64}")


async def planner_search_id(
    search_id: Annotated[str, Path(description="The search's id, or `current`: the newest.")],
) -> str:
    """The id for the planner, empty for the newest search; a malformed id is not found."""
    if not ID_PATTERN.fullmatch(search_id):
        raise HttpProblem("unknown_search", f"No search has the id {search_id[:70]!r}.")
    return "" if search_id == "current" else search_id


Id = Annotated[str, Depends(planner_search_id)]


async def start(gateway: GatewayContext, request: SearchStart) -> SearchSnapshot:
    """The search that began, with how it was understood on this map."""
    began_s = gateway.cache.now_s()
    understood = await understand(gateway, request.described)
    patience_s = _patience_s(gateway, began_s)
    age_s = gateway.cache.now_s() - began_s
    for_planner = request.request(patience_s, understood.sentences, age_s)
    search = await gateway.search(keys.SEARCH_START, for_planner, patience_s)
    return search.model_copy(update={"understood": understood.in_words()})


def _patience_s(gateway: GatewayContext, began_s: float) -> float:
    """Seconds that the planner has left for a request of ``began_s``: a client that has given up
    must not see the robot set out. HttpProblem if nothing is left."""
    left_s = gateway.paces.start_s - (gateway.cache.now_s() - began_s)
    if left_s <= 0:
        why = "The map took too long to answer, and nothing was started: try again."
        raise HttpProblem("busy", why, service="mapper")
    return min(left_s, gateway.paces.call_timeout_s)


@router.post(
    "",
    status_code=201,
    summary="Go and find, or go there",
    responses={201: LOCATION, **problem_responses(409, 422, 503)},
)
async def start_search(
    request: SearchStart, gateway: GatewayDep, response: Response
) -> SearchSnapshot:
    """Explore until the objects are found, one after the other, and walk up to each.

    With `after` as `return` the robot then drives back to where it set out, in the state
    `returning`; whoever cancels cancels that too, and limits count for it.

    With `go_to_m`, or `go_to` and its name, drive to a place instead, on known floor, exploring
    unknown floor on the way;
    with `look_at_m` to where it can be seen, and face it. Such a search ends as `arrived`, or as
    `failed` with the reason; its only result says in `end_xy_m` where the robot stands.

    One search at a time: a second one gets 409 with the `search_id` of the first.
    """
    return await _started(gateway, start(gateway, request), response)


@router.post(
    "/{search_id}/again",
    status_code=201,
    summary="Go on with what is left",
    responses={
        200: {
            "model": SearchSnapshot,
            "description": "It was continued before, as this search.",
        },
        201: LOCATION,
        **problem_responses(404, 409, 422, 503),
    },
)
async def search_again(search_id: Id, gateway: GatewayDep, response: Response) -> SearchSnapshot:
    """Search for what a search has not found, as it was asked for, or drive to its place again.

    Its limits count anew. A search is `interrupted` when its planner or the robot's driver has
    ended: no robot goes on by itself, but with this one request. It may be repeated: then the
    reply is the search that it began, though that has ended, with its own id to go on with. With
    `current` it may be repeated only while that search is active.
    """
    began_s = gateway.cache.now_s()
    before = await gateway.call(keys.SEARCH_GET, SearchId(search_id))
    if search_id:
        begun = await _continuation(gateway, search_id)
    else:
        begun = before if before.active and before.continues else None
    if begun is not None:
        response.status_code = 200
        return search_snapshot(begun)
    if before.objects and not before.left:
        raise HttpProblem("nothing_left", "All objects of this search were found.")
    patience_s = _patience_s(gateway, began_s)
    request = replace(before.again(patience_s), age_s=gateway.cache.now_s() - began_s)
    starting = gateway.search(keys.SEARCH_START, request, patience_s)
    return await _started(gateway, starting, response, request.continues)


async def _continuation(gateway: GatewayContext, search_id: str) -> SearchStatus | None:
    """The search that went on with this one, in whatever state; None if none did."""
    listed = await gateway.call(keys.SEARCH_LIST, SearchListRequest())
    return next((each for each in listed.searches if each.continues == search_id), None)


async def _started(
    gateway: GatewayContext,
    starting: Awaitable[SearchSnapshot],
    response: Response,
    continues: str = "",
) -> SearchSnapshot:
    """The search that began, with its address; a refusal names the one that runs.

    continues: the one that runs is the reply if it is the continuation of this search.
    """
    try:
        search = await starting
        response.headers["Location"] = f"/v1/searches/{search.id}"
        return search
    except HttpProblem as problem:
        if problem.code != "conflict":
            raise
        refusal = problem
    first = await gateway.call(keys.SEARCH_GET, SearchId())
    if not first.active:  # it ended in between
        raise refusal
    if continues and first.continues == continues:
        response.status_code = 200
        return search_snapshot(first)
    raise HttpProblem(
        "conflict",
        f"The robot is busy with a search for {first.subject}: wait until it is done, or cancel "
        f"with DELETE /v1/searches/{first.search_id}.",
        search_id=first.search_id,
    )


@router.get("", summary="What was searched?", responses=problem_responses(503))
async def list_searches(gateway: GatewayDep) -> SearchListReply:
    """The newest 50 searches and the present one, newest first, also those of before a restart of
    the planner."""
    listed = await gateway.call(keys.SEARCH_LIST, SearchListRequest())
    finds = await gateway.finds(*listed.searches)
    searches = tuple(search_snapshot(each, finds) for each in listed.searches)
    return SearchListReply(searches=searches, left_out=listed.left_out)


@router.get("/{search_id}", summary="How is it going?", responses=problem_responses(404, 422, 503))
async def get_search(search_id: Id, gateway: GatewayDep) -> SearchSnapshot:
    """State, reason and results of a search."""
    return await gateway.with_places(await gateway.call(keys.SEARCH_GET, SearchId(search_id)))


@router.delete("/{search_id}", summary="Stop", responses=problem_responses(404, 422, 503))
async def cancel_search(search_id: Id, gateway: GatewayDep) -> SearchSnapshot:
    """Stop the robot and end the search; what was found so far stays in the results."""
    return await gateway.search(keys.SEARCH_CANCEL, SearchId(search_id))


@router.get(
    "/{search_id}/replay", summary="How did it go?", responses=problem_responses(404, 422, 503)
)
async def replay_search(search_id: Id, gateway: GatewayDep) -> SearchReplay:
    """The recorded steps of a search with their reasons and goals, and where the robot drove.

    Places are in the frame that the map had then. A long search is thinned: see `steps`, `path_m`.
    """
    record = await gateway.call(keys.SEARCH_RECORD, SearchId(search_id))
    return search_replay(record)


async def events_from_now(search_id: Id, gateway: GatewayDep) -> AsyncIterator[ServerSentEvent]:
    """A dependency, so that a search that is not there is a 404 instead of an empty stream."""
    count = gateway.cache.state.search_count
    first = await gateway.call(keys.SEARCH_GET, SearchId(search_id))
    return search_events(gateway, first, count=count)


@router.get(
    "/{search_id}/events",
    summary="Tell me as it goes",
    response_class=EventSourceResponse,
    responses={
        200: content(
            "text/event-stream",
            "Server-sent events: `status` with a search report on each change, `problem` while the "
            "planner is away. Ends after the final state; a browser's EventSource has to be closed "
            "then, or it connects again.",
        ),
        **problem_responses(404, 422, 503),
    },
)
async def follow_search(
    events: Annotated[AsyncIterator[ServerSentEvent], Depends(events_from_now)],
) -> AsyncIterator[ServerSentEvent]:
    """Every change of the search as a server-sent event."""
    async for event in events:
        yield event
