"""Exploration: which goal to drive to, how to follow it, and what to do when none is left.

Comparing goals takes time in proportion to the known area. Beyond the size of a flat it is
therefore done less often, and the steps between look at the map around the way only: planning
takes about the same share of a processor in a hall as in a flat.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from heapq import nlargest
from math import pi

import numpy as np

from onemap_planner.motion.motions import Rotate
from onemap_planner.motion.pure_pursuit import LOOK_AROUND_RADPS
from onemap_planner.policy.arrival import ArrivalState, arrive
from onemap_planner.policy.context import PlanningContext, across_gaps, coverage_of
from onemap_planner.policy.evidence import (
    found_object_at,
    found_under_other_names,
    likely_unsupported,
)
from onemap_planner.policy.find_check import check_find
from onemap_planner.policy.goals import (
    SAME_GOAL_M,
    Goal,
    GoalCandidates,
    GoalKind,
    detection_goals,
    explain_goal,
    frontier_goals,
    grown,
    most_worth,
    region_goal,
    select_goal,
    successor,
)
from onemap_planner.policy.outcome import Move, Observation
from onemap_planner.policy.state import (
    SETTLE_S,
    ActiveGoal,
    Evidence,
    GoalComparison,
    PlannerState,
)
from onemap_planner.policy.verify import other_object
from onemap_planner.policy.viewpoints import lies_across_gap
from onemap_planner.policy.ways import (
    UnreachedPlace,
    frontier_goal,
    looks_at_closed_ways,
    visit_counts,
    ways_to_unreached,
)
from onemap_planner.policy.zones import zone_before
from onemap_planner.search.state_machine import (
    CandidateSelected,
    Destination,
    Ending,
    Exploring,
    without_choice,
)
from onemap_planner.sentences import the, zone_in_the_way
from onemap_planner.world.candidates import MERGE_M, MIN_SIGHTINGS, ObjectCandidate
from onemap_planner.world.frontiers import find_frontiers
from onemap_planner.world.map_view import components
from onemap_planner.world.regions import SimilarRegion, discounted, find_regions, remaining_regions
from onemap_shared.geometry import F64
from onemap_shared.messages import (
    MAX_GOAL_OPTIONS,
    NO_DETAIL,
    Coverage,
    FailureCode,
    SearchKind,
    SearchState,
)

LEAST_CUT_OFF_M2 = 0.3  # of floor beyond a gap that are worth a look into it: a doorway
MAX_CANDIDATES_TRIED = 5  # candidates considered in one step, those with the most sightings
EVERY_STEP_M2 = 200.0  # known area up to which every step compares all goals: a large flat
COMPARE_S_PER_M2 = 0.0025  # beyond it: 2 s for 1000 m2, in which a robot drives a metre
AROUND_M = 3.0  # of the way; obstacles farther than the inflation radius cost it nothing


def select_candidate(state: PlannerState, context: PlanningContext) -> CandidateSelected | None:
    """The event that selects a candidate seen often enough and reachable, if there is one.

    One that was more often detected under another name does not count.
    """
    for candidate in state.evidence.candidates[:MAX_CANDIDATES_TRIED]:
        often = candidate.sightings >= max(MIN_SIGHTINGS, candidate.contradictions)
        if often and state.ledger.next_viewpoint(candidate, context) is not None:
            return CandidateSelected(candidate)
    return None


def explore(state: PlannerState, context: PlanningContext) -> Move:
    """Drive to the best goal; without one, the last resorts."""
    now_s = state.active_time_s
    seen = discounted(context.map_view, state.evidence.undetected)
    candidates = GoalCandidates(
        find_frontiers(context.believed(seen, drawn=True), context.costmap),
        find_regions(context.believed(seen)),
    )
    state.give_up_finished()
    ways = _ways_to_unreached(state, context)
    if not ways and not state.crosses_gaps:
        state.crosses_gaps = lies_across_gap(_agreed(state), context)
    options = _options(state, context, candidates, ways)
    goal = select_goal(options, state.active_goal.goal if state.active_goal else None)
    if goal is None:
        return replace(last_resort(state, context), candidates=candidates)
    at, motion = arrive(context.drive_to(goal.viewpoint_xy, goal.look_xy), context)
    if at is ArrivalState.NO_VIEW:
        return _without_view(state, goal, candidates)
    active = _activated(state, goal)
    state.leave_for(goal)
    state.search = explain_goal(
        state.search, goal, options, state.landmarks(context), new=state.is_new(active)
    )
    active = active.at(now_s, arrived=at is ArrivalState.THERE)
    state.active_goal = active.compared(motion, candidates, now_s)
    state.idle_since_s = None
    return Move(motion, _unsupported_reached(state, active), candidates)


def _activated(state: PlannerState, goal: Goal) -> ActiveGoal:
    """The active goal: the present one if the goal is the same, else a new one.

    A goal that recedes, as the end of a corridor does, gets a new budget once it is elsewhere.
    """
    active = state.active_goal
    if (
        active is not None
        and successor([goal], active.goal) is not None
        and goal.looks_at(active.budget_xy, 2 * SAME_GOAL_M)
    ):
        return replace(active, goal=goal)
    return state.new_goal(goal)


def _unsupported_reached(state: PlannerState, active: ActiveGoal) -> CandidateSelected | None:
    """Selects the candidate without the map's support that the robot has come to look at."""
    if active.goal.kind is not GoalKind.DETECTION or active.arrived_s is None:
        return None
    there = (c for c in state.evidence.unsupported if active.goal.looks_at(c.xyz[:2], MERGE_M))
    return next((CandidateSelected(candidate) for candidate in there), None)


