"""A closed room of 4 x 4 m with the robot at (1, 1), for tests of one step of the policy."""

from __future__ import annotations

from onemap_planner.motion.motions import Pose2d
from onemap_planner.policy.context import PlanningContext, build_context
from onemap_planner.policy.state import PlannerState, TargetState
from onemap_planner.search.events import EventStamp
from onemap_planner.search.state_machine import new_search
from onemap_planner.world.candidates import ObjectCandidate
from tests.planner.drawn_maps import NO_POINTS, PARAMS, drawn_map, search_view_of

ROOM = search_view_of(drawn_map(*["#" * 8, *["#......#"] * 6, "#" * 8], scale=5))
POSE = Pose2d(1.0, 1.0, 0.0)
SEARCH = new_search("id", ("sofa",), EventStamp(0.0, 0.0, (1.0, 1.0), 0.0), 0)


def candidate(x: float, y: float, sightings: int = 3) -> ObjectCandidate:
    """A candidate of one cell, seen from the robot's pose."""
    cell = (int(x / 0.1), int(y / 0.1))
    return ObjectCandidate((x, y, 0.5), frozenset({cell}), sightings, 0.9, 0.8, ((1.0, 1.0),))


def planner_state(*candidates: ObjectCandidate, active_time_s: float = 0.0) -> PlannerState:
    """A state at the beginning of a search, with these candidates."""
    return PlannerState(SEARCH, TargetState(candidates=candidates), active_time_s=active_time_s)


def context() -> PlanningContext:
    """The context at the robot's pose."""
    return build_context(POSE, ROOM, trail=(), obstacles_xy=NO_POINTS, params=PARAMS.costmap)
