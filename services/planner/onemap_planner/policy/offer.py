"""The goals to choose from: borders, regions, uncertain candidates, ways to what is far off."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from heapq import nlargest

import numpy as np

from onemap_planner.policy.context import PlanningContext
from onemap_planner.policy.evidence import MAX_CANDIDATES_TRIED, agreed, likely_unsupported
from onemap_planner.policy.find_check import check_find
from onemap_planner.policy.goals import (
    SAME_GOAL_M,
    Goal,
    GoalKind,
    SearchAreas,
    detection_goal,
    frontier_goals,
    grown,
    most_worth,
    region_goal,
)
from onemap_planner.policy.outline import outline_goals
from onemap_planner.policy.state import Evidence, PlannerState
from onemap_planner.policy.ways import option_on_way
from onemap_planner.sentences import ONWARD, onward
from onemap_planner.world.candidates import MIN_SIGHTINGS, ObjectCandidate
from onemap_planner.world.frontiers import MIN_LENGTH_M, find_frontiers
from onemap_planner.world.map_view import components
from onemap_planner.world.regions import SimilarRegion, find_regions
from onemap_shared.conditions import is_outline_open
from onemap_shared.messages import Holds, all_hold

CUT_OFF_M2 = 0.3  # of floor that no path leads to that are worth a look at the way: a doorway
MAX_UNREACHED = 2  # candidates to which ways are planned, the most similar ones


def search_areas(context: PlanningContext) -> SearchAreas:
    """The frontiers and regions of the map, by what is believed of the object."""
    promising = replace(context.map_view, similarity=context.map_view.promise)
    return SearchAreas(
        find_frontiers(context.believed(promising, drawn=True), context.costmap),
        find_regions(context.believed(promising)),
    )


def offer(state: PlannerState, context: PlanningContext, areas: SearchAreas) -> list[Goal]:
    """The goals to choose from: frontiers, candidates, ways to those without a viewpoint, regions.

    Without any: the way to floor that no path leads to.
    """
    goals = _in_place(frontier_goals(areas.frontiers, context), context)
    looks, ways = _candidate_goals(state, context)
    worthwhile = ways + _not_given_up(state, goals + looks)
    worthwhile += _region_goals(state, context, areas.regions, worthwhile)
    if worthwhile:
        return worthwhile
    way_out = _way_to_cut_off(state, context)
    return [] if way_out is None else [way_out]


def _candidate_goals(
    state: PlannerState, context: PlanningContext
) -> tuple[list[Goal], list[Goal]]:
    """A look at each candidate that is not sure, and the ways to the most similar ones without a
    viewpoint: seen through a door, or over a table."""
    ledger = state.ledger
    sure, unsure = (
        [
            (candidate, score, ledger.next_viewpoint(candidate, context))
            for candidate, score in scored
        ]
        for scored in ([(c, c.similarity) for c in agreed(state)], _unconfirmed(state, context))
    )
    looks: list[Goal] = []
    for candidate, score, xy in unsure:
        outline = _outline_goals(candidate, score, state, context)
        if outline:
            looks += outline
        elif xy is not None:
            looks.append(detection_goal(candidate, score, xy, context))
    unreached = [(c, score) for c, score, xy in sure + unsure if xy is None]
    ways = []
    for candidate, score in sorted(unreached, key=lambda pair: -pair[1])[:MAX_UNREACHED]:
        end_xy = ledger.next_viewpoint(candidate, context.optimistic)
        if end_xy is not None:
            ways.append(option_on_way(end_xy, context, ledger.looked_xy, doing=ONWARD, score=score))
    return looks, [way for way in ways if way is not None]


def _outline_goals(
    candidate: ObjectCandidate, score: float, state: PlannerState, context: PlanningContext
) -> list[Goal]:
    """The looks at the outline of a room, of a candidate of which nothing else is to be checked."""
    conditions = check_find(candidate, context, state.evidence, state.found_objects)
    if not is_outline_open(conditions):
        return []
    return _not_given_up(state, [*outline_goals(candidate, score, context, state.ledger)])


def _in_place(borders: list[Goal], context: PlanningContext) -> list[Goal]:
    """The borders of the places in one of which the object is, if the map shows them.

    Where the robot can go there and none is left, there is nothing to look for elsewhere; until
    then the way to the place may be anywhere.
    """
    place = context.place
    if place is None:
        return borders
    least = MIN_LENGTH_M / context.map_view.grid.cell_size_m
    cells = [context.map_view.indices_of(goal.cells).T for goal in borders]
    inside = [
        goal
        for goal, (x, y) in zip(borders, cells, strict=True)
        if np.count_nonzero(place[x, y]) >= least
    ]
    return inside if inside or (place & context.reachable).any() else borders


def _not_given_up(state: PlannerState, goals: list[Goal]) -> list[Goal]:
    return [goal for goal in goals if not state.ledger.is_given_up(goal)]


def _region_goals(
    state: PlannerState,
    context: PlanningContext,
    regions: tuple[SimilarRegion, ...],
    others: Sequence[Goal],
) -> list[Goal]:
    """The goals of the regions that may be among the best two of all, and the present one.

    others: of other kinds. Viewpoints of all regions took most of the time of planning.
    """
    best = nlargest(2, (goal.utility.total for goal in others))
    active, tried_xy = state.active_goal, state.ledger.tried_xy(GoalKind.REGION)
    present = grown(active.goal.cells) if active else frozenset()

    def is_present(region: SimilarRegion) -> bool:
        x, y = region.peak_xy.tolist()
        near = active is not None and active.goal.looks_at((x, y), SAME_GOAL_M)
        return near or not present.isdisjoint(context.map_view.world_cells(region.cells))

    goals = []
    worth = [(most_worth(region, context), region) for region in regions]
    for most, region in sorted(worth, key=lambda pair: -pair[0]):
        if len(best) == 2 and most < best[-1] and not is_present(region):
            continue
        goal = region_goal(region, context, tried_xy=tried_xy)
        if goal is not None and not state.ledger.is_given_up(goal):
            goals.append(goal)
            best = nlargest(2, [*best, goal.utility.total])
    return goals


def _way_to_cut_off(state: PlannerState, context: PlanningContext) -> Goal | None:
    """The way to the nearest part of the floor that no path leads to: what closes it may be a gap
    too narrow for a frontier, or somebody who has left by now."""
    parts = components(context.cut_off() & np.isfinite(context.optimistic.cost_to_go.cost_m))
    large = [part for part in parts if len(part) * context.map_view.cell_area_m2 >= CUT_OFF_M2]
    if not large:
        return None
    cells = np.concatenate(large)
    nearest = cells[np.argmin(context.optimistic.cost_to_go.cost_m[tuple(cells.T)])]
    there = context.xy_of(nearest)
    return option_on_way(there, context, state.ledger.looked_xy, doing=onward("floor behind it"))


def _unconfirmed(
    state: PlannerState, context: PlanningContext
) -> list[tuple[ObjectCandidate, float]]:
    """Candidates worth a closer look, with their scores.

    Those seen, but not often enough to be approached, or of which it cannot be told whether they
    are as described; and those that the map does not support, while they are not certainly
    something else, or another one.
    """
    seldom = [(c, c.similarity) for c in state.evidence.candidates if c.sightings < MIN_SIGHTINGS]
    seldom += _unclear(state.evidence, context)
    often = [
        candidate
        for candidate in state.evidence.unsupported
        if candidate.sightings >= MIN_SIGHTINGS and _may_fit(candidate, state, context)
    ]
    unsupported = likely_unsupported(often[:MAX_CANDIDATES_TRIED], context)
    return seldom[:MAX_CANDIDATES_TRIED] + unsupported


def _may_fit(candidate: ObjectCandidate, state: PlannerState, context: PlanningContext) -> bool:
    """Whether it may be as described, or the search takes any object of the name."""
    evidence = state.evidence
    if context.description is None or evidence.takes_any:
        return True
    conditions = check_find(candidate, context, evidence, state.found_objects)
    return all_hold(conditions) is not Holds.NO


def _unclear(evidence: Evidence, context: PlanningContext) -> list[tuple[ObjectCandidate, float]]:
    """The candidates that may be as described, with the joint belief in each."""
    believed = context.believed(context.map_view) if evidence.unclear else context.map_view
    scored = []
    for candidate in evidence.unclear:
        x, y = believed.indices_of(candidate.surface).T
        scored.append((candidate, float(np.nan_to_num(believed.similarity[x, y]).max(initial=0.0))))
    return scored
