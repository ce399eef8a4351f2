"""State machine of a search: one transition function over named phases and events.

Time, position and odometer come in with the ``EventStamp``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from onemap_planner.search.phases import (
    Approaching,
    Arrived,
    Cancelled,
    CandidateSelected,
    Confirmed,
    Confirming,
    Destination,
    DestinationReached,
    Driving,
    Event,
    EventStamp,
    Exhausted,
    Exploring,
    Finished,
    Interrupted,
    LookingAround,
    MapReady,
    MapRestarted,
    Phase,
    Rejected,
    Reordered,
    Rotated,
    Search,
    SearchFailed,
    Starting,
    TargetFailed,
)
from onemap_planner.search.turns import begun, next_index, reordered, starting, target_start
from onemap_planner.world.candidates import ObjectCandidate
from onemap_shared.messages import (
    NO_COVERAGE,
    Coverage,
    FailureCode,
    GoalChoice,
    ObjectResult,
    SearchKind,
    SearchOrder,
    SearchState,
    SearchStatus,
)


def new_search(
    search_id: str,
    objects: tuple[str, ...],
    stamp: EventStamp,
    started_ns: int,
    destination: Destination | None = None,
    *,
    order: SearchOrder = SearchOrder.GIVEN,
) -> Search:
    """A new search at its first object, or without objects a drive to the destination."""
    start = target_start(stamp)
    search = Search(search_id, objects, 0, Starting(), start, (), "", started_ns)
    search = replace(search, destination=destination, order=order)
    return replace(search, reason=starting(search))


def transition(  # noqa: PLR0911, PLR0912 - a table, one row for each transition
    search: Search, event: Event, stamp: EventStamp
) -> Search:
    """The search after the event; an event without a row for its phase changes nothing."""
    match search.phase, event:
        case (Finished(), _):
            return search
        case (_, Cancelled()):
            return _end_search(search, Ending(SearchState.CANCELLED, "cancelled"), stamp)
        case (_, Interrupted(reason)):
            return _end_search(search, Ending(SearchState.INTERRUPTED, reason), stamp)
        case (_, SearchFailed(reason, code)):
            return _end_search(search, Ending(SearchState.FAILED, reason, code), stamp)
        case (_, TargetFailed(reason, code)):
            return _finish_target(search, Ending(SearchState.FAILED, reason, code), stamp)
        case (Starting(), MapReady(look_around)):
            start = search.target_start
            if start.xy is None:
                search = replace(search, target_start=replace(start, xy=stamp.xy))
            return _look_around(search, "looking around") if look_around else _set_out(search)
        case (LookingAround(turned_rad), Rotated(by_rad)):
            total = turned_rad + by_rad
            full = total >= 2 * math.pi
            return _set_out(search) if full else replace(search, phase=LookingAround(total))
        case (Exploring() | Approaching() | Confirming() | Driving(), MapRestarted()):
            return _look_around(search, "the map began anew: looking around")
        case (LookingAround() | Exploring() | Confirming(), CandidateSelected(candidate)):
            return replace(search, phase=Approaching(candidate), reason=_approaching(candidate))
        case (Exploring(), Reordered(indices)):
            return reordered(search, indices, stamp)
        case (Driving(), DestinationReached(reason)):
            return _finish_target(search, Ending(SearchState.ARRIVED, reason), stamp)
        case (Driving(), Exhausted(reason)):
            ending = Ending(SearchState.FAILED, reason, FailureCode.UNREACHABLE)
            return _finish_target(search, ending, stamp)
        case (Exploring(), Exhausted(reason, coverage)):
            ending = Ending(SearchState.NOT_FOUND, reason, coverage=coverage)
            return _finish_target(search, ending, stamp)
        case (Approaching(), Arrived(candidate)):
            reason = f"standing before {search.target!r}, making sure"
            return replace(search, phase=Confirming(candidate, stamp.active_time_s), reason=reason)
        case (Confirming(), Confirmed(candidate)):
            ending = Ending(SearchState.FOUND, _found(candidate), candidate=candidate)
            return _finish_target(search, ending, stamp)
        case (Approaching() | Confirming(), Rejected()):
            return _set_out(search)
        case _:
            return search


def status(search: Search, *, odometer_m: float, now_ns: int, waiting: str = "") -> SearchStatus:
    """The message about the search; waiting: why the robot stands still, or empty.

    ``updated_ns`` of a search that is over is when it ended.
    """
    return SearchStatus(
        search_id=search.search_id,
        state=_wire_state(search.phase),
        objects=search.objects,
        index=search.index,
        reason=f"waiting: {waiting}" if waiting and search.active else search.reason,
        results=search.results,
        started_ns=search.started_ns,
        updated_ns=now_ns if search.ended_ns is None else search.ended_ns,
        path_length_m=driven_m(search, odometer_m),
        kind=search.kind,
        place_m=search.destination.xy if search.destination else (),
        order=search.order,
        choice=search.choice,
    )


def driven_m(search: Search, odometer_m: float) -> float:
    """Metres driven in a search."""
    done = sum(result.path_length_m for result in search.results)
    done += sum(paused.driven_m for paused in search.paused)
    return done + (odometer_m - search.target_start.odometer_m if search.active else 0.0)


def elapsed_s(search: Search, now_s: float) -> float:
    """Seconds that an active search has taken, for all its objects."""
    return now_s - search.target_start.since_s + sum(r.duration_s for r in search.results)


def _wire_state(phase: Phase) -> SearchState:
    match phase:
        case Finished(state):
            return state
        case Approaching() | Driving():
            return SearchState.APPROACHING
        case Confirming():
            return SearchState.CONFIRMING
        case _:
            return SearchState.EXPLORING


@dataclass(frozen=True, slots=True)
class Ending:
    """How the search for an object ends; candidate: what was found."""

    outcome: SearchState
    reason: str
    code: FailureCode = FailureCode.NONE
    coverage: Coverage = NO_COVERAGE
    candidate: ObjectCandidate | None = None


def _result(search: Search, ending: Ending, stamp: EventStamp) -> ObjectResult:
    candidate = ending.candidate
    view = candidate.best_view if candidate else None
    return ObjectResult(
        name=search.target,
        outcome=ending.outcome,
        reason=ending.reason,
        position_m=candidate.xyz if candidate else (),
        score=candidate.similarity if candidate else 0.0,
        duration_s=stamp.now_s - search.target_start.since_s,
        path_length_m=stamp.odometer_m - search.target_start.odometer_m,
        start_xy_m=search.target_start.xy or (),
        end_xy_m=stamp.xy or (),
        reason_code=ending.code,
        coverage=ending.coverage,
        frame_ns=view.stamp_ns if view else 0,
        box_px=view.box_px if view else (),
        cells=len(candidate.cells) if candidate else 0,
    )


def _finish_target(search: Search, ending: Ending, stamp: EventStamp) -> Search:
    """The present object is done; start the next or end the search."""
    results = (*search.results, _result(search, ending, stamp))
    search = replace(search, choice=_no_goal(search))
    if len(results) < len(search.objects):
        index = next_index(search)
        search = replace(search, results=results, done=(*search.done, search.index))
        return begun(search, index, stamp)
    if search.destination is not None:
        return replace(
            search, phase=Finished(ending.outcome), results=results, reason=ending.reason
        )
    outcomes = {result.outcome for result in results}
    overall = next(
        state
        for state in (SearchState.FAILED, SearchState.NOT_FOUND, SearchState.FOUND)
        if state in outcomes
    )
    return replace(search, phase=Finished(overall), results=results, reason=_summary(results))


def _end_search(search: Search, ending: Ending, stamp: EventStamp) -> Search:
    """The whole search ends now, with the present object's outcome."""
    return replace(
        search,
        phase=Finished(ending.outcome),
        results=(*search.results, _result(search, ending, stamp)),
        reason=ending.reason,
        choice=_no_goal(search),
    )


