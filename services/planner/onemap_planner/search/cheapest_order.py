"""The cheapest order in which to seek several objects, by what a map knows of each.

A leg to an object that the map shows costs the way there over the probability that it is there;
one to an object that no place shows costs a fixed exploration, after which the robot may be
anywhere.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from itertools import pairwise

import numpy as np

from onemap_shared.geometry import F64

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
