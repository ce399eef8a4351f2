"""From where a candidate was looked at in vain, and from where to look at it next."""

from __future__ import annotations

from onemap_planner.policy.context import PlanningContext
from onemap_planner.policy.goals import GoalKind
from onemap_planner.policy.state import PlannerState
from onemap_planner.policy.viewpoints import find_viewpoint
from onemap_planner.world.candidates import MERGE_M, VIEWS_PER_VIEWPOINT, ObjectCandidate


def next_viewpoint(
    state: PlannerState, candidate: ObjectCandidate, context: PlanningContext
) -> tuple[float, float] | None:
    """The viewpoint (metres) of a candidate that was not tried yet; None if none can be reached."""
    tried = [
        *exhausted_viewpoints(candidate),
        *doubted_from(state, candidate),
        *_looked_from(state, candidate),
    ]
    return find_viewpoint(candidate, context, tried)


def exhausted_viewpoints(candidate: ObjectCandidate) -> list[tuple[float, float]]:
    """Places, in metres, from which more views of a candidate show nothing new."""
    if candidate.supported:
        return []
    enough = VIEWS_PER_VIEWPOINT
    return [tally.xy for tally in candidate.near_views if tally.frames >= enough]


def doubted_from(state: PlannerState, candidate: ObjectCandidate) -> list[tuple[float, float]]:
    """Viewpoints, metres, from which the candidate was not confirmed."""
    return [
        doubt.from_xy
        for doubt in state.target_state.doubts
        if candidate.distance_m(doubt.place_xyz) <= MERGE_M
    ]


def _looked_from(state: PlannerState, candidate: ObjectCandidate) -> list[tuple[float, float]]:
    """Viewpoints, metres, of the looks at it before it was detected often enough."""
    there = (candidate.xyz[0], candidate.xyz[1])
    return [
        goal.viewpoint_xy
        for goal in state.target_state.blacklisted
        if goal.kind is GoalKind.DETECTION and goal.looks_at(there, MERGE_M)
    ]
