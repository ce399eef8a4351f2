"""Verification of a candidate: approach it, then confirm it with new detections."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from onemap_planner.motion.motions import Drive, Motion, Rest
from onemap_planner.motion.pure_pursuit import arrived
from onemap_planner.policy.context import PlanningContext
from onemap_planner.policy.evidence import object_probability
from onemap_planner.policy.params import PlannerParams
from onemap_planner.policy.state import (
    MAX_LOOKS,
    PlannerState,
    latest_candidate,
    reject_candidate,
    with_doubt,
)
from onemap_planner.policy.tried_viewpoints import (
    doubted_from,
    exhausted_viewpoints,
    next_viewpoint,
)
from onemap_planner.policy.viewpoints import find_viewpoint, surface_distance_m
from onemap_planner.search.events import Arrived, CandidateSelected, Confirmed, Event, Rejected
from onemap_planner.search.phases import Approaching, Confirming
from onemap_planner.world.candidates import ObjectCandidate


def approach(
    state: PlannerState, phase: Approaching, context: PlanningContext, params: PlannerParams
) -> tuple[PlannerState, Motion, Event | None]:
    """Drive to the viewpoint of the candidate, whose position later sightings refine."""
    candidate = latest_candidate(state, phase.candidate, params.consensus)
    viewpoint_xy = next_viewpoint(state, candidate, context, params)
    if viewpoint_xy is None:
        return _wait_for_path(state, candidate, context, params)
    state = replace(state, target_state=replace(state.target_state, idle_since_s=None))
    look_xy = (candidate.xyz[0], candidate.xyz[1])
    motion = context.drive_to(viewpoint_xy, look_xy)
    if arrived(motion, context.pose, params.drive):
        return state, motion, Arrived(candidate)
    return state, motion, None


def confirm(
    state: PlannerState, phase: Confirming, context: PlanningContext, params: PlannerParams
) -> tuple[PlannerState, Motion, Event | None]:
    """Face the candidate and count the new detections that agree."""
    candidate = latest_candidate(state, phase.candidate, params.consensus)
    motion = Drive(np.array([context.pose.xy]), (candidate.xyz[0], candidate.xyz[1]))
    if not candidate.supported:
        state, event = _weigh(state, phase, candidate, context, params)
        return state, motion, event
    agreeing = candidate.sightings - phase.candidate.sightings
    contradictions = candidate.contradictions - phase.candidate.contradictions
    if agreeing >= params.explore.confirm_sightings and agreeing > contradictions:
        return state, Rest(), _sure(state, candidate, context, params)
    if state.active_time_s - phase.since_s > params.explore.confirm_s:
        state, event = _doubt(state, candidate, context, params)
        return state, Rest(), event
    return state, motion, None


def _doubt(
    state: PlannerState, candidate: ObjectCandidate, context: PlanningContext, params: PlannerParams
) -> tuple[PlannerState, Event]:
    """Look at an unconfirmed candidate from another side, or reject it.

    What stands behind a corner is not detected from where the map, which is flat and blurred,
    shows a free line of sight.
    """
    state = with_doubt(state, candidate, context.pose.xy)
    tried = doubted_from(state, candidate, params)
    similar = candidate.similarity >= params.region.threshold
    if similar and len(tried) < MAX_LOOKS:
        elsewhere = find_viewpoint(candidate, context, params.explore.bands_m, tried)
        if elsewhere is not None:
            return state, CandidateSelected(candidate)
    return reject_candidate(state, candidate), Rejected()


def _sure(
    state: PlannerState, candidate: ObjectCandidate, context: PlanningContext, params: PlannerParams
) -> Event:
    """It is the object: confirmed if it is in reach, else the robot goes nearer.

    New sightings may have shown that its near edge is farther away than it seemed from afar.
    Where it was not confirmed from before, the robot does not go again.
    """
    tried = doubted_from(state, candidate, params)
    nearer_xy = find_viewpoint(candidate, context, params.explore.bands_m, tried)
    arrive_m = 1.2 * params.drive.arrive_m
    limit_m = params.explore.approach_last_resort_m + arrive_m
    if nearer_xy is None or surface_distance_m(candidate, context) <= limit_m:
        return Confirmed(candidate)
    there = context.pose.distance_to(nearer_xy) <= arrive_m
    return Confirmed(candidate) if there else CandidateSelected(candidate)


def _weigh(
    state: PlannerState,
    phase: Confirming,
    candidate: ObjectCandidate,
    context: PlanningContext,
    params: PlannerParams,
) -> tuple[PlannerState, Event | None]:
    """Decide about a candidate that the map does not support, or look from another side."""
    certain = params.acceptance.certain
    is_object = object_probability(candidate, context, params.acceptance)
    if is_object >= certain:
        return state, _sure(state, candidate, context, params)
    undecided = is_object > 1 - certain
    if undecided and state.active_time_s - phase.since_s <= params.explore.confirm_s:
        return state, None
    tried = exhausted_viewpoints(candidate, params)
    seen = _telling(candidate, params) > _telling(phase.candidate, params)
    bands_m = params.explore.bands_m
    if undecided and seen and find_viewpoint(candidate, context, bands_m, tried) is not None:
        return state, CandidateSelected(candidate)
    return reject_candidate(state, candidate), Rejected()


def _telling(candidate: ObjectCandidate, params: PlannerParams) -> int:
    """Near views that tell something: from each place, up to ``views_per_viewpoint``."""
    most = params.acceptance.views_per_viewpoint
    return sum(min(tally.frames, most) for tally in candidate.near_views)


def _wait_for_path(
    state: PlannerState, candidate: ObjectCandidate, context: PlanningContext, params: PlannerParams
) -> tuple[PlannerState, Motion, Event | None]:
    """Leave the candidate only after ``settle_s``: the map may lose a path for a moment."""
    since_s = state.target_state.idle_since_s
    if since_s is None:
        since_s = state.active_time_s
    if state.active_time_s - since_s > params.explore.settle_s:
        return _leave(state, candidate, context, params), Rest(), Rejected()
    return (
        replace(state, target_state=replace(state.target_state, idle_since_s=since_s)),
        Rest(),
        None,
    )


def _leave(
    state: PlannerState, candidate: ObjectCandidate, context: PlanningContext, params: PlannerParams
) -> PlannerState:
    """Without a way to a candidate of the map, keep it until there is one; else reject it.

    Somebody who stands in a door closes the way for a moment. ``dead_end.returns`` limits how often
    that is believed.
    """
    closed = find_viewpoint(candidate, context, params.explore.bands_m) is None
    before = state.target_state.closed_off
    times = sum(candidate.distance_m(xyz) <= params.consensus.merge_m for xyz in before)
    if not (candidate.supported and closed and times < params.dead_end.returns):
        return reject_candidate(state, candidate)
    closed_off = (*before, candidate.xyz)
    target_state = replace(state.target_state, idle_since_s=None, closed_off=closed_off)
    return replace(state, target_state=target_state)
