"""Order of the objects of a search in any order: the cheapest by what the map shows, revised.

The map is asked about one waiting object after the other, beside the present one. Detections of
a waiting object, which compete with the present one anyway, count for it where the frame and the
map's answer about it come in the same step.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise

import numpy as np

from onemap_planner.motion.path import way_lengths
from onemap_planner.policy.context import PlanningContext
from onemap_planner.policy.evidence import found_under_other_names, update_memory
from onemap_planner.policy.goals import SAME_GOAL_M, GoalKind
from onemap_planner.policy.memory import MAX_LOOKS, PlannerState, TargetMemory
from onemap_planner.search.state_machine import Reordered, waiting
from onemap_planner.world.candidates import MIN_SIGHTINGS
from onemap_planner.world.map_view import MapView, PlanningView, map_view_around
from onemap_planner.world.regions import LikelyPlace, likely_places, similar_cells
from onemap_shared.geometry import F64, Bool
from onemap_shared.messages import Detections, SearchOrder

# Similarity from which a place counts as one of the object: from the lower threshold of regions on,
# three of four places are something else.
LIKELY = 0.5
# Probability of a place where detections agreed often enough to walk up to it.
SIGHTED_PROBABILITY = 0.9
# Probability of the best match of an encoder without calibration: every map has a best match.
UNCALIBRATED_PROBABILITY = 0.6
# Metres of way to an object that the map shows nowhere: the mean path of a search in apartments of
# 70 to 120 square metres.
EXPLORE_M = 15.0
# Metres of way from where an exploration ends to a place known before: half of such an apartment's
# length.
RETURN_M = 8.0
# Metres by which another order must be cheaper than the best that goes on with the present object:
# what a turn around costs.
MARGIN_M = 2.0
REVISE_PERIOD_S = 1.0  # seconds between two revisions: the map changes little in less
# Seconds after which the map is asked about the next object that waits: one question more for every
# two plans.
VIEW_PERIOD_S = 0.5

NO_WAY_M = 1000.0  # where the floor leads nowhere, so that orders can still be compared
LOOK_FACTOR = 0.5  # of a place's probability, for each look at it without result


def name_to_ask(state: PlannerState) -> str:
    """The waiting object that the map is to be asked about in this step; empty if none is."""
    search, turn = state.search, _turn(state)
    if not search.active or search.order is not SearchOrder.ANY or turn == state.asked_turn:
        return ""
    left = waiting(search)
    return search.objects[left[turn % len(left)]] if left else ""


def count_turn(state: PlannerState) -> None:
    """The map was asked in this turn, whether it has answered or not."""
    if state.search.order is SearchOrder.ANY:
        state.asked_turn = _turn(state)


def take_in_view(
    state: PlannerState,
    view: PlanningView,
    frames: tuple[Detections, ...],
    context: PlanningContext,
) -> None:
    """Take in the places and the sightings of the waiting objects that the view is of."""
    map_view = map_view_around(view, np.asarray(context.pose.xy))
    context = replace(context, map_view=map_view)
    others = found_under_other_names(state.found_objects, view.text, state.synonyms)
    for index in waiting(state.search):
        if state.search.objects[index] != view.text:
            continue
        memory = state.other_memories.get(index, TargetMemory()).copy()
        update_memory(memory, view.text, frames, context, others)
        state.other_memories[index] = memory
        state.places[index] = _places(memory, map_view, map_view.observed)


def revise_order(state: PlannerState, context: PlanningContext) -> Reordered | None:
    """The event that another order is the cheapest; None if it is not, or no revision is due."""
    left, now_s = waiting(state.search), state.active_time_s
    if state.search.order is not SearchOrder.ANY or not left:
        return None
    if state.ordered_s is not None and now_s - state.ordered_s < REVISE_PERIOD_S:
        return None
    state.ordered_s = now_s
    map_view, memory = context.map_view, state.memory
    believed = context.believed(map_view)
    present = _places(memory, believed, map_view.observed & ~map_view.searched)
    indices = (state.search.index, *left)
    known = [present, *(state.places.get(index, ()) for index in left)]
    order = tuple(indices[position] for position in _order(known, context))
    if order == state.search.planned:
        return None
    if order[0] != state.search.index:  # the searched layer begins anew with the next object
        refuted = np.argwhere(similar_cells(map_view, LIKELY) & map_view.searched)
        memory.refuted = memory.refuted | map_view.world_cells(refuted)
    return Reordered(order)


def _order(known: list[tuple[LikelyPlace, ...]], context: PlanningContext) -> tuple[int, ...]:
    """Positions in ``known``, cheapest order; the first, the present object, keeps its place
    unless another order is cheaper by the margin."""
    grid, floor = context.map_view.grid, context.reachable
    here = np.array([context.pose.xy])
    every = [place.xy for places in known for place in places]
    to_place = way_lengths(grid, floor, here, np.array(every).reshape(-1, 2))[0]
    ways = dict(zip(every, to_place, strict=True))
    best = [
        min(places, key=lambda place: ways[place.xy] / place.probability, default=None)
        for places in known
    ]
    points = np.vstack([here, *[here if place is None else [place.xy] for place in best]])
    costs = order_costs(
        np.minimum(way_lengths(grid, floor, points, points), NO_WAY_M),
        np.array([0.0 if place is None else place.probability for place in best]),
        explore_m=EXPLORE_M,
        return_m=RETURN_M,
    )
    cheapest, staying = cheapest_order(costs), cheapest_order(costs, first=0)
    return cheapest if costs.of(cheapest) + MARGIN_M < costs.of(staying) else staying


def _places(memory: TargetMemory, map_view: MapView, among: Bool) -> tuple[LikelyPlace, ...]:
    """Where the object was detected and where the map looks like it, without what was looked at
    in vain."""
    sighted = [
        LikelyPlace(candidate.xyz[:2], SIGHTED_PROBABILITY, candidate.cells)
        for candidate in memory.candidates
        if candidate.sightings >= max(MIN_SIGHTINGS, candidate.contradictions)
    ]
    scale = 1.0 if map_view.scores is None else UNCALIBRATED_PROBABILITY
    similar = [
        replace(place, probability=place.probability * scale * LOOK_FACTOR**looks)
        for place in likely_places(map_view, among, threshold=LIKELY, refuted=memory.refuted)
        if (looks := _looks(memory, place)) < MAX_LOOKS
    ]
    return tuple(
        place
        for place in (*sighted, *similar)
        if all(place.cells.isdisjoint(rejected.cells) for rejected in memory.rejected)
    )


def _looks(memory: TargetMemory, place: LikelyPlace) -> int:
    """How often the place was looked at without result."""
    return sum(
        goal.kind is not GoalKind.FRONTIER and goal.looks_at(place.xy, SAME_GOAL_M)
        for goal in memory.given_up
    )


def _turn(state: PlannerState) -> int:
    return int(state.active_time_s / VIEW_PERIOD_S)


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
