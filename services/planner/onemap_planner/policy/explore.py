"""Exploration: which goal to drive to, and how to follow it between two comparisons of all goals.

Comparing goals takes time in proportion to the known area. Beyond the size of a flat it is
therefore done less often, and the steps between look at the map around the way only: planning
takes about the same share of a processor in a hall as in a flat.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from onemap_planner.motion.pure_pursuit import arrived
from onemap_planner.policy.context import PlanningContext
from onemap_planner.policy.evidence import likely_disputed
from onemap_planner.policy.goals import (
    SAME_GOAL_M,
    Goal,
    GoalCandidates,
    GoalKind,
    detection_goals,
    explain_candidate,
    explain_goal,
    frontier_goals,
    region_goals,
    select_goal,
    successor,
)
from onemap_planner.policy.last_resorts import last_resort
from onemap_planner.policy.memory import ActiveGoal, GoalComparison, PlannerState
from onemap_planner.policy.outcome import Move, Observation
from onemap_planner.policy.viewpoints import lies_across_gap
from onemap_planner.policy.ways import (
    UnreachedPlace,
    frontier_goal,
    looks_at_closed_ways,
    visit_counts,
    ways_to_unreached,
)
from onemap_planner.search.state_machine import CandidateSelected, Destination, Exploring
from onemap_planner.world.candidates import MERGE_M, MIN_SIGHTINGS, ObjectCandidate
from onemap_planner.world.frontiers import find_frontiers
from onemap_planner.world.map_view import components
from onemap_planner.world.regions import SimilarRegion, discounted, find_regions, remaining_regions
from onemap_shared.geometry import F64
from onemap_shared.messages import SearchKind

LEAST_CUT_OFF_M2 = 0.3  # of floor beyond a gap that are worth a look into it: a doorway
MAX_CANDIDATES_TRIED = 5  # candidates considered in one step, those with the most sightings
EVERY_STEP_M2 = 200.0  # known area up to which every step compares all goals: a large flat
COMPARE_S_PER_M2 = 0.0025  # beyond it: 2 s for 1000 m2, in which a robot drives a metre
AROUND_M = 3.0  # of the way; obstacles farther than the inflation radius cost it nothing


def select_candidate(state: PlannerState, context: PlanningContext) -> CandidateSelected | None:
    """The event that selects a candidate seen often enough and reachable, if there is one.

    One that was more often detected under another name does not count.
    """
    for candidate in state.memory.candidates[:MAX_CANDIDATES_TRIED]:
        often = candidate.sightings >= max(MIN_SIGHTINGS, candidate.contradictions)
        if often and state.memory.next_viewpoint(candidate, context) is not None:
            return CandidateSelected(candidate)
    return None


def explain_selection(
    state: PlannerState, candidate: ObjectCandidate, context: PlanningContext
) -> None:
    """Tell in the search why the robot walks up to the selected candidate."""
    goals = _detection_goals([(candidate, candidate.similarity)], state, context)
    if goals:
        search, sightings = state.search, candidate.sightings
        state.search = explain_candidate(search, goals[0], sightings, MIN_SIGHTINGS)


def explore(state: PlannerState, context: PlanningContext) -> Move:
    """Drive to the best goal; without one, the last resorts."""
    memory, now_s = state.memory, state.active_time_s
    believed = discounted(context.map_view, memory.undetected)
    candidates = GoalCandidates(find_frontiers(believed, context.costmap), find_regions(believed))
    state.give_up_finished()
    ways = _ways_to_unreached(state, context)
    if not ways and not state.crosses_gaps:
        state.crosses_gaps = lies_across_gap(_agreed(state), context)
    options = _options(state, context, candidates, ways)
    goal = select_goal(options, memory.active_goal.goal if memory.active_goal else None)
    if goal is None:
        return replace(last_resort(state, context), candidates=candidates)
    motion = context.drive_to(goal.viewpoint_xy, goal.look_xy)
    active = _activated(state, goal)
    memory.leave(goal, now_s)
    if memory.is_new(active):
        state.search = explain_goal(state.search, goal, options)
    active = active.at(now_s, arrived=arrived(motion, context.pose))
    memory.active_goal = active.compared(motion, candidates, now_s)
    memory.idle_since_s = None
    return Move(motion, _disputed_reached(state, active), candidates)


def _activated(state: PlannerState, goal: Goal) -> ActiveGoal:
    """The active goal: the present one if the goal is the same, else a new one.

    A goal that recedes, as the end of a corridor does, gets a new budget once it is elsewhere.
    """
    active = state.memory.active_goal
    if (
        active is not None
        and successor([goal], active.goal) is not None
        and goal.looks_at(active.budget_xy, 2 * SAME_GOAL_M)
    ):
        return replace(active, goal=goal)
    return state.new_goal(goal)


def _disputed_reached(state: PlannerState, active: ActiveGoal) -> CandidateSelected | None:
    """Selects the disputed candidate that the robot has come to look at."""
    if active.goal.kind is not GoalKind.DETECTION or active.arrived_s is None:
        return None
    there = (c for c in state.memory.disputed if active.goal.looks_at(c.xyz[:2], MERGE_M))
    return next((CandidateSelected(candidate) for candidate in there), None)


def _options(
    state: PlannerState, context: PlanningContext, candidates: GoalCandidates, ways: list[Goal]
) -> list[Goal]:
    """The goals to choose from; ways: those on the ways to candidates without a viewpoint.

    Without any, a look at what may close a way, at the largest part of the floor that no path
    leads to, and at what looks a little like the object.
    """
    goals = frontier_goals(candidates.frontiers, context.costmap, context.cost_to_go)
    goals += _region_goals(state, context, candidates.regions)
    goals += _detection_goals(_unconfirmed(state, context), state, context)
    worthwhile = ways + _not_given_up(state, goals)
    if worthwhile:
        return worthwhile
    for look in looks_at_closed_ways(context, state.memory.tried_xy(GoalKind.LOOK_AT)):
        if not state.is_given_up(look):
            return [look]
    way_out = _way_to_cut_off(state, context)
    if way_out is not None:
        return [way_out]
    return _not_given_up(state, _region_goals(state, context, remaining_regions(context.map_view)))


def _not_given_up(state: PlannerState, goals: list[Goal]) -> list[Goal]:
    return [goal for goal in goals if not state.is_given_up(goal)]


def _region_goals(
    state: PlannerState, context: PlanningContext, regions: tuple[SimilarRegion, ...]
) -> list[Goal]:
    tried_xy = state.memory.tried_xy(GoalKind.REGION)
    return region_goals(regions, context.costmap, context.cost_to_go, tried_xy=tried_xy)


def _detection_goals(
    scored: list[tuple[ObjectCandidate, float]], state: PlannerState, context: PlanningContext
) -> list[Goal]:
    def viewpoint_of(candidate: ObjectCandidate) -> tuple[float, float] | None:
        return state.memory.next_viewpoint(candidate, context)

    return detection_goals(scored, context, viewpoint_of=viewpoint_of)


def _way_to_cut_off(state: PlannerState, context: PlanningContext) -> Goal | None:
    """A look into the unknown gap before the largest part of the floor that no path leads to.

    The gap may be too narrow for a frontier, such as floor that the camera missed in a doorway.
    """
    largest = max(components(context.cut_off()), key=len, default=None)
    if largest is None or len(largest) * context.map_view.cell_area_m2 < LEAST_CUT_OFF_M2:
        return None
    grid = context.costmap.grid
    here = grid.cells(np.asarray(context.pose.xy))
    x, y = grid.centres(largest[np.hypot(*(largest - here).T).argmin()])
    there = Destination(SearchKind.GO_TO, (float(x), float(y)))
    return frontier_goal(there, context, visit_counts(context, state.visited_frontiers))


def _ways_to_unreached(state: PlannerState, context: PlanningContext) -> list[Goal]:
    """The ways to candidates without a viewpoint: seen through a door, or over a table."""
    agreed = [(candidate, candidate.similarity) for candidate in _agreed(state)]
    places = [
        UnreachedPlace((candidate.xyz[0], candidate.xyz[1]), score)
        for candidate, score in agreed + _unconfirmed(state, context)
        if state.memory.next_viewpoint(candidate, context) is None
    ]
    if not places:
        return []
    return _not_given_up(
        state, ways_to_unreached(places, context, visit_counts(context, state.visited_frontiers))
    )


def _agreed(state: PlannerState) -> list[ObjectCandidate]:
    """What was detected often enough where the map agrees."""
    often = [c for c in state.memory.candidates if c.sightings >= MIN_SIGHTINGS]
    return often[:MAX_CANDIDATES_TRIED]


def _unconfirmed(
    state: PlannerState, context: PlanningContext
) -> list[tuple[ObjectCandidate, float]]:
    """Candidates worth a closer look, with their scores.

    Those seen, but not often enough to be approached; and those that the map does not support,
    while they are not certainly something else.
    """
    seldom = [(c, c.similarity) for c in state.memory.candidates if c.sightings < MIN_SIGHTINGS]
    often = [c for c in state.memory.disputed if c.sightings >= MIN_SIGHTINGS]
    disputed = likely_disputed(often[:MAX_CANDIDATES_TRIED], context)
    return seldom[:MAX_CANDIDATES_TRIED] + disputed


def follow_window(state: PlannerState, observation: Observation) -> F64 | None:
    """Corners (2, 2) in metres of the part of the map that this step needs; None: all of it.

    All of it is needed to compare goals, for detections, and to approach a candidate.
    """
    memory, active = state.memory, state.memory.active_goal
    if active is None or active.comparison is None or observation.pose is None:
        return None
    if active.arrived_s is not None or not isinstance(state.search.phase, Exploring):
        return None
    if _is_over(state, active, active.comparison):
        return None
    if any(found.names for found in observation.detections) or any(
        candidate.sightings >= MIN_SIGHTINGS for candidate in memory.candidates
    ):
        return None
    here = (*observation.pose.xy, 0.0)
    if any(candidate.distance_m(here) <= AROUND_M for candidate in memory.disputed):
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
    active = state.memory.active_goal
    if active is None:
        return False
    grid = context.costmap.grid
    cell = grid.cells(np.asarray(active.goal.viewpoint_xy))
    inside = bool(grid.contains(cell))
    return inside and bool(np.isfinite(context.cost_to_go.cost_m[cell[0], cell[1]]))


def follow_goal(state: PlannerState, context: PlanningContext) -> Move:
    """Drive on to the active goal, which ``can_follow``."""
    active = state.memory.active_goal
    if active is None or active.comparison is None:
        return Move()
    motion = context.drive_to(active.goal.viewpoint_xy, active.goal.look_xy)
    there = arrived(motion, context.pose)
    state.memory.active_goal = active.at(state.active_time_s, arrived=there)
    return Move(motion, candidates=active.comparison.candidates)
