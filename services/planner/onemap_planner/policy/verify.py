"""Verification of a candidate: approach it, then confirm it with new detections."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from onemap_planner.motion.motions import Drive
from onemap_planner.motion.pure_pursuit import ARRIVE_M
from onemap_planner.policy.arrival import ArrivalState, arrive, comes_no_nearer, stands_at
from onemap_planner.policy.context import APPROACH_LAST_RESORT_M, APPROACH_LIMIT_M, PlanningContext
from onemap_planner.policy.evidence import object_probability
from onemap_planner.policy.find_check import check_find
from onemap_planner.policy.goals import detection_goal
from onemap_planner.policy.ledger import MAX_LOOKS
from onemap_planner.policy.outcome import Move
from onemap_planner.policy.state import SETTLE_S, PlannerState
from onemap_planner.policy.tell import explain_candidate, other_object
from onemap_planner.policy.viewpoints import find_viewpoint, surface_distance_m
from onemap_planner.search import state_machine as sm
from onemap_planner.sentences import NO_WAY_TO, NOT_CONFIRMED
from onemap_planner.world.candidates import (
    CERTAIN,
    MIN_SIGHTINGS,
    VIEWS_PER_VIEWPOINT,
    ObjectCandidate,
)
from onemap_shared.messages import NO_DETAIL, Holds, all_hold, evidence_for, evidence_missing

# Agreeing detections while standing before it: a third of the frames. What the detector takes for
# the object from afar flickers when seen from near.
CONFIRM_SIGHTINGS = 6
CONFIRM_S = 5.0  # seconds to wait for them: 20 frames at the slowest useful rate of 4 Hz


def approach(state: PlannerState, phase: sm.Approaching, context: PlanningContext) -> Move:
    """Drive to the viewpoint of the candidate, whose position later sightings refine.

    Without a viewpoint it is left after ``SETTLE_S``: the map may lose a path for a moment.
    """
    candidate = state.evidence.latest(phase.candidate)
    if state.evidence.is_mismatched(candidate):
        return Move(event=sm.Rejected())
    viewpoint_xy = state.ledger.next_viewpoint(candidate, context)
    if viewpoint_xy is None:
        if state.idle_s() <= SETTLE_S:
            return Move()
        closed = candidate.supported and find_viewpoint(candidate, context) is None
        if not closed:  # by what came into the way: it is kept until there is one
            state.reject(candidate, NO_WAY_TO)
        state.idle_since_s = None
        return Move(event=sm.Rejected())
    state.idle_since_s = None
    at, motion = arrive(context.drive_to(viewpoint_xy, candidate.xyz[:2]), context)
    there = at is ArrivalState.THERE
    if there and context.reached and surface_distance_m(candidate, context) > APPROACH_LIMIT_M:
        there = False
        at = ArrivalState.NO_VIEW if comes_no_nearer(viewpoint_xy, context) else at
    if at is ArrivalState.NO_VIEW:
        state.ledger.looked_in_vain(candidate, viewpoint_xy)
        return Move()
    goal = detection_goal(candidate, candidate.similarity, viewpoint_xy, context)
    around = state.landmarks(context)
    state.search = explain_candidate(state.search, goal, candidate.sightings, around)
    return Move(motion, sm.Arrived(candidate) if there else None)


def confirm(state: PlannerState, phase: sm.Confirming, context: PlanningContext) -> Move:
    """Confirm the candidate, and check that it is as described."""
    move = _confirm(state, phase, context)
    if not isinstance(move.event, sm.Confirmed):
        return move
    if context.description is None and state.search.detail != NO_DETAIL:
        return replace(move, event=None)  # without the views of its anchors nothing is checked
    return replace(move, event=_checked(state, move.event.candidate, context))


def _checked(state: PlannerState, candidate: ObjectCandidate, context: PlanningContext) -> sm.Event:
    """The confirmed candidate is found, set aside, or found as another object of the name."""
    evidence = state.evidence
    conditions = check_find(candidate, context, evidence, state.found_objects)
    holds = all_hold(conditions)
    if holds is Holds.YES:
        return sm.Confirmed(candidate, evidence_for(conditions))
    if evidence.takes_any or holds is Holds.NOT_KNOWN:
        return other_object(state, candidate, conditions)
    evidence.other_finds = (*evidence.other_finds, candidate)
    why = "; ".join(evidence_missing(conditions))
    if candidate.supported:
        evidence.mismatched = (*evidence.mismatched, candidate)
        evidence.candidates = tuple(c for c in evidence.candidates if c is not candidate)
        state.pass_by(candidate, why)
    else:
        state.reject(candidate, why)
    return sm.Rejected()


def sort_out(state: PlannerState, context: PlanningContext) -> None:
    """Set candidates aside that are not as described, and those that were confirmed in vain.

    Those that are not checked are left to exploration, which looks at them more closely.
    """
    evidence = state.evidence
    if context.description is None or evidence.takes_any:
        return
    sorted_out: dict[Holds, list[ObjectCandidate]] = {each: [] for each in Holds}
    sorted_out[Holds.NOT_KNOWN] = sorted_out[Holds.YES]  # nothing will tell: it is walked up to
    for candidate in evidence.candidates:
        conditions = check_find(candidate, context, evidence, state.found_objects)
        holds = all_hold(conditions)
        if candidate.sightings >= MIN_SIGHTINGS:
            why = "; ".join(evidence_missing(conditions)) if holds is Holds.NO else ""
            state.pass_by(candidate, why)
        tried = any(not other.cells.isdisjoint(candidate.cells) for other in evidence.other_finds)
        sorted_out[Holds.NO if holds is Holds.NOT_CHECKED and tried else holds].append(candidate)
    evidence.candidates = tuple(sorted_out[Holds.YES])
    evidence.unclear = tuple(sorted_out[Holds.NOT_CHECKED])
    evidence.mismatched = tuple(sorted_out[Holds.NO])


def _confirm(state: PlannerState, phase: sm.Confirming, context: PlanningContext) -> Move:
    """Face the candidate and count the new detections that agree."""
    waited_s = state.active_time_s - phase.since_s
    candidate = state.evidence.latest(phase.candidate)
    motion = Drive(np.array([context.pose.xy]), candidate.xyz[:2])
    if not candidate.supported:
        return Move(motion, _weigh(state, phase.candidate, candidate, context, waited_s))
    before = phase.candidate
    agreeing = candidate.sightings - before.sightings
    contradictions = candidate.contradictions - phase.candidate.contradictions
    if agreeing >= CONFIRM_SIGHTINGS and agreeing > contradictions:
        return Move(event=_sure(state, candidate, context))
    if waited_s > CONFIRM_S:
        return Move(event=_look_elsewhere(state, candidate, context))
    return Move(motion)


def _look_elsewhere(
    state: PlannerState, candidate: ObjectCandidate, context: PlanningContext
) -> sm.Event:
    """Look at an unconfirmed candidate from another side, or reject it.

    What stands behind a corner is not detected from where the map, which is flat and blurred,
    shows a free line of sight.
    """
    state.ledger.looked_in_vain(candidate, context.pose.xy)
    tried = state.ledger.looked_from(candidate.xyz[:2])
    if len(tried) < MAX_LOOKS and find_viewpoint(candidate, context, tried) is not None:
        return sm.CandidateSelected(candidate)
    state.reject(candidate, NOT_CONFIRMED)
    return sm.Rejected()


def _sure(state: PlannerState, candidate: ObjectCandidate, context: PlanningContext) -> sm.Event:
    """It is the object: confirmed if it is in reach, else the robot goes nearer.

    New sightings may have shown that its near edge is farther away than it seemed from afar.
    Where it was not confirmed from before, the robot does not go again.
    """
    nearer_xy = find_viewpoint(candidate, context, state.ledger.looked_from(candidate.xyz[:2]))
    limit_m = APPROACH_LAST_RESORT_M + 1.2 * ARRIVE_M
    if nearer_xy is None or surface_distance_m(candidate, context) <= limit_m:
        return sm.Confirmed(candidate)
    return (
        sm.Confirmed(candidate)
        if stands_at(nearer_xy, context)
        else sm.CandidateSelected(candidate)
    )


def _weigh(
    state: PlannerState,
    before: ObjectCandidate,
    candidate: ObjectCandidate,
    context: PlanningContext,
    waited_s: float,
) -> sm.Event | None:
    """Decide about a candidate that the map does not support, or look from another side.

    before: as it was known on arrival, ``waited_s`` ago.
    """
    is_object = object_probability(candidate, context)
    if is_object >= CERTAIN:
        return _sure(state, candidate, context)
    if is_object > 1 - CERTAIN:
        if waited_s <= CONFIRM_S:
            return None
        tried = candidate.exhausted_viewpoints
        seen = _telling(candidate) > _telling(before)
        if seen and find_viewpoint(candidate, context, tried) is not None:
            return sm.CandidateSelected(candidate)
    state.reject(candidate, NOT_CONFIRMED)
    return sm.Rejected()


def _telling(candidate: ObjectCandidate) -> int:
    """Near views that tell something: from each place, up to ``VIEWS_PER_VIEWPOINT``."""
    return sum(min(tally.frames, VIEWS_PER_VIEWPOINT) for tally in candidate.near_views)
