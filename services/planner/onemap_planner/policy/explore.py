"""Exploration: which goal to drive to, and when to abandon it."""

from __future__ import annotations

from dataclasses import replace
from math import pi

import numpy as np

from onemap_planner.motion.motions import Motion, Rest, Rotate
from onemap_planner.motion.pure_pursuit import LOOK_AROUND_RADPS, arrived
from onemap_planner.policy.competition import found_object_at, found_under_other_names
from onemap_planner.policy.context import PlanningContext, across_gaps, coverage_of
from onemap_planner.policy.evidence import object_probability
from onemap_planner.policy.goals import (
    SAME_GOAL_M,
    Goal,
    GoalCandidates,
    GoalKind,
    LeftGoal,
    detection_goals,
    explain_candidate,
    explain_goal,
    frontier_goals,
    region_goals,
    select_goal,
    spent_before_s,
    successor,
    with_left,
)
from onemap_planner.policy.state import (
    BLACKLIST_RADIUS_M,
    GOAL_BASE_S,
    GOAL_S_PER_M,
    LINGER_S,
    SETTLE_S,
    ActiveGoal,
    GoalComparison,
    Observation,
    PlannerState,
    abandon_finished,
    compared,
    is_blacklisted,
    is_new_goal,
    reconsider,
)
from onemap_planner.policy.tried_viewpoints import next_viewpoint
from onemap_planner.policy.viewpoints import lies_across_gap
from onemap_planner.policy.ways import (
    UnreachedPlace,
    frontier_goal,
    looks_at_closed_ways,
    visit_counts,
    ways_to_unreached,
)
from onemap_planner.search.events import CandidateSelected, Event, Exhausted
from onemap_planner.search.phases import Destination, Exploring
from onemap_planner.world.candidates import CERTAIN, MERGE_M, MIN_SIGHTINGS, ObjectCandidate
from onemap_planner.world.frontiers import find_frontiers
from onemap_planner.world.map_view import components
from onemap_planner.world.regions import SimilarRegion, discounted, find_regions, remaining_regions
from onemap_shared.geometry import F64, I64
from onemap_shared.messages import Coverage, SearchKind

# Square metres of free floor that no path leads to, from which on all frontiers are visited once
# more before the object counts as not found: a small room.
CUT_OFF_M2 = 2.0

LEAST_CUT_OFF_M2 = 0.3  # of floor beyond a gap that are worth a look into it: a doorway
MAX_LAST_LOOKS = 2  # doubtful candidates that are looked at again before an object is given up
LEAST_NAMED_M2 = 1.0  # less floor out of reach is the rim of furniture
MAX_CANDIDATES_TRIED = 5  # candidates considered in one step, those with the most sightings


def select_candidate(state: PlannerState, context: PlanningContext) -> Event | None:
    """The event that selects a candidate seen often enough and reachable, if there is one."""
    for candidate in state.target_state.candidates[:MAX_CANDIDATES_TRIED]:
        if candidate.sightings < MIN_SIGHTINGS:
            continue
        if candidate.contradictions > candidate.sightings:
            continue  # more often detected under another name
        if next_viewpoint(state, candidate, context) is not None:
            return CandidateSelected(candidate)
    return None


def with_candidate_choice(
    state: PlannerState, candidate: ObjectCandidate, context: PlanningContext
) -> PlannerState:
    """The state whose search explains why the robot walks up to the selected candidate."""
    goals = detection_goals(
        ((candidate, candidate.similarity),),
        context,
        viewpoint_of=lambda thing: next_viewpoint(state, thing, context),
    )
    if not goals:
        return state
    enough = MIN_SIGHTINGS
    search = explain_candidate(state.search, goals[0], candidate.sightings, enough)
    return replace(state, search=search)


def explore(
    state: PlannerState, context: PlanningContext
) -> tuple[PlannerState, Motion, Event | None, GoalCandidates]:
    """Drive to the best goal; without one after a look around the object counts as not found."""
    believed = discounted(context.map_view, state.target_state.undetected)
    goal_candidates = GoalCandidates(
        find_frontiers(believed, context.costmap), find_regions(believed)
    )
    state = abandon_finished(state, LINGER_S)
    ways = _ways_to_unreached(state, context)
    state = _with_gaps(state, ways, context)
    options = _options(state, context, goal_candidates, ways)
    goal = select_goal(
        options, state.target_state.active_goal.goal if state.target_state.active_goal else None
    )
    if goal is None:
        return *_idle(state, context), goal_candidates
    motion = context.drive_to(goal.viewpoint_xy, goal.look_xy)
    active_goal = _activate(state, goal)
    left = _left_goals(state, goal)
    if is_new_goal(state, active_goal):
        state = replace(state, search=explain_goal(state.search, goal, options))
    if active_goal.arrived_s is None and arrived(motion, context.pose):
        active_goal = replace(active_goal, arrived_s=state.active_time_s)
    active_goal = compared(active_goal, motion, state.active_time_s, goal_candidates)
    target_state = replace(
        state.target_state, active_goal=active_goal, idle_since_s=None, left=left
    )
    event = _candidate_reached(state, active_goal)
    return replace(state, target_state=target_state), motion, event, goal_candidates


