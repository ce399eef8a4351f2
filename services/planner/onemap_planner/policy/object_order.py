"""Order of the objects of a search in any order: the cheapest by what the map shows, revised.

The map is asked about one waiting object after the other, beside the present one. Detections of
a waiting object, which compete with the present one anyway, count for it where the frame and the
map's answer about it come in the same step.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from onemap_planner.motion.path import way_lengths
from onemap_planner.policy.context import PlanningContext
from onemap_planner.policy.goals import SAME_GOAL_M, GoalKind
from onemap_planner.policy.state import MAX_LOOKS, PlannerState, TargetState
from onemap_planner.policy.viewpoints import reachable
from onemap_planner.search.events import Reordered
from onemap_planner.search.turns import cheapest_order, order_costs, waiting
from onemap_planner.world.candidates import MIN_SIGHTINGS
from onemap_planner.world.map_view import MapView, PlanningView, map_view_around
from onemap_planner.world.regions import LikelyPlace, likely_places, similar_cells
from onemap_shared.geometry import Bool
from onemap_shared.messages import SearchOrder

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
    if not search.active or search.order is not SearchOrder.ANY or turn == state.order_memory.turn:
        return ""
    left = waiting(search)
    return search.objects[left[turn % len(left)]] if left else ""


def with_turn(state: PlannerState) -> PlannerState:
    """The state in which the map was asked in this turn, whether it has answered or not."""
    if state.search.order is not SearchOrder.ANY:
        return state
    return replace(state, order_memory=replace(state.order_memory, turn=_turn(state)))


def take_in_view(
    state: PlannerState,
    view: PlanningView,
    merge: Callable[[PlannerState, PlanningContext], PlannerState],
    context: PlanningContext,
) -> PlannerState:
    """The state with the places and the sightings of the waiting objects that the view is of.

    merge: adds the sightings of this step to a state that seeks one of them.
    """
    map_view = map_view_around(view, np.asarray(context.pose.xy))
    context = replace(context, map_view=map_view)
    for index in waiting(state.search):
        if state.search.objects[index] != view.text:
            continue
        targets = dict(state.other_targets)
        target_state = targets.get(index, TargetState())
        there = replace(state, search=replace(state.search, index=index), target_state=target_state)
        target_state = merge(there, context).target_state
        targets[index] = target_state
        places = _places(target_state, map_view, map_view.observed)
        memory = state.order_memory.updated(index, places)
        state = replace(state, other_targets=tuple(targets.items()), order_memory=memory)
    return state


def revise_order(
    state: PlannerState, context: PlanningContext
) -> tuple[PlannerState, Reordered | None]:
    """The event that another order is the cheapest; None if it is not, or no revision is due."""
    left = waiting(state.search)
    memory, now_s = state.order_memory, state.active_time_s
    if state.search.order is not SearchOrder.ANY or not left:
        return state, None
    if memory.decided_s is not None and now_s - memory.decided_s < REVISE_PERIOD_S:
        return state, None
    state = replace(state, order_memory=replace(memory, decided_s=now_s))
    map_view = context.map_view
    present = _places(state.target_state, map_view, map_view.observed & ~map_view.searched)
    indices = (state.search.index, *left)
    known = [present, *(memory.of(index) for index in left)]
    order = tuple(indices[position] for position in _order(known, context))
    if order == state.search.planned:
        return state, None
    if order[0] != state.search.index:
        state = _refuted(state, map_view)
    return state, Reordered(order)


def _order(known: list[tuple[LikelyPlace, ...]], context: PlanningContext) -> tuple[int, ...]:
    """Positions in ``known``, cheapest order; the first, the present object, keeps its place
    unless another order is cheaper by the margin."""
    grid, floor = context.map_view.grid, reachable(context.costmap, context.cost_to_go)
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


def _places(target_state: TargetState, map_view: MapView, among: Bool) -> tuple[LikelyPlace, ...]:
    """Where the object was detected and where the map looks like it, without what was looked at
    in vain."""
    least = MIN_SIGHTINGS
    sighted = [
        LikelyPlace(candidate.xyz[:2], SIGHTED_PROBABILITY, candidate.cells)
        for candidate in target_state.candidates
        if candidate.sightings >= least and candidate.contradictions <= candidate.sightings
    ]
    scale = 1.0 if map_view.calibrated else UNCALIBRATED_PROBABILITY
    similar = [
        replace(place, probability=place.probability * scale * LOOK_FACTOR**looks)
        for place in likely_places(map_view, among, threshold=LIKELY, refuted=target_state.refuted)
        if (looks := _looks(target_state, place, SAME_GOAL_M)) < MAX_LOOKS
    ]
    return tuple(
        place
        for place in (*sighted, *similar)
        if all(place.cells.isdisjoint(rejected.cells) for rejected in target_state.rejected)
    )


def _looks(target_state: TargetState, place: LikelyPlace, within_m: float) -> int:
    """How often the place was looked at without result."""
    return sum(
        goal.kind is not GoalKind.FRONTIER and goal.looks_at(place.xy, within_m)
        for goal in target_state.blacklisted
    )


def _refuted(state: PlannerState, map_view: MapView) -> PlannerState:
    """The state that remembers where the present object was searched for: the searched layer
    begins anew with the next object."""
    cells = np.argwhere(similar_cells(map_view, LIKELY) & map_view.searched)
    refuted = state.target_state.refuted | map_view.world_cells(cells)
    return replace(state, target_state=replace(state.target_state, refuted=refuted))


def _turn(state: PlannerState) -> int:
    return int(state.active_time_s / VIEW_PERIOD_S)
