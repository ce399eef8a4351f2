"""The search as a state machine: one transition function over named phases and events.

Time, place and odometer come in with the ``Moment``; nothing here senses, plans or drives.
"""

from __future__ import annotations

import math
from dataclasses import replace

from onemap_planner.search.phases import (
    Approaching,
    Arrived,
    Begun,
    Broken,
    Cancelled,
    Confirmed,
    Confirming,
    Event,
    Exhausted,
    Exploring,
    GivenUp,
    Leg,
    Looking,
    MapLost,
    Moment,
    Over,
    Phase,
    Rejected,
    Search,
    Spotted,
    Starting,
    Turned,
)
from onemap_planner.world.candidates import Candidate
from onemap_shared.messages import ObjectResult, SearchState, SearchStatus


def begin(search_id: str, objects: tuple[str, ...], moment: Moment, started_ns: int) -> Search:
    """A new search at its first object."""
    leg = _leg(moment)
    return Search(search_id, objects, 0, Starting(), leg, (), _starting(objects[0]), started_ns)


def transition(  # noqa: PLR0911, PLR0912 - a table, one row for each transition
    search: Search, event: Event, moment: Moment
) -> Search:
    """The search after the event; events that mean nothing in its phase change nothing."""
    match search.phase, event:
        case (Over(), _):
            return search
        case (_, Cancelled()):
            return _end(search, SearchState.CANCELLED, "cancelled", moment)
        case (_, Broken(reason)):
            return _end(search, SearchState.FAILED, reason, moment)
        case (_, GivenUp(reason)):
            return _next(search, SearchState.FAILED, reason, moment)
        case (Starting(), Begun(look_around)):
            leg = search.leg if search.leg.xy is not None else replace(search.leg, xy=moment.xy)
            search = replace(search, leg=leg)
            return _look(search, "looking around") if look_around else _explore(search)
        case (Looking(turned_rad), Turned(by_rad)):
            total = turned_rad + by_rad
            full = total >= 2 * math.pi
            return _explore(search) if full else replace(search, phase=Looking(total))
        case (Exploring() | Approaching() | Confirming(), MapLost()):
            return _look(search, "the map began anew: looking around")
        case (Looking() | Exploring(), Spotted(candidate)):
            return replace(search, phase=Approaching(candidate), reason=_approaching(candidate))
        case (Exploring(), Exhausted(reason)):
            return _next(search, SearchState.NOT_FOUND, reason, moment)
        case (Approaching(), Arrived(candidate)):
            reason = f"standing before {search.target!r}, making sure"
            return replace(search, phase=Confirming(candidate, moment.attentive_s), reason=reason)
        case (Confirming(), Confirmed(candidate)):
            return _next(search, SearchState.FOUND, _found(candidate), moment, candidate)
        case (Approaching() | Confirming(), Rejected()):
            return _explore(search)
        case _:
            return search


def status(search: Search, *, odometer_m: float, now_ns: int, waiting: str = "") -> SearchStatus:
    """What the world is told; ``waiting`` says what the robot stands still for.

    A search that is over was updated last when it ended, however late it is asked about.
    """
    return SearchStatus(
        search_id=search.search_id,
        state=_public(search.phase),
        objects=search.objects,
        index=search.index,
        reason=f"waiting: {waiting}" if waiting and search.active else search.reason,
        results=search.results,
        started_ns=search.started_ns,
        updated_ns=now_ns if search.ended_ns is None else search.ended_ns,
        path_length_m=_driven(search, odometer_m),
    )


def _leg(moment: Moment) -> Leg:
    return Leg(moment.now_s, moment.attentive_s, moment.xy, moment.odometer_m)


def _driven(search: Search, odometer_m: float) -> float:
    done = sum(result.path_length_m for result in search.results)
    return done + (odometer_m - search.leg.odometer_m if search.active else 0.0)


def _public(phase: Phase) -> SearchState:
    match phase:
        case Over(state):
            return state
        case Approaching():
            return SearchState.APPROACHING
        case Confirming():
            return SearchState.CONFIRMING
        case _:
            return SearchState.EXPLORING


def _result(
    search: Search, outcome: SearchState, reason: str, moment: Moment, candidate: Candidate | None
) -> ObjectResult:
    return ObjectResult(
        name=search.objects[search.index],
        outcome=outcome,
        reason=reason,
        position_m=candidate.xyz if candidate else (),
        score=candidate.match if candidate else 0.0,
        duration_s=moment.now_s - search.leg.since_s,
        path_length_m=moment.odometer_m - search.leg.odometer_m,
        start_xy_m=search.leg.xy or (),
        end_xy_m=moment.xy or (),
    )


def _next(
    search: Search,
    outcome: SearchState,
    reason: str,
    moment: Moment,
    candidate: Candidate | None = None,
) -> Search:
    """The present object is done; start the next or end the search."""
    results = (*search.results, _result(search, outcome, reason, moment, candidate))
    if len(results) < len(search.objects):
        leg = _leg(moment)
        return replace(
            search,
            index=search.index + 1,
            phase=Starting(),
            leg=leg,
            results=results,
            reason=_starting(search.objects[search.index + 1]),
        )
    outcomes = {result.outcome for result in results}
    overall = next(
        state
        for state in (SearchState.FAILED, SearchState.NOT_FOUND, SearchState.FOUND)
        if state in outcomes
    )
    return replace(search, phase=Over(overall), results=results, reason=_summary(results))


def _end(search: Search, state: SearchState, reason: str, moment: Moment) -> Search:
    """The whole search ends now, with the present object's outcome."""
    results = (*search.results, _result(search, state, reason, moment, None))
    return replace(search, phase=Over(state), results=results, reason=reason)


def _summary(results: tuple[ObjectResult, ...]) -> str:
    found = [result.name for result in results if result.outcome is SearchState.FOUND]
    missing = [
        f"{result.name}: {result.reason}"
        for result in results
        if result.outcome is not SearchState.FOUND
    ]
    text = f"found {len(found)} of {len(results)}"
    return text if not missing else f"{text}; {'; '.join(missing)}"


def _starting(name: str) -> str:
    return f"asking the map about {name!r}"


def _explore(search: Search) -> Search:
    return replace(search, phase=Exploring(), reason=f"exploring for {search.target!r}")


def _look(search: Search, what: str) -> Search:
    return replace(search, phase=Looking(), reason=f"{what} for {search.target!r}")


def _approaching(candidate: Candidate) -> str:
    return (
        f"seen {candidate.sightings} times at ({candidate.xyz[0]:.1f}, {candidate.xyz[1]:.1f}), "
        f"similarity {candidate.match:.2f}: walking up to it"
    )


def _found(candidate: Candidate) -> str:
    return (
        f"found at ({candidate.xyz[0]:.2f}, {candidate.xyz[1]:.2f}), "
        f"similarity {candidate.match:.2f}, in {candidate.sightings} detections"
    )