def _candidate_reached(state: PlannerState, active_goal: ActiveGoal) -> Event | None:
    """Selects the disputed candidate that the robot has come to look at."""
    goal = active_goal.goal
    if goal.kind is not GoalKind.DETECTION or active_goal.arrived_s is None:
        return None
    for candidate in state.target_state.disputed:
        if goal.looks_at((candidate.xyz[0], candidate.xyz[1]), MERGE_M):
            return CandidateSelected(candidate)
    return None


def _options(
    state: PlannerState, context: PlanningContext, goal_candidates: GoalCandidates, ways: list[Goal]
) -> list[Goal]:
    """The goals to choose from; ways: those on the ways to candidates without a viewpoint."""
    costmap, cost_to_go = context.costmap, context.cost_to_go
    goals = frontier_goals(goal_candidates.frontiers, costmap, cost_to_go)
    goals += _region_goals(state, context, goal_candidates.regions)
    goals += detection_goals(
        _unconfirmed(state, context),
        context,
        viewpoint_of=lambda thing: next_viewpoint(state, thing, context),
    )
    worthwhile = ways + _without_blacklisted(state, goals)
    if worthwhile:
        return worthwhile
    for look in looks_at_closed_ways(context, _tried_xy(state, GoalKind.LOOK_AT)):
        if not is_blacklisted(state, look, BLACKLIST_RADIUS_M):
            return [look]
    way_out = _way_to_cut_off(state, context)
    if way_out is not None:
        return [way_out]
    remaining = remaining_regions(context.map_view)
    return _without_blacklisted(state, _region_goals(state, context, remaining))


def _way_to_cut_off(state: PlannerState, context: PlanningContext) -> Goal | None:
    """A look into the unknown gap before the largest part of the floor that no path leads to.

    The gap may be too narrow for a frontier, such as floor that the camera missed in a doorway.
    """
    parts = components(context.cut_off())
    largest = max(parts, key=len, default=None)
    if largest is None or len(largest) * context.map_view.cell_area_m2 < LEAST_CUT_OFF_M2:
        return None
    grid = context.costmap.grid
    here = grid.cells(np.asarray(context.pose.xy))
    nearest = largest[np.hypot(*(largest - here).T).argmin()]
    x, y = grid.centres(nearest)
    visits = _visits(state, context)
    there = Destination(SearchKind.GO_TO, (float(x), float(y)))
    return frontier_goal(there, context, visits)


def _ways_to_unreached(state: PlannerState, context: PlanningContext) -> list[Goal]:
    """The ways to candidates without a viewpoint: seen through a door, or over a table."""
    agreed = [(candidate, candidate.similarity) for candidate in _agreed(state)]
    places = [
        UnreachedPlace((candidate.xyz[0], candidate.xyz[1]), score)
        for candidate, score in agreed + _unconfirmed(state, context)
        if next_viewpoint(state, candidate, context) is None
    ]
    if not places:
        return []
    visits = _visits(state, context)
    goals = ways_to_unreached(places, context, visits)
    return _without_blacklisted(state, goals)


def _with_gaps(state: PlannerState, ways: list[Goal], context: PlanningContext) -> PlannerState:
    """The state that crosses narrow unknown gaps, if what detector and map agree on stands beyond
    one and no frontier is left on the way to it."""
    agreed = _agreed(state)
    if ways or state.crosses_gaps or not lies_across_gap(agreed, context):
        return state
    return replace(state, crosses_gaps=True)


def _agreed(state: PlannerState) -> list[ObjectCandidate]:
    """What was detected often enough where the map agrees."""
    least = MIN_SIGHTINGS
    often = [c for c in state.target_state.candidates if c.sightings >= least]
    return often[:MAX_CANDIDATES_TRIED]


