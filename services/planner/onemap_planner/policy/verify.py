"""Approaching and confirming: walk up to a candidate and make sure."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from onemap_planner.motion.motions import Drive, Motion, Rest
from onemap_planner.motion.pure_pursuit import arrived
from onemap_planner.policy.context import PlanningContext
from onemap_planner.policy.params import ExploreParams, PlannerParams
from onemap_planner.policy.state import PlannerState
from onemap_planner.policy.viewpoints import first_visible, least_occluded, viewpoints_around
from onemap_planner.search.phases import (
    Approaching,
    Arrived,
    Confirmed,
    Confirming,
    Event,
    Rejected,
)
from onemap_planner.world.candidates import ConsensusParams, ObjectCandidate
from onemap_planner.world.costmap import Costmap
from onemap_shared.geometry import I64


def find_viewpoint(
    candidate: ObjectCandidate, context: PlanningContext, params: ExploreParams
) -> tuple[float, float] | None:
    """Where (metres) to stand before the candidate; None if nowhere can be reached."""
    cells = context.map_view.indices_of(candidate.surface)
    if len(cells) == 0:
        return None
    costmap, cost_to_go = context.costmap, context.cost_to_go
    cells = _occupied_only(cells, costmap)
    seen_from = costmap.grid.cells(np.asarray(candidate.seen_from))
    viewpoint = None
    for farthest_m in (params.approach_farthest_m, params.approach_last_resort_m):
        band_m = (params.approach_nearest_m, farthest_m)
        around = viewpoints_around(cells, costmap, cost_to_go, band_m=band_m, tried=cells[:0])
        viewpoint = first_visible(around, seen_from)
        if viewpoint is not None:
            break
    else:
        viewpoint = least_occluded(around)
    if viewpoint is None:
        return None
    x, y = costmap.grid.centres(viewpoint)
    return float(x), float(y)


def _occupied_only(cells: I64, costmap: Costmap) -> I64:
    """The cells (K, 2) in which something stands, all of them if none does.

    A detection's rim covers floor before the thing; it must not be taken for its surface.
    """
    solid = cells[costmap.occupied[cells[:, 0], cells[:, 1]]]
    return solid if len(solid) else cells


def approach(
    state: PlannerState, phase: Approaching, context: PlanningContext, params: PlannerParams
) -> tuple[PlannerState, Motion, Event | None]:
    """Walk up to the candidate, which later sightings may move."""
    candidate = latest_candidate(state, phase.candidate, params.consensus)
    viewpoint_xy = find_viewpoint(candidate, context, params.explore)
    if viewpoint_xy is None:
        return _wait_for_path(state, candidate, params)
    state = replace(state, target_state=replace(state.target_state, idle_since_s=None))
    look_xy = (candidate.xyz[0], candidate.xyz[1])
    motion = context.drive_to(viewpoint_xy, look_xy)
    if arrived(motion, context.pose, params.drive):
        return state, motion, Arrived(candidate)
    return state, motion, None


def confirm(
    state: PlannerState, phase: Confirming, context: PlanningContext, params: PlannerParams
) -> tuple[PlannerState, Motion, Event | None]:
    """Stand still, face the candidate and count the detections that agree."""
    candidate = latest_candidate(state, phase.candidate, params.consensus)
    motion = Drive(np.array([context.pose.xy]), (candidate.xyz[0], candidate.xyz[1]))
    agreeing = candidate.sightings - phase.candidate.sightings
    contradictions = candidate.contradictions - phase.candidate.contradictions
    if agreeing >= params.explore.confirm_sightings and agreeing > contradictions:
        return state, Rest(), Confirmed(candidate)
    if state.active_time_s - phase.since_s > params.explore.confirm_s:
        return reject_candidate(state, candidate), Rest(), Rejected()
    return state, motion, None


def latest_candidate(
    state: PlannerState, candidate: ObjectCandidate, params: ConsensusParams
) -> ObjectCandidate:
    """What has become of the candidate: the remembered one at the same place."""
    for known in state.target_state.candidates:
        if not known.cells.isdisjoint(candidate.cells):
            return known
    near = [
        c for c in state.target_state.candidates if c.distance_m(candidate.xyz) <= params.merge_m
    ]
    return near[0] if near else candidate


def reject_candidate(state: PlannerState, candidate: ObjectCandidate) -> PlannerState:
    """The mind that no longer believes in the candidate, nor in new sightings of it."""
    target_state = state.target_state
    left = tuple(c for c in target_state.candidates if c.cells.isdisjoint(candidate.cells))
    return replace(
        state,
        target_state=replace(
            target_state,
            candidates=left,
            rejected=(*target_state.rejected, candidate),
            idle_since_s=None,
        ),
    )


def _wait_for_path(
    state: PlannerState, candidate: ObjectCandidate, params: PlannerParams
) -> tuple[PlannerState, Motion, Event | None]:
    """The map may have hidden the way for a moment only."""
    since_s = state.target_state.idle_since_s
    if since_s is None:
        since_s = state.active_time_s
    if state.active_time_s - since_s > params.explore.settle_s:
        return reject_candidate(state, candidate), Rest(), Rejected()
    return (
        replace(state, target_state=replace(state.target_state, idle_since_s=since_s)),
        Rest(),
        None,
    )
