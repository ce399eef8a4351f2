"""Take in what is new: time, pose, map, detections."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from onemap_planner.motion.progress import MotionSample, ProgressMonitor
from onemap_planner.policy.choose import can_follow, follow_window
from onemap_planner.policy.context import Bands, PlanningContext, build_context
from onemap_planner.policy.displaced import note_displacement
from onemap_planner.policy.evidence import update_evidence
from onemap_planner.policy.names import found_under_other_names
from onemap_planner.policy.outcome import Observation
from onemap_planner.policy.params import PlannerParams
from onemap_planner.policy.state import PlannerState
from onemap_planner.policy.tell import creeping_reason
from onemap_planner.policy.verify import sort_out
from onemap_planner.search.state_machine import MapRestarted
from onemap_planner.sentences import not_navigable
from onemap_planner.world.candidates import Consensus
from onemap_planner.world.costmap import BesideMap
from onemap_planner.world.description import Description, described
from onemap_planner.world.map_view import known_area_m2
from onemap_shared.conditions import things_of
from onemap_shared.geometry import F64, wrap_angle
from onemap_shared.messages import NO_DETAIL, Detail
from onemap_shared.places import Zones

CREEPS_S = 1.0  # of creeping before the search says why: less is a corner
MAX_STEP_PERIOD_S = 1.0  # active time counted for one step: a longer pause was no searching
# A map without an id whose known area falls below this part was begun again.
MAP_RESTART_FRACTION = 0.5


@dataclass(frozen=True, slots=True)
class TakenIn:
    """What a step works with: the context; how far the robot has turned left since the last step;
    and whether it got stuck just now."""

    context: PlanningContext
    turned_rad: float
    stuck: bool


def take_in(
    state: PlannerState, observation: Observation, params: PlannerParams, consensus: Consensus
) -> TakenIn | None:
    """Take in an observation; None while the inputs are stale or missing."""
    note_displacement(state, observation, params.drive)
    _advance_clock(state, observation, params)
    pose = observation.pose
    if observation.stale_reason or pose is None or observation.view is None:
        return None
    turned_rad = wrap_angle(pose.yaw_rad - (state.pose or pose).yaw_rad)
    state.move_to(pose)
    state.pose_ns = observation.pose_ns
    stuck = _check_progress(state, observation, params)
    context = _context(state, observation, params, follow_window(state, observation))
    if not context.whole and not can_follow(state, context):
        context = _context(state, observation, params, None)
    bands = Bands(params.explore.approach_farthest_m, observation.camera)
    context = replace(
        context,
        consensus=consensus,
        bands=bands,
        reached=observation.reached,
        description=_description(state.search.detail, observation, context),
    )
    state.appeared, state.cost_to_go = context.appeared, context.cost_to_go
    slow = creeping_reason(context) if state.crept_s >= CREEPS_S else ""
    slow = slow or (not_navigable(observation.refused.xy) if observation.refused else "")
    state.search = replace(state.search, slow=slow)
    _take_in_map(state, observation, context)
    return TakenIn(context, max(0.0, turned_rad), stuck)


def _advance_clock(state: PlannerState, observation: Observation, params: PlannerParams) -> None:
    """Active time passes only while the inputs are fresh.

    A second of creeping takes as much of a goal's time as its way does at full speed: else a door
    behind a metre of floor that no camera saw is given up halfway.
    """
    last_s, state.last_step_s = state.last_step_s, observation.now_s
    if observation.stale_reason:
        if state.stale_since_s is None:
            state.stale_since_s = observation.now_s
        return
    passed_s = 0.0 if last_s is None else observation.now_s - last_s
    passed_s = min(passed_s, MAX_STEP_PERIOD_S)
    state.crept_s = state.crept_s + passed_s if observation.creeps else 0.0
    if observation.creeps:
        drive = params.drive
        state.give_more_time(passed_s * (1 - drive.unseen_mps / drive.max_linear_mps))
    state.stale_since_s = None
    state.active_time_s += passed_s


def _check_progress(state: PlannerState, observation: Observation, params: PlannerParams) -> bool:
    """Update the progress monitor; whether the robot got stuck just now."""
    assert observation.pose is not None
    before, now_s = state.progress, state.active_time_s
    if before is None:
        state.progress = ProgressMonitor(observation.pose, now_s)
        return False
    sample = MotionSample(
        observation.pose, observation.command, observation.collided, now_s, observation.blocked
    )
    state.progress = before.update(sample, params.recovery)
    return state.progress.backing_from is not None and before.backing_from is None


def _context(
    state: PlannerState, observation: Observation, params: PlannerParams, window_xy: F64 | None
) -> PlanningContext:
    pose, view = observation.pose, observation.view
    assert pose is not None
    assert view is not None
    zones = Zones(observation.places, state.search.stay_out)
    trail_xy = np.array(state.trail, np.float64).reshape(-1, 2)
    looked_xy, closed_xy = state.ledger.looked_xy, state.ledger.closed_xy
    beside = BesideMap(
        trail_xy, state.obstacles_xy, zones, looked_into_xy=looked_xy, closed_xy=closed_xy
    )
    context = build_context(
        pose, view, params.costmap, beside, before=state.appeared, window_xy=window_xy
    )
    return replace(context, cost_to_go=context.cost_to_go.or_same(state.cost_to_go))


def _description(
    detail: Detail, observation: Observation, context: PlanningContext
) -> Description | None:
    """What is said of the object, on the whole map only; None if nothing is."""
    if detail == NO_DETAIL or not context.whole:
        return None
    views, places = observation.anchor_views, observation.places
    known = described(detail, views, places, context.map_view, context.pose.xy)
    if known is None:
        return None
    found = things_of(observation.finds, detail.anchors, context.map_view.grid)
    return replace(known, found=found)


def _take_in_map(state: PlannerState, observation: Observation, context: PlanningContext) -> None:
    """Take in the new detections; a map that was begun again resets what came from it."""
    known_m2, map_id = 0.0, ""
    if observation.view is not None:
        known_m2, map_id = known_area_m2(observation.view), observation.view.map_id
    begun_again = known_m2 < MAP_RESTART_FRACTION * state.known_m2
    if map_id and state.map_id:
        begun_again = map_id != state.map_id
    state.known_m2, state.map_id = known_m2, map_id
    if begun_again:
        state.forget_map()
        state.apply(MapRestarted(), observation.stamp(state.active_time_s))
        return
    frames, target = observation.detections, state.search.target
    if context.whole:
        state.ledger.offer_changed(context.map_view)
        others = found_under_other_names(state.found_objects, target, state.synonyms)
        state.evidence.candidates = state.evidence.supported
        update_evidence(state, frames, context, others)
        sort_out(state, context)