def _options(
    state: PlannerState, context: PlanningContext, candidates: GoalCandidates, ways: list[Goal]
) -> list[Goal]:
    """The goals to choose from; ways: those on the ways to candidates without a viewpoint.

    Without any, a look at what may close a way, at the largest part of the floor that no path
    leads to, and at what looks a little like the object.
    """
    goals = frontier_goals(candidates.frontiers, context)
    goals += _detection_goals(_unconfirmed(state, context), state, context)
    worthwhile = ways + _not_given_up(state, goals)
    worthwhile += _region_goals(state, context, candidates.regions, worthwhile)
    if worthwhile:
        return worthwhile
    for look in looks_at_closed_ways(context, state.ledger.tried_xy(GoalKind.LOOK_AT)):
        if not state.ledger.is_given_up(look):
            return [look]
    way_out = _way_to_cut_off(state, context)
    if way_out is not None:
        return [way_out]
    left = remaining_regions(context.believed(context.map_view))
    return _region_goals(state, context, left, [])


def _not_given_up(state: PlannerState, goals: list[Goal]) -> list[Goal]:
    return [goal for goal in goals if not state.ledger.is_given_up(goal)]


def _region_goals(
    state: PlannerState,
    context: PlanningContext,
    regions: tuple[SimilarRegion, ...],
    others: Sequence[Goal],
) -> list[Goal]:
    """The goals of the regions that may be among the best of these and others, and the present
    one: viewpoints of all of them took most of the time of planning."""
    active, tried_xy = state.active_goal, state.ledger.tried_xy(GoalKind.REGION)
    present = grown(active.goal.cells) if active else frozenset()
    best = nlargest(MAX_GOAL_OPTIONS, (goal.utility.total for goal in others))
    goals = []
    worth = [(most_worth(region, context), region) for region in regions]
    for most, region in sorted(worth, key=lambda pair: -pair[0]):
        if len(best) == MAX_GOAL_OPTIONS and most < best[-1]:
            x, y = region.peak_xy.tolist()
            near = active is not None and active.goal.looks_at((x, y), SAME_GOAL_M)
            if not near and present.isdisjoint(context.map_view.world_cells(region.cells)):
                continue
        goal = region_goal(region, context, tried_xy=tried_xy)
        if goal is not None and not state.ledger.is_given_up(goal):
            goals.append(goal)
            best = nlargest(MAX_GOAL_OPTIONS, [*best, goal.utility.total])
    return goals


