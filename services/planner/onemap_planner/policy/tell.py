"""Why a goal was chosen, why the robot creeps, how a search ended: sentences and numbers."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from math import dist, inf, isfinite, radians, tan

import numpy as np

from onemap_planner.policy.context import APPROACH_NEAREST_M, PlanningContext
from onemap_planner.policy.evidence import against_map, agreed
from onemap_planner.policy.find_check import check_find
from onemap_planner.policy.goals import Goal, GoalKind
from onemap_planner.policy.names import found_object_at, found_under_other_names
from onemap_planner.policy.outcome import Move
from onemap_planner.policy.state import PlannerState
from onemap_planner.policy.viewpoints import find_viewpoint
from onemap_planner.search.state_machine import Ending, Event, Search, found_by
from onemap_planner.sentences import (
    CREEPS_CLOSE_BY,
    KEPT,
    ONLY,
    Gain,
    Landmarks,
    approaching,
    creeps_unseen,
    found_other,
    gained,
    goal_sentence,
    left_aside,
    seen_out_of_reach,
    zone_in_the_way,
)
from onemap_planner.world.candidates import MERGE_M, ObjectCandidate
from onemap_planner.world.distances import distance_cells
from onemap_planner.world.map_view import MapView
from onemap_shared.conditions import UNLIKE, is_excluded
from onemap_shared.geometry import I64
from onemap_shared.grid import GridSpec
from onemap_shared.messages import (
    MAX_GOAL_OPTIONS,
    NO_DETAIL,
    CheckedCondition,
    Coverage,
    FailureCode,
    GoalChoice,
    GoalOption,
    ObjectFind,
    Occupancy,
    SearchState,
    evidence_for,
    evidence_missing,
)
from onemap_shared.names import definite

LEAST_GAIN = 0.005  # of utility that is named as a reason: half of what is printed


def explain_goal(
    search: Search, goal: Goal, options: Sequence[Goal], around: Landmarks, *, new: bool
) -> Search:
    """The search with the reasons for the goal among the options; new: it was chosen anew."""
    return _explained(search, explain(goal, options, around, search.target), new=new)


def explain_candidate(search: Search, goal: Goal, sightings: int, around: Landmarks) -> Search:
    """The search with the reasons for walking up to a candidate."""
    sentence = approaching(search.target, sightings, around.where(goal.look_xy))
    return _explained(search, GoalChoice(0, sentence, _options([goal], goal)), new=False)


def explain(goal: Goal, options: Sequence[Goal], around: Landmarks, name: str) -> GoalChoice:
    """The choice of ``goal`` among these options, numbered 0; of those at one place the best.

    name: of what is sought, empty for a drive to a place.
    """
    finite = [option for option in options if isfinite(option.utility.travel_m)]
    ranked = sorted(finite, key=lambda option: (-option.utility.total, option.look_xy))
    places: dict[tuple[float, float], Goal] = {}
    for each in (goal, *ranked) if goal in ranked else ranked:
        places.setdefault(each.viewpoint_xy, each)
    ranked = [option for option in ranked if places[option.viewpoint_xy] is option]
    shown = ranked[:MAX_GOAL_OPTIONS]
    if goal in ranked and goal not in shown:
        shown[-1] = goal
    others = [option for option in ranked if option != goal]
    why = _why(goal, others) if name and goal.kind is not GoalKind.LOOK_AT else ""
    sentence = goal_sentence(goal.doing, around.where(goal.look_xy), name, why)
    return GoalChoice(0, sentence, _options(shown, goal), len(ranked) - len(shown))


def _explained(search: Search, choice: GoalChoice, *, new: bool) -> Search:
    """The search with this choice; another number if it is new, none if the place is the same."""
    before = search.choice
    if not new and before.chosen_xy == choice.chosen_xy:
        return search
    number = before.number + (new or not before.options)
    return replace(search, choice=replace(choice, number=number))


def _options(goals: Sequence[Goal], chosen: Goal) -> tuple[GoalOption, ...]:
    return tuple(
        GoalOption(
            kind=str(goal.kind),
            xy_m=(float(goal.viewpoint_xy[0]), float(goal.viewpoint_xy[1])),
            score=float(goal.utility.score),
            travel_m=float(goal.utility.travel_m),
            utility=float(goal.utility.total),
            chosen=goal == chosen,
        )
        for goal in goals
    )


def _why(goal: Goal, others: Sequence[Goal]) -> str:
    """Why the goal won against the others, of which the first is the best."""
    if not others:
        return ONLY
    if goal.utility.total < others[0].utility.total:
        return KEPT
    return gained(_gains(goal, others), like=goal.kind is GoalKind.REGION)


def _gains(goal: Goal, others: Sequence[Goal]) -> list[tuple[Gain, bool]]:
    """What speaks for a goal against the first of the others, the weightiest first.

    With each, whether no other goal has more of it.
    """
    ours, rest = goal.utility, [other.utility for other in others]
    theirs = rest[0]
    share = (ours.travel_share + theirs.travel_share) / 2
    value = (ours.score + theirs.score) / 2
    like = Gain.PROMISE if goal.kind is GoalKind.FRONTIER else Gain.LIKENESS
    most_alike = ours.score >= max(each.score for each in rest)
    nearest = ours.travel_m <= min(each.travel_m for each in rest)
    parts = (
        ((ours.score - theirs.score) * share, like, most_alike),
        ((ours.travel_share - theirs.travel_share) * value, Gain.WAY, nearest),
    )
    ranked = sorted((part for part in parts if part[0] >= LEAST_GAIN), key=lambda p: -p[0])
    return [(gain, most) for _, gain, most in ranked]


LEAST_NAMED_M2 = 1.0  # less floor out of reach is the rim of furniture


def not_found(state: PlannerState, context: PlanningContext) -> Move:
    """The object counts as not found; the reason says what was looked at.

    One that is not as described is found as another object.
    """
    if state.evidence.other_finds:
        other = state.evidence.latest(state.evidence.other_finds[0])
        conditions = check_find(other, context, state.evidence, state.found_objects)
        return Move(event=other_object(state, other, conditions))
    coverage, doubted = coverage_of(context), against_map(state, context)
    named = f"; {_told(*doubted[0])}" if doubted else ""
    if state.search.detail != NO_DETAIL:
        _pass_by_all(state, context)
        named = left_aside([(each.position_m, each.reason) for each in state.search.passed]) + named
    beyond = [c for c in agreed(state) if find_viewpoint(c, context) is None]
    if beyond:
        named += seen_out_of_reach(beyond[0].xyz[:2], beyond[0].sightings)
    reason = _covered(state, context, coverage) + named
    zone = _zone_before((*agreed(state), *state.evidence.rejected), context)
    if zone:
        target, why = definite(state.search.target), zone_in_the_way(zone)
        seen = f"{target} may have been seen, but {why}; {reason}"
        ending = Ending(SearchState.FAILED, seen, FailureCode.UNREACHABLE, coverage)
        return Move(event=ending)
    return Move(event=Ending(SearchState.NOT_FOUND, reason, coverage=coverage))


def _pass_by_all(state: PlannerState, context: PlanningContext) -> None:
    """Tell of everything seen of the name what is wrong with it, however seldom it was seen."""
    told = [each.position_m for each in state.search.passed]
    for candidate in state.evidence.supported:
        conditions = check_find(candidate, context, state.evidence, state.found_objects)
        why = "; ".join(evidence_missing(conditions))
        if why and all(dist(candidate.xyz[:2], xy) > MERGE_M for xy in told):
            state.pass_by(candidate, why)


def _told(best: ObjectCandidate, probable: float) -> str:
    """A candidate against the map in words."""
    hits = sum(tally.hits for tally in best.near_views)
    x, y, _ = best.xyz
    return (
        f"detected at ({x:.1f}, {y:.1f}) in {hits} of {best.near_frames} near views, though the "
        f"map does not agree, with a probability of {probable:.2f}"
    )


def _covered(state: PlannerState, context: PlanningContext, coverage: Coverage) -> str:
    """How much was explored, and where the similarity to the object is highest."""
    map_view = context.map_view
    explored, detail, place = map_view.explored, state.search.detail, context.place
    text = "searched everything reachable"
    if place is not None and (place & context.reachable).any():
        text += f" in {' and '.join(map(definite, detail.inside))}"
        explored = explored & place
    area_m2 = float(explored.sum()) * map_view.cell_area_m2
    if context.costmap.keep_out is not None:
        text += f" without entering {' or '.join(map(repr, context.zones.names))}"
    text += f": {area_m2:.0f} m² explored"
    if coverage.unreachable_m2 >= LEAST_NAMED_M2:
        text += f", {coverage.unreachable_m2:.0f} m² of floor seen but not reachable"
    if not coverage.best_match_m:
        return f"{text}; the map has no features"
    x, y = coverage.best_match_m
    at = map_view.grid.cells(np.array([[x, y]]))
    (cell,) = map_view.world_cells(at)
    others = found_under_other_names(state.found_objects, state.search.target, state.synonyms)
    found_object = found_object_at(cell, others)
    there = f", which is the {found_object.name} found before" if found_object else ""
    if not there and _has_other_colour(map_view, at[0]):
        there = f", which is not {detail.colour} by the map's colours"
    return f"{text}; best match {coverage.best_score:.2f} at ({x:.1f}, {y:.1f}){there}"


def _has_other_colour(map_view: MapView, at: I64) -> bool:
    """Whether the map's colours around a cell (2,) exclude the one that is asked for."""
    if map_view.likeness is None:
        return False
    low = np.maximum(at - 1, 0)
    around = map_view.likeness[low[0] : at[0] + 2, low[1] : at[1] + 2]
    known = around[np.isfinite(around)]
    return bool(known.size) and float(np.median(known)) < UNLIKE