def _visits(state: PlannerState, context: PlanningContext) -> I64:
    """(nx, ny): how many frontiers near each cell were visited or given up."""
    visited_xy = np.array(state.blacklisted_frontiers, np.float64).reshape(-1, 2)
    return visit_counts(context, visited_xy, BLACKLIST_RADIUS_M)


def _region_goals(
    state: PlannerState, context: PlanningContext, regions: tuple[SimilarRegion, ...]
) -> list[Goal]:
    return region_goals(
        regions, context.costmap, context.cost_to_go, tried_xy=_tried_xy(state, GoalKind.REGION)
    )


def _tried_xy(state: PlannerState, kind: GoalKind) -> F64:
    """Viewpoints (T, 2), metres, of the goals of this kind that were given up for the object."""
    tried = [goal.viewpoint_xy for goal in state.target_state.blacklisted if goal.kind is kind]
    return np.array(tried, np.float64).reshape(-1, 2)


def _without_blacklisted(state: PlannerState, goals: list[Goal]) -> list[Goal]:
    return [goal for goal in goals if not is_blacklisted(state, goal, BLACKLIST_RADIUS_M)]


def _unconfirmed(
    state: PlannerState, context: PlanningContext
) -> list[tuple[ObjectCandidate, float]]:
    """Candidates worth a closer look, with their scores.

    Those seen, but not often enough to be approached; and those that the map does not support,
    while they are not certainly something else.
    """
    least = MIN_SIGHTINGS
    seldom = [(c, c.similarity) for c in state.target_state.candidates if c.sightings < least]
    often = [c for c in state.target_state.disputed if c.sightings >= least]
    disputed = [
        (candidate, object_probability(candidate, context))
        for candidate in often[:MAX_CANDIDATES_TRIED]
    ]
    unlikely = 1 - CERTAIN
    return seldom[:MAX_CANDIDATES_TRIED] + [(c, p) for c, p in disputed if p > unlikely]


def _activate(state: PlannerState, goal: Goal) -> ActiveGoal:
    """The active goal: the present one if the goal is the same, else a new one.

    A goal that recedes, as the end of a corridor does, gets a new budget once it is elsewhere; one
    that the robot comes back to, what is left of its budget.
    """
    active_goal = state.target_state.active_goal
    if (
        active_goal is not None
        and successor([goal], active_goal.goal) is not None
        and goal.looks_at(active_goal.budget_xy, 2 * SAME_GOAL_M)
    ):
        return replace(active_goal, goal=goal)
    budget_s = GOAL_BASE_S + GOAL_S_PER_M * goal.utility.travel_m
    left, base_s = state.target_state.left, GOAL_BASE_S
    spent_s = spent_before_s(left, goal, base_s=base_s)
    return ActiveGoal(goal, state.active_time_s - spent_s, budget_s, goal.look_xy)


def _left_goals(state: PlannerState, chosen: Goal) -> tuple[LeftGoal, ...]:
    left, before = state.target_state.left, state.target_state.active_goal
    if before is None:
        return left
    spent_s = state.active_time_s - before.since_s
    return with_left(left, LeftGoal(before.goal, spent_s), chosen)


def _idle(
    state: PlannerState, context: PlanningContext
) -> tuple[PlannerState, Motion, Event | None]:
    since_s = state.target_state.idle_since_s
    if since_s is None:
        since_s = state.active_time_s
    state = replace(
        state, target_state=replace(state.target_state, active_goal=None, idle_since_s=since_s)
    )
    idle_s = state.active_time_s - since_s
    if idle_s < SETTLE_S:
        return state, Rest(), None
    if idle_s < SETTLE_S + 2 * pi / LOOK_AROUND_RADPS:
        return state, Rotate(), None  # whoever stood in a doorway may have left
    cut_off_m2 = context.unreachable_m2()
    beyond_m2 = cut_off_m2 - across_gaps(context).unreachable_m2()
    if not state.crosses_gaps and beyond_m2 >= LEAST_CUT_OFF_M2:
        target_state = replace(state.target_state, idle_since_s=None)
        return replace(state, target_state=target_state, crosses_gaps=True), Rest(), None
    cut_off = cut_off_m2 >= CUT_OFF_M2
    began_s = state.search.target_start.since_active_time_s
    untried = since_s - began_s < SETTLE_S  # no goal since the object's turn came
    again = (
        state.target_state.rejected
        or state.target_state.closed_off
        or state.unreached_frontiers
        or ((cut_off or untried) and state.blacklisted_frontiers)
    )
    doubtful = _doubtful(state, context)
    if (again or doubtful) and not state.target_state.reconsidered:
        looks = tuple(candidate for _, candidate in doubtful[:MAX_LAST_LOOKS])
        return reconsider(state, frontiers=cut_off or untried, doubtful=looks), Rest(), None
    coverage = coverage_of(context)
    covered = _covered(state, context, coverage)
    named = f"; {_told(*doubtful[0])}" if doubtful else ""
    return state, Rest(), Exhausted(covered + named, coverage)