def _detection_goals(
    scored: list[tuple[ObjectCandidate, float]], state: PlannerState, context: PlanningContext
) -> list[Goal]:
    def viewpoint_of(candidate: ObjectCandidate) -> tuple[float, float] | None:
        return state.ledger.next_viewpoint(candidate, context)

    return detection_goals(scored, context, viewpoint_of=viewpoint_of)


def _way_to_cut_off(state: PlannerState, context: PlanningContext) -> Goal | None:
    """A look into the unknown gap before the largest part of the floor that no path leads to.

    The gap may be too narrow for a frontier, such as floor that the camera missed in a doorway.
    """
    largest = max(components(context.cut_off()), key=len, default=None)
    if largest is None or len(largest) * context.map_view.cell_area_m2 < LEAST_CUT_OFF_M2:
        return None
    away = np.hypot(*(largest - context.cell_at(context.pose.xy)).T)
    there = Destination(SearchKind.GO_TO, context.xy_of(largest[away.argmin()]))
    return frontier_goal(there, context, visit_counts(context, state.ledger.visited_frontiers))


def _ways_to_unreached(state: PlannerState, context: PlanningContext) -> list[Goal]:
    """The ways to candidates without a viewpoint: seen through a door, or over a table."""
    agreed = [(candidate, candidate.similarity) for candidate in _agreed(state)]
    places = [
        UnreachedPlace((candidate.xyz[0], candidate.xyz[1]), score)
        for candidate, score in agreed + _unconfirmed(state, context)
        if state.ledger.next_viewpoint(candidate, context) is None
    ]
    if not places:
        return []
    visits = visit_counts(context, state.ledger.visited_frontiers)
    return _not_given_up(state, ways_to_unreached(places, context, visits))


def _agreed(state: PlannerState) -> list[ObjectCandidate]:
    """What was detected often enough where the map agrees."""
    often = [c for c in state.evidence.candidates if c.sightings >= MIN_SIGHTINGS]
    return often[:MAX_CANDIDATES_TRIED]


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
    return check_find(candidate, context, evidence, state.found_objects).holds is not False


def _unclear(evidence: Evidence, context: PlanningContext) -> list[tuple[ObjectCandidate, float]]:
    """The candidates that may be as described, with the joint belief in each."""
    believed = context.believed(context.map_view) if evidence.unclear else context.map_view
    scored = []
    for candidate in evidence.unclear:
        x, y = believed.indices_of(candidate.surface).T
        scored.append((candidate, float(np.nan_to_num(believed.similarity[x, y]).max(initial=0.0))))
    return scored


def follow_window(state: PlannerState, observation: Observation) -> F64 | None:
    """Corners (2, 2) in metres of the part of the map that this step needs; None: all of it.

    All of it is needed to compare goals, for detections, and to approach a candidate.
    """
    active = state.active_goal
    if active is None or active.comparison is None or observation.pose is None:
        return None
    if active.arrived_s is not None or not isinstance(state.search.phase, Exploring):
        return None
    if _is_over(state, active, active.comparison):
        return None
    if any(found.names for found in observation.detections) or any(
        candidate.sightings >= MIN_SIGHTINGS for candidate in state.evidence.candidates
    ):
        return None
    here = (*observation.pose.xy, 0.0)
    if any(candidate.distance_m(here) <= AROUND_M for candidate in state.evidence.unsupported):
        return None  # a frame without a detection of it counts against it
    corners = np.vstack([active.comparison.corners_xy, observation.pose.xy])
    return np.stack([corners.min(axis=0) - AROUND_M, corners.max(axis=0) + AROUND_M])


def _is_over(state: PlannerState, active: ActiveGoal, comparison: GoalComparison) -> bool:
    """Whether the goals are to be compared again, or the time for this one is over."""
    now_s = state.active_time_s
    period_s = COMPARE_S_PER_M2 * max(state.known_m2 - EVERY_STEP_M2, 0.0)
    return now_s - comparison.at_s >= period_s or now_s - active.since_s > active.budget_s