def _zone_before(candidates: Iterable[ObjectCandidate], context: PlanningContext) -> str:
    """The zone around one of the candidates that cannot be looked at; empty if none."""
    size_m = context.costmap.grid.cell_size_m
    for candidate in candidates if context.costmap.keep_out is not None else ():
        if find_viewpoint(candidate, context) is None:
            zone = context.zones.at(candidate.xyz[:2], APPROACH_NEAREST_M, size_m)
            if zone:
                return zone
    return ""


CREEPS_WITHIN_M = 0.3  # of the robot's front: reaction and braking at its slow speeds


def creeping_reason(context: PlanningContext) -> str:
    """Why a robot creeps here, and what helps if it is its camera, in words."""
    costmap, grid = context.costmap, context.costmap.grid
    away_m = distance_cells(grid, context.cell_at(context.pose.xy)) * grid.cell_size_m
    near = away_m <= context.params.radius_m + CREEPS_WITHIN_M
    if not (costmap.unseen & near).any():
        return CREEPS_CLOSE_BY
    camera = context.bands.camera
    tilted = camera.down_deg > 0
    return creeps_unseen(camera.height_m / tan(radians(camera.down_deg)) if tilted else inf)


def coverage_of(context: PlanningContext) -> Coverage:
    """The coverage of the map as it is now."""
    map_view = context.map_view
    free = map_view.occupancy == Occupancy.FREE
    similarity = np.nan_to_num(map_view.similarity, nan=-1.0)
    best = np.unravel_index(int(np.argmax(similarity)), similarity.shape)
    score = float(similarity[best])
    x, y = map_view.grid.centres(np.array(best))
    return Coverage(
        explored_m2=float((free & map_view.explored).sum()) * map_view.cell_area_m2,
        free_m2=float(free.sum()) * map_view.cell_area_m2,
        unreachable_m2=context.unreachable_m2(),
        best_match_m=(float(x), float(y)) if score >= 0 else (),
        best_score=max(score, 0.0),
    )


