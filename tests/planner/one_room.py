"""A closed room of 4 x 4 m with the robot at (1, 1), for tests of one step of the policy."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from onemap_planner.motion.motions import Motion, Pose2d
from onemap_planner.motion.path import cost_to_go_from
from onemap_planner.policy.context import PlanningContext, build_context
from onemap_planner.policy.evidence import update_evidence
from onemap_planner.policy.goals import Goal, GoalKind, SearchAreas
from onemap_planner.policy.ledger import Attempt, Ledger
from onemap_planner.policy.move import Exploration, explore
from onemap_planner.policy.names import found_under_other_names
from onemap_planner.policy.outcome import Move
from onemap_planner.policy.state import Evidence, PlannerState
from onemap_planner.search.state_machine import Event, EventStamp, new_search
from onemap_planner.world.candidates import ObjectCandidate
from onemap_planner.world.map_view import MapView
from onemap_shared.messages import Detections, SearchView
from tests.planner.drawn_maps import CELL_M, PARAMS, costmap_of, drawn_map, search_view_of

ROOM = search_view_of(drawn_map(*["#" * 8, *["#......#"] * 6, "#" * 8], scale=5))
POSE = Pose2d(1.0, 1.0, 0.0)
SEARCH = new_search("id", ("sofa",), EventStamp(0.0, 0.0, (1.0, 1.0), 0.0), 0)


def candidate(x: float, y: float, sightings: int = 3) -> ObjectCandidate:
    """A candidate of one cell, seen from the robot's pose."""
    cell = (int(x / 0.1), int(y / 0.1))
    return ObjectCandidate((x, y, 0.5), frozenset({cell}), sightings, 0.9, 0.8, ((1.0, 1.0),))


def planner_state(*candidates: ObjectCandidate, active_time_s: float = 0.0) -> PlannerState:
    """A state at the beginning of a search, with these candidates."""
    return PlannerState(SEARCH, Evidence(candidates=candidates), active_time_s=active_time_s)


def context_of(view: SearchView, pose: Pose2d = POSE) -> PlanningContext:
    """The context of a robot at the pose that came from nowhere and ran into nothing."""
    return build_context(pose, view, PARAMS.costmap)


def standing(map_view: MapView, robot_xy: tuple[float, float]) -> PlanningContext:
    """The context of a robot at this place, on the map view as it is drawn."""
    pose, params = Pose2d(*robot_xy, 0.0), PARAMS.costmap
    costmap = costmap_of(map_view, robot_xy, params)
    x, y = costmap.grid.cells(np.array(robot_xy)).tolist()
    ways = cost_to_go_from(costmap.cost, (x, y), cell_size_m=CELL_M)
    return PlanningContext(pose, map_view, costmap, ways, params)


def context() -> PlanningContext:
    """The context at the robot's pose in the room."""
    return context_of(ROOM)


def explored(
    state: PlannerState, here: PlanningContext, how: Exploration = explore
) -> tuple[PlannerState, Motion, Event | None, SearchAreas]:
    """A copy of the state after exploring, and what was decided."""
    after = state.copy()
    move = how(after, here)
    return after, move.motion, move.event, move.areas


def decided(
    phase: Callable[..., Move], state: PlannerState, *inputs: Any
) -> tuple[PlannerState, Motion, Event | None]:
    """A copy of the state after a phase, and what was decided."""
    after = state.copy()
    move = phase(after, *inputs)
    return after, move.motion, move.event


def visited(*places: tuple[float, float]) -> Ledger:
    """A ledger with frontiers at these places, metres, that were seen in vain."""
    return Ledger(tuple(Attempt(GoalKind.FRONTIER, xy, xy) for xy in places))


def without(state: PlannerState, goal: Goal) -> PlannerState:
    """A copy of the state that has given this goal up."""
    after = state.copy()
    after.give_up(goal)
    return after


def rejecting(state: PlannerState, candidate: ObjectCandidate) -> PlannerState:
    """A copy of the state that has rejected this candidate."""
    after = state.copy()
    after.reject(candidate, "it is another thing")
    return after


def having_seen(
    state: PlannerState, frames: tuple[Detections, ...], here: PlanningContext
) -> PlannerState:
    """A copy of the state that has taken in these frames."""
    after, target = state.copy(), state.search.target
    others = found_under_other_names(state.found_objects, target, state.synonyms)
    update_evidence(after, frames, here, others)
    return after
