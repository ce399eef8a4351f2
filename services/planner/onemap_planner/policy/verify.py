"""Verification of a candidate: approach it, then confirm it with new detections."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from onemap_planner.motion.motions import Drive, Motion, Rest
from onemap_planner.motion.pure_pursuit import ARRIVE_M, arrived
from onemap_planner.policy.context import APPROACH_LAST_RESORT_M, PlanningContext
from onemap_planner.policy.dead_ends import DEAD_END_RETURNS
from onemap_planner.policy.evidence import object_probability
from onemap_planner.policy.state import (
    MAX_LOOKS,
    SETTLE_S,
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
from onemap_planner.world.candidates import CERTAIN, MERGE_M, VIEWS_PER_VIEWPOINT, ObjectCandidate
from onemap_planner.world.regions import SIMILAR

# Agreeing detections while standing before it: a third of the frames. What the detector takes for
# the object from afar flickers when seen from near.
CONFIRM_SIGHTINGS = 6
CONFIRM_S = 5.0  # seconds to wait for them: 20 frames at the slowest useful rate of 4 Hz


def approach(
    state: PlannerState, phase: Approaching, context: PlanningContext
) -> tuple[PlannerState, Motion, Event | None]:
    """Drive to the viewpoint of the candidate, whose position later sightings refine."""
    candidate = latest_candidate(state, phase.candidate)
    viewpoint_xy = next_viewpoint(state, candidate, context)
    if viewpoint_xy is None:
        return _wait_for_path(state, candidate, context)
    state = replace(state, target_state=replace(state.target_state, idle_since_s=None))
    look_xy = (candidate.xyz[0], candidate.xyz[1])
    motion = context.drive_to(viewpoint_xy, look_xy)
    if arrived(motion, context.pose):
        return state, motion, Arrived(candidate)
    return state, motion, None


def confirm(
    state: PlannerState, phase: Confirming, context: PlanningContext
) -> tuple[PlannerState, Motion, Event | None]:
    """Face the candidate and count the new detections that agree."""
    candidate = latest_candidate(state, phase.candidate)
    motion = Drive(np.array([context.pose.xy]), (candidate.xyz[0], candidate.xyz[1]))
    if not candidate.supported:
        state, event = _weigh(state, phase, candidate, context)
        return state, motion, event
    agreeing = candidate.sightings - phase.candidate.sightings
    contradictions = candidate.contradictions - phase.candidate.contradictions
    if agreeing >= CONFIRM_SIGHTINGS and agreeing > contradictions:
        return state, Rest(), _sure(state, candidate, context)
    if state.active_time_s - phase.since_s > CONFIRM_S:
        state, event = _doubt(state, candidate, context)
        return state, Rest(), event
    return state, motion, None


def _doubt(
    state: PlannerState, candidate: ObjectCandidate, context: PlanningContext
) -> tuple[PlannerState, Event]:
    """Look at an unconfirmed candidate from another side, or reject it.

    What stands behind a corner is not detected from where the map, which is flat and blurred,
    shows a free line of sight.
    """
    state = with_doubt(state, candidate, context.pose.xy)
    tried = doubted_from(state, candidate)
    similar = candidate.similarity >= SIMILAR
    if similar and len(tried) < MAX_LOOKS:
        elsewhere = find_viewpoint(candidate, context, tried)
        if elsewhere is not None:
            return state, CandidateSelected(candidate)
    return reject_candidate(state, candidate), Rejected()


def _sure(state: PlannerState, candidate: ObjectCandidate, context: PlanningContext) -> Event:
    """It is the object: confirmed if it is in reach, else the robot goes nearer.

    New sightings may have shown that its near edge is farther away than it seemed from afar.
    Where it was not confirmed from before, the robot does not go again.
    """
    tried = doubted_from(state, candidate)
    nearer_xy = find_viewpoint(candidate, context, tried)
    arrive_m = 1.2 * ARRIVE_M
    limit_m = APPROACH_LAST_RESORT_M + arrive_m
    if nearer_xy is None or surface_distance_m(candidate, context) <= limit_m:
        return Confirmed(candidate)
    there = context.pose.distance_to(nearer_xy) <= arrive_m
    return Confirmed(candidate) if there else CandidateSelected(candidate)


def _weigh(
    state: PlannerState, phase: Confirming, candidate: ObjectCandidate, context: PlanningContext
) -> tuple[PlannerState, Event | None]:
    """Decide about a candidate that the map does not support, or look from another side."""
    certain = CERTAIN
    is_object = object_probability(candidate, context)
    if is_object >= certain:
        return state, _sure(state, candidate, context)
    undecided = is_object > 1 - certain
    if undecided and state.active_time_s - phase.since_s <= CONFIRM_S:
        return state, None
    tried = exhausted_viewpoints(candidate)
    seen = _telling(candidate) > _telling(phase.candidate)
    if undecided and seen and find_viewpoint(candidate, context, tried) is not None:
        return state, CandidateSelected(candidate)
    return reject_candidate(state, candidate), Rejected()


def _telling(candidate: ObjectCandidate) -> int:
    """Near views that tell something: from each place, up to ``views_per_viewpoint``."""
    most = VIEWS_PER_VIEWPOINT
    return sum(min(tally.frames, most) for tally in candidate.near_views)


def _wait_for_path(
    state: PlannerState, candidate: ObjectCandidate, context: PlanningContext
) -> tuple[PlannerState, Motion, Event | None]:
    """Leave the candidate only after ``settle_s``: the map may lose a path for a moment."""
    since_s = state.target_state.idle_since_s
    if since_s is None:
        since_s = state.active_time_s
    if state.active_time_s - since_s > SETTLE_S:
        return _leave(state, candidate, context), Rest(), Rejected()
    return (
        replace(state, target_state=replace(state.target_state, idle_since_s=since_s)),
        Rest(),
        None,
    )


def _leave(
    state: PlannerState, candidate: ObjectCandidate, context: PlanningContext
) -> PlannerState:
    """Without a way to a candidate of the map, keep it until there is one; else reject it.

    Somebody who stands in a door closes the way for a moment. ``dead_end.returns`` limits how often
    that is believed.
    """
    closed = find_viewpoint(candidate, context) is None
    before = state.target_state.closed_off
    times = sum(candidate.distance_m(xyz) <= MERGE_M for xyz in before)
    if not (candidate.supported and closed and times < DEAD_END_RETURNS):
        return reject_candidate(state, candidate)
    closed_off = (*before, candidate.xyz)
    target_state = replace(state.target_state, idle_since_s=None, closed_off=closed_off)
    return replace(state, target_state=target_state)