def other_object(
    state: PlannerState, candidate: ObjectCandidate, conditions: Sequence[CheckedCondition]
) -> Ending:
    """The end of a search that found another object of the name, or one not known to be it."""
    return Ending(
        SearchState.FOUND_OTHER,
        found_other(state.search.target, evidence_missing(conditions)),
        candidate=candidate,
        checks=evidence_for(conditions),
        excluded=is_excluded(conditions, state.search.detail),
    )


def finds_of(search: Search, events: Iterable[Event], grid: GridSpec) -> tuple[ObjectFind, ...]:
    """The finds among the events of a step, with the frames in which they were seen best.

    search: before the events.
    """
    return tuple(
        ObjectFind(
            name=search.target,
            position_m=candidate.xyz,
            extent_m=extent_m(candidate, grid),
            score=min(candidate.similarity, 1.0),  # rounding
            stamp_ns=candidate.best_view.stamp_ns if candidate.best_view else 0,
            search_id=search.search_id,
            box_px=candidate.best_view.box_px if candidate.best_view else (),
            picture=candidate.best_view.picture if candidate.best_view else b"",
        )
        for candidate in map(found_by, events)
        if candidate is not None
    )


def extent_m(candidate: ObjectCandidate, grid: GridSpec) -> tuple[float, float, float, float]:
    """x_min, y_min, x_max, y_max of the candidate's cells, metres in the map frame.

    ``grid``: any grid of the map, for the size of a cell.
    """
    cells = np.array(sorted(candidate.cells), np.int64).reshape(-1, 2)
    if len(cells) == 0:
        x, y, _ = candidate.xyz
        return x, y, x, y
    (ix, iy), (jx, jy) = cells.min(axis=0), cells.max(axis=0)
    covered = GridSpec(grid.cell_size_m, (int(ix), int(iy)), (int(jx - ix) + 1, int(jy - iy) + 1))
    return covered.bounds_m
