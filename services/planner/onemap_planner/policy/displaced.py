"""A robot that is not where it drove to: pushed, carried, or with a position that was wrong.

Its pose jumps farther than it can drive, or what its camera sees stands beside where the map has
it. It says so and stands still, until the map has seen the new place. Where the pose does not tell
of it, it then looks around before it goes on: floor that is out of view was that of another place.
"""

from __future__ import annotations

from dataclasses import replace
from math import hypot

from onemap_planner.motion.pure_pursuit import DriveParams
from onemap_planner.policy.memory import Displacement, PlannerState
from onemap_planner.policy.outcome import STAND, Move, Observation
from onemap_planner.search.state_machine import Displaced
from onemap_planner.sentences import beside_map, position_jumped

STANDS_S = 1.0  # four frames at 4 Hz: then the map has what is in view
JUMP_M = 0.3  # beyond what it can drive: corrections of a localisation that holds are smaller


def notice(state: PlannerState, observation: Observation, params: DriveParams) -> None:
    """Take in whether the robot was displaced since the last step, of which the state tells."""
    jumped_m, before = _jumped_m(state, observation, params), state.displacement
    unnoticed = observation.offset_m > 0
    if not jumped_m and not unnoticed:
        return
    why = beside_map(observation.offset_m) if unnoticed else position_jumped(jumped_m)
    unnoticed |= before is not None and before.unnoticed
    until_s = state.active_time_s + STANDS_S
    state.displacement, state.progress = Displacement(why, until_s, unnoticed), None


def _jumped_m(state: PlannerState, observation: Observation, params: DriveParams) -> float:
    """How far the pose jumped since the last step, metres; 0 if the robot can have driven that."""
    before, pose = state.pose, observation.pose
    if before is None or pose is None or state.last_step_s is None:
        return 0.0
    fastest_mps = hypot(params.max_linear_mps, params.max_lateral_mps)
    driven_m = fastest_mps * (observation.now_s - state.last_step_s)
    away_m = pose.distance_to(before.xy)
    return away_m if away_m > driven_m + JUMP_M else 0.0


def stand(state: PlannerState) -> Move | None:
    """What a robot does that was displaced; None if it was not, or goes on."""
    displacement = state.displacement
    if displacement is None:
        return None
    if state.active_time_s < displacement.until_s:
        state.search = replace(state.search, slow=displacement.why)
        return Move(STAND)
    state.displacement = None
    if not displacement.unnoticed:
        return None
    state.trail, state.memory.active_goal = (), None
    return Move(STAND, Displaced())