def can_follow(state: PlannerState, context: PlanningContext) -> bool:
    """Whether a path leads to the active goal within this part of the map."""
    active = state.active_goal
    if active is None:
        return False
    cell = context.cell_at(active.goal.viewpoint_xy)
    inside = bool(context.costmap.grid.contains(cell))
    return inside and bool(np.isfinite(context.cost_to_go.cost_m[tuple(cell)]))


def follow_goal(state: PlannerState, context: PlanningContext) -> Move:
    """Drive on to the active goal, which ``can_follow``."""
    active = state.active_goal
    if active is None or active.comparison is None:
        return Move()
    candidates, goal = active.comparison.candidates, active.goal
    at, motion = arrive(context.drive_to(goal.viewpoint_xy, goal.look_xy), context)
    if at is ArrivalState.NO_VIEW:
        return _without_view(state, goal, candidates)
    there = at is ArrivalState.THERE
    state.active_goal = active.at(state.active_time_s, arrived=there)
    return Move(motion, candidates=candidates)


def _without_view(state: PlannerState, goal: Goal, candidates: GoalCandidates) -> Move:
    """Give up a goal that the robot comes no nearer to: the next step takes another view."""
    state.give_up(goal, reached=False)
    return Move(candidates=candidates)


# Square metres of free floor that no path leads to, from which on all frontiers are visited once
# more before the object counts as not found: a small room.
CUT_OFF_M2 = 2.0
LEAST_BEYOND_M2 = 0.3  # of floor beyond gaps that are worth crossing them: a doorway
LEAST_NAMED_M2 = 1.0  # less floor out of reach is the rim of furniture
MAX_LAST_LOOKS = 2  # doubtful candidates that are looked at again before an object is given up


def wait(state: PlannerState, _: PlanningContext) -> Move | None:
    """Stand for ``SETTLE_S``: the next view of the map may show a goal."""
    return Move() if state.idle_s() < SETTLE_S else None


def look_around(state: PlannerState, _: PlanningContext) -> Move | None:
    """Turn once: whoever stood in a doorway may have left."""
    turned_s = SETTLE_S + 2 * pi / LOOK_AROUND_RADPS
    return Move(Rotate()) if state.idle_s() < turned_s else None


def cross_gaps(state: PlannerState, context: PlanningContext) -> Move | None:
    """Let paths cross narrow gaps of unknown floor, if there is floor beyond them."""
    if state.crosses_gaps:
        return None
    beyond_m2 = context.unreachable_m2() - across_gaps(context).unreachable_m2()
    if beyond_m2 < LEAST_BEYOND_M2:
        return None
    state.idle_since_s = None
    state.crosses_gaps = True
    return Move()


def reconsider(state: PlannerState, context: PlanningContext) -> Move | None:
    """Look once more at what was rejected, given up on the way, cut off or is doubtful."""
    if state.reconsidered:
        return None
    cut_off = context.unreachable_m2() >= CUT_OFF_M2
    began_s = state.search.target_start.since_active_time_s
    # No goal since the object's turn came.
    untried = state.active_time_s - state.idle_s() - began_s < SETTLE_S
    again = (
        state.evidence.rejected
        or state.ledger.may_reconsider
        or ((cut_off or untried) and state.ledger.visited_frontiers)
    )
    doubtful = _doubtful(state, context)
    if not again and not doubtful:
        return None
    looks = tuple(candidate for candidate, _ in doubtful[:MAX_LAST_LOOKS])
    state.reconsider(frontiers=cut_off or untried, doubtful=looks)
    return Move()


