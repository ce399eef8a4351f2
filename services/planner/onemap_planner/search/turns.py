"""Turns: which object of a search is sought now, and what was spent on one that was put aside."""

from __future__ import annotations

from dataclasses import replace

from onemap_planner.search.events import EventStamp
from onemap_planner.search.phases import PausedTarget, Search, Starting, TargetStart


def target_start(stamp: EventStamp) -> TargetStart:
    """The start of an object for which nothing was spent yet."""
    return TargetStart(stamp.now_s, stamp.active_time_s, stamp.xy, stamp.odometer_m)


def starting(search: Search) -> str:
    """The reason of a search that asks the map about its present object."""
    return f"asking the map about {search.subject}"


def waiting(search: Search) -> tuple[int, ...]:
    """Indices of the objects that are neither done nor sought now, in the order of the request."""
    known = {*search.done, search.index}
    return tuple(index for index in range(len(search.objects)) if index not in known)


def next_index(search: Search) -> int:
    """The object after the present one: the first of the planned order that waits."""
    left = waiting(search)
    return next((index for index in search.planned if index in left), left[0])


def reordered(search: Search, indices: tuple[int, ...], stamp: EventStamp) -> Search:
    """The search with this order of what is still sought; another first object begins now.

    The present object is put aside with the time and the way that were spent on it.
    """
    search = replace(search, planned=indices)
    if indices[0] == search.index:
        return search
    return begun(
        replace(search, paused=(*search.paused, _paused(search, stamp))), indices[0], stamp
    )


def begun(search: Search, index: int, stamp: EventStamp) -> Search:
    """The search at the start of an object, which goes on where it was put aside."""
    before = next((paused for paused in search.paused if paused.index == index), None)
    start = target_start(stamp) if before is None else _resumed(before, stamp)
    paused = tuple(each for each in search.paused if each.index != index)
    search = replace(search, index=index, phase=Starting(), target_start=start, paused=paused)
    return replace(search, reason=starting(search))


def _paused(search: Search, stamp: EventStamp) -> PausedTarget:
    start = search.target_start
    return PausedTarget(
        search.index,
        spent_s=stamp.now_s - start.since_s,
        spent_active_time_s=stamp.active_time_s - start.since_active_time_s,
        driven_m=stamp.odometer_m - start.odometer_m,
        xy=start.xy,
    )


def _resumed(paused: PausedTarget, stamp: EventStamp) -> TargetStart:
    """A start that lies back by what was spent: times and ways of all turns add up."""
    return TargetStart(
        since_s=stamp.now_s - paused.spent_s,
        since_active_time_s=stamp.active_time_s - paused.spent_active_time_s,
        xy=paused.xy,
        odometer_m=stamp.odometer_m - paused.driven_m,
    )