def _no_goal(search: Search) -> GoalChoice:
    return GoalChoice(search.choice.number)


def _summary(results: tuple[ObjectResult, ...]) -> str:
    found = [result.name for result in results if result.outcome is SearchState.FOUND]
    missing = [
        f"{result.name}: {result.reason}"
        for result in results
        if result.outcome is not SearchState.FOUND
    ]
    text = f"found {len(found)} of {len(results)}"
    return text if not missing else f"{text}; {'; '.join(missing)}"


def _set_out(search: Search) -> Search:
    destination = search.destination
    if destination is None:
        return replace(search, phase=Exploring(), reason=f"exploring for {search.subject}")
    look = destination.kind is SearchKind.LOOK_AT
    reason = f"driving to {f'where {search.subject} can be seen' if look else search.subject}"
    return replace(search, phase=Driving(destination), reason=reason)


def _look_around(search: Search, what: str) -> Search:
    reason = f"{what} for {search.subject}"
    return replace(search, phase=LookingAround(), reason=reason, choice=_no_goal(search))


def _approaching(candidate: ObjectCandidate) -> str:
    return (
        f"seen {candidate.sightings} times at ({candidate.xyz[0]:.1f}, {candidate.xyz[1]:.1f}), "
        f"similarity {candidate.similarity:.2f}: walking up to it"
    )


def _found(candidate: ObjectCandidate) -> str:
    return (
        f"found at ({candidate.xyz[0]:.2f}, {candidate.xyz[1]:.2f}), "
        f"similarity {candidate.similarity:.2f}, in {candidate.sightings} detections"
    )