def settle(state: PlannerState, _: PlanningContext) -> Move | None:
    """Walk up to an object of the name that is not as described, to say that it is there."""
    evidence = state.evidence
    known = evidence.supported
    if evidence.takes_any or evidence.other_finds or state.search.detail == NO_DETAIL:
        return None
    if not (known or evidence.unsupported):
        return None
    evidence.takes_any, state.idle_since_s = True, None
    evidence.candidates, evidence.unclear, evidence.mismatched = known, (), ()
    state.ledger.forget_looks()
    return Move()


# What a search without a goal tries, in this order.
LAST_RESORTS: tuple[Callable[[PlannerState, PlanningContext], Move | None], ...] = (
    wait,
    look_around,
    cross_gaps,
    reconsider,
    settle,
)


def last_resort(state: PlannerState, context: PlanningContext) -> Move:
    """The first of ``LAST_RESORTS`` that has something to do; else the object is not found."""
    state.active_goal, state.search = None, without_choice(state.search)
    tried = (resort(state, context) for resort in LAST_RESORTS)
    move = next((move for move in tried if move is not None), None)
    return move if move is not None else give_up(state, context)


def give_up(state: PlannerState, context: PlanningContext) -> Move:
    """The object counts as not found; the reason says what was looked at.

    One that is not as described is found as another object.
    """
    if state.evidence.other_finds:
        other = state.evidence.latest(state.evidence.other_finds[0])
        check = check_find(other, context, state.evidence, state.found_objects)
        return Move(event=other_object(state, other, check))
    coverage, doubtful = coverage_of(context), _doubtful(state, context)
    named = f"; {_told(*doubtful[0])}" if doubtful else ""
    reason = _covered(state, context, coverage) + named
    zone = zone_before((*_agreed(state), *state.evidence.rejected), context)
    if zone:
        seen = (
            f"{the(state.search.target)} may have been seen, but {zone_in_the_way(zone)}; {reason}"
        )
        ending = Ending(SearchState.FAILED, seen, FailureCode.UNREACHABLE, coverage)
        return Move(event=ending)
    return Move(event=Ending(SearchState.NOT_FOUND, reason, coverage=coverage))


def _doubtful(state: PlannerState, context: PlanningContext) -> list[tuple[ObjectCandidate, float]]:
    """What was detected, but not accepted because the map did not agree, the most probable first.

    Each with its probability; what is certainly something else is left out.
    """
    unsupported = [
        candidate
        for candidate in (*state.evidence.unsupported, *state.evidence.rejected)
        if not candidate.supported and candidate.sightings >= MIN_SIGHTINGS
    ]
    return sorted(likely_unsupported(unsupported, context), key=lambda pair: -pair[1])


def _told(best: ObjectCandidate, probable: float) -> str:
    """A doubtful candidate in words."""
    hits = sum(tally.hits for tally in best.near_views)
    x, y, _ = best.xyz
    return (
        f"detected at ({x:.1f}, {y:.1f}) in {hits} of {best.near_frames} near views where the map "
        f"does not agree, probability {probable:.2f}"
    )


def _covered(state: PlannerState, context: PlanningContext, coverage: Coverage) -> str:
    """How much was explored, and where the similarity to the object is highest."""
    map_view = context.map_view
    area_m2 = float(map_view.explored.sum()) * map_view.cell_area_m2
    text = f"searched everything reachable: {area_m2:.0f} m² explored"
    if coverage.unreachable_m2 >= LEAST_NAMED_M2:
        text += f", {coverage.unreachable_m2:.0f} m² of floor seen that no way leads to"
    if context.costmap.keep_out is not None:
        text += f", not into {', '.join(map(repr, context.zones.names))}"
    if not coverage.best_match_m:
        return f"{text}; the map has no features"
    x, y = coverage.best_match_m
    (cell,) = map_view.world_cells(map_view.grid.cells(np.array([[x, y]])))
    others = found_under_other_names(state.found_objects, state.search.target, state.synonyms)
    found_object = found_object_at(cell, others)
    there = f", which is the {found_object.name} found before" if found_object else ""
    return f"{text}; best match {coverage.best_score:.2f} at ({x:.1f}, {y:.1f}){there}"
