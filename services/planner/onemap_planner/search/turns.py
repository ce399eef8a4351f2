"""Turns: which object of a search is sought now, and the cheapest order of those that wait."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise

import numpy as np

from onemap_planner.search.phases import EventStamp, PausedTarget, Search, Starting, TargetStart
from onemap_shared.geometry import F64


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


MAX_EXACT = 7  # objects whose orders are all compared: 3 ms; beyond, the next is the cheapest


@dataclass(frozen=True, slots=True)
class OrderCosts:
    """Costs of legs between n objects, metres.

    first (n,): from where the robot is; then (n, n): from one object, the row, to another.
    """

    first: F64
    then: F64

    def of(self, order: Sequence[int]) -> float:
        """The cost of an order, positions in the arrays."""
        legs = [self.then[a, b] for a, b in pairwise(order)]
        return float(self.first[order[0]] + sum(legs)) if order else 0.0


def order_costs(way_m: F64, probability: F64, *, explore_m: float, return_m: float) -> OrderCosts:
    """The costs of n objects.

    way_m (n + 1, n + 1): between the robot, row 0, and the places; probability (n,): that each
    object is at its place, 0 where no place is known, whose ways mean nothing. explore_m: an
    exploration; return_m: the way from where it ended to a known place.
    """
    known = probability > 0
    likely = np.where(known, probability, 1.0)
    legs = np.where(known[:, None], way_m[1:, 1:], return_m) / likely
    return OrderCosts(
        first=np.where(known, way_m[0, 1:] / likely, explore_m),
        then=np.where(known[None, :], legs, explore_m),
    )


def cheapest_order(costs: OrderCosts, first: int | None = None) -> tuple[int, ...]:
    """The cheapest order, or the cheapest that begins with ``first``.

    Exact up to ``MAX_EXACT`` objects, else each time the cheapest next one; of equal orders that
    with the lower positions first.
    """
    objects = frozenset(range(len(costs.first)))
    starts = sorted(objects) if first is None else [first]
    if len(objects) > MAX_EXACT:
        start = min(starts, key=lambda index: float(costs.first[index]))
        return (start, *_nearest_next(costs, start, objects - {start}))

    @cache
    def rest(last: int, left: frozenset[int]) -> tuple[float, tuple[int, ...]]:
        options = [(float(costs.then[last, n]), n, rest(n, left - {n})) for n in left]
        return min(((leg + cost, (n, *tail)) for leg, n, (cost, tail) in options), default=(0, ()))

    tails = [(start, rest(start, objects - {start})) for start in starts]
    _, order = min(
        (float(costs.first[start]) + cost, (start, *tail)) for start, (cost, tail) in tails
    )
    return order


def _nearest_next(costs: OrderCosts, last: int, left: frozenset[int]) -> tuple[int, ...]:
    order = []
    while left:
        last = min(left, key=lambda index: (float(costs.then[last, index]), index))
        left -= {last}
        order.append(last)
    return tuple(order)