def _doubtful(state: PlannerState, context: PlanningContext) -> list[tuple[float, ObjectCandidate]]:
    """What was detected, but not accepted because the map did not agree, the most probable first.

    Each with its probability; what is certainly something else is left out.
    """
    weighed = [
        (object_probability(candidate, context), candidate)
        for candidate in (*state.target_state.disputed, *state.target_state.rejected)
        if not candidate.supported and candidate.sightings >= MIN_SIGHTINGS
    ]
    likely = [pair for pair in weighed if pair[0] > 1 - CERTAIN]
    return sorted(likely, key=lambda pair: -pair[0])


def _told(probable: float, best: ObjectCandidate) -> str:
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
    if not coverage.best_match_m:
        return f"{text}; the map has no features"
    x, y = coverage.best_match_m
    (cell,) = map_view.world_cells(map_view.grid.cells(np.array([[x, y]])))
    others = found_under_other_names(state.found_objects, state.search.target, state.synonyms)
    found_object = found_object_at(cell, others)
    there = f", which is the {found_object.name} found before" if found_object else ""
    return f"{text}; best match {coverage.best_score:.2f} at ({x:.1f}, {y:.1f}){there}"


EVERY_STEP_M2 = 200.0  # known area up to which every step compares all goals: a large flat
COMPARE_S_PER_M2 = 0.0025  # beyond it: 2 s for 1000 m2, in which a robot drives a metre
AROUND_M = 3.0  # of the way; obstacles farther than the inflation radius cost it nothing


def follow_window(state: PlannerState, observation: Observation) -> F64 | None:
    """Corners (2, 2) in metres of the part of the map that this step needs; None: all of it.

    All of it is needed to compare goals, for detections, and to approach a candidate.
    """
    active_goal = state.target_state.active_goal
    if active_goal is None or active_goal.comparison is None or observation.pose is None:
        return None
    if active_goal.arrived_s is not None or not isinstance(state.search.phase, Exploring):
        return None
    if _is_over(state, active_goal, active_goal.comparison):
        return None
    least = MIN_SIGHTINGS
    if any(found.names for found in observation.detections) or any(
        candidate.sightings >= least for candidate in state.target_state.candidates
    ):
        return None
    here = (*observation.pose.xy, 0.0)
    if any(candidate.distance_m(here) <= AROUND_M for candidate in state.target_state.disputed):
        return None  # a frame without a detection of it counts against it
    corners = np.vstack([active_goal.comparison.corners_xy, observation.pose.xy])
    return np.stack([corners.min(axis=0) - AROUND_M, corners.max(axis=0) + AROUND_M])


def can_follow(state: PlannerState, context: PlanningContext) -> bool:
    """Whether a path leads to the active goal within this part of the map."""
    active_goal = state.target_state.active_goal
    if active_goal is None:
        return False
    grid = context.costmap.grid
    cell = grid.cells(np.asarray(active_goal.goal.viewpoint_xy))
    inside = bool(grid.contains(cell))
    return inside and bool(np.isfinite(context.cost_to_go.cost_m[cell[0], cell[1]]))


def follow_goal(
    state: PlannerState, context: PlanningContext
) -> tuple[PlannerState, Motion, GoalCandidates]:
    """Drive on to the active goal, which ``can_follow``."""
    active_goal = state.target_state.active_goal
    if active_goal is None or active_goal.comparison is None:
        return state, Rest(), GoalCandidates()
    goal, comparison = active_goal.goal, active_goal.comparison
    motion = context.drive_to(goal.viewpoint_xy, goal.look_xy)
    if arrived(motion, context.pose):
        active_goal = replace(active_goal, arrived_s=state.active_time_s)
    target_state = replace(state.target_state, active_goal=active_goal)
    return replace(state, target_state=target_state), motion, comparison.candidates


def _is_over(state: PlannerState, active_goal: ActiveGoal, comparison: GoalComparison) -> bool:
    """Whether the goals are to be compared again, or the time for this one is over."""
    now_s = state.active_time_s
    period_s = COMPARE_S_PER_M2 * max(state.known_m2 - EVERY_STEP_M2, 0.0)
    return now_s - comparison.at_s >= period_s or now_s - active_goal.since_s > active_goal.budget_s
