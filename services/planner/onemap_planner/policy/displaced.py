"""A robot that is not where it drove to: pushed, carried, or with a position that was wrong.

Its pose jumps farther than it can drive or turn, or what its camera sees stands beside where the
map has it. It says so and stands still, until the map has seen the new place. Where the pose does
not tell of it, it then looks around before it goes on: floor that is out of view was that of
another place. It does not return to where it set out: that was told in the frame of before.
"""

from __future__ import annotations

from dataclasses import replace
from math import degrees, hypot

from onemap_planner.motion.pure_pursuit import DriveParams
from onemap_planner.policy.outcome import STAND, Move, Observation
from onemap_planner.policy.state import Displacement, PlannerState
from onemap_planner.search.state_machine import Displaced, Ending
from onemap_planner.sentences import START_LOST, beside_map, pose_jumped
from onemap_shared.geometry import wrap_angle
from onemap_shared.messages import SearchState

STANDS_S = 1.0  # four frames at 4 Hz: then the map has what is in view
# Beyond what it can drive and turn: corrections of a localisation that holds are smaller.
JUMP_M = 0.3
JUMP_RAD = 0.5
LAG_S = 1.0  # between two poses: without commands for longer, the robot stands


def note_displacement(state: PlannerState, observation: Observation, params: DriveParams) -> None:
    """Take in whether the robot was displaced since the last step, of which the state tells."""
    jumped, before = _jumped(state, observation, params), state.displacement
    unnoticed = observation.offset_m > 0
    if not jumped and not unnoticed:
        return
    why = beside_map(observation.offset_m) if unnoticed else jumped
    unnoticed |= before is not None and before.unnoticed
    until_s = state.active_time_s + STANDS_S
    state.displacement, state.progress = Displacement(why, until_s, unnoticed), None
    state.search = replace(state.search, start_lost=True)


def _jumped(state: PlannerState, observation: Observation, params: DriveParams) -> str:
    """How the pose jumped since the last step; empty if the robot can have driven that."""
    before, pose = state.pose, observation.pose
    if before is None or pose is None or state.last_step_s is None:
        return ""
    passed_s = observation.now_s - state.last_step_s
    if state.pose_ns and observation.pose_ns:  # since a pose that was older than its step
        between_s = (observation.pose_ns - state.pose_ns) * 1e-9
        passed_s = max(passed_s, min(between_s, LAG_S))
    fastest_mps = hypot(params.max_linear_mps, params.max_lateral_mps)
    away_m = pose.distance_to(before.xy)
    if away_m > fastest_mps * passed_s + JUMP_M:
        return pose_jumped("position", f"{away_m:.1f} m")
    turned_rad = abs(wrap_angle(pose.yaw_rad - before.yaw_rad))
    if turned_rad > params.max_angular_radps * passed_s + JUMP_RAD:
        return pose_jumped("heading", f"{degrees(turned_rad):.0f} degrees")
    return ""


def stand_if_displaced(state: PlannerState) -> Move | None:
    """What a robot does that was displaced; None if it was not, or goes on."""
    displacement = state.displacement
    if displacement is None:
        return None
    if state.active_time_s < displacement.until_s:
        state.search = replace(state.search, slow=displacement.why)
        return Move(STAND)
    state.displacement = None
    if state.search.way_back is not None:
        return Move(STAND, Ending(SearchState.FAILED, START_LOST))
    if not displacement.unnoticed:
        return None
    state.trail, state.active_goal = (), None
    return Move(STAND, Displaced())
