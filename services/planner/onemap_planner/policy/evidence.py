"""Update of the object candidates from the detections that came since the last step."""

from __future__ import annotations

from dataclasses import replace

from onemap_planner.policy.competition import (
    conflicting_object,
    count_contradictions,
    found_under_other_names,
)
from onemap_planner.policy.context import PlanningContext
from onemap_planner.policy.state import PlannerState
from onemap_planner.world.candidates import (
    ConsensusParams,
    ObjectCandidate,
    is_same_object,
    merge_sightings,
    sightings_of,
)
from onemap_shared.messages import Detections


def update_candidates(
    state: PlannerState,
    frames: tuple[Detections, ...],
    context: PlanningContext,
    params: ConsensusParams,
) -> PlannerState:
    """The state with the new sightings merged, without candidates that are a found object."""
    candidates = state.target_state.candidates
    for detections in frames:
        candidates = _add_frame(candidates, detections, state, context, params)
    others = found_under_other_names(state.found_objects, state.search.target, state.synonyms)
    free = tuple(c for c in candidates if conflicting_object(c, others, context.map_view) is None)
    return replace(state, target_state=replace(state.target_state, candidates=free))


def _add_frame(
    candidates: tuple[ObjectCandidate, ...],
    detections: Detections,
    state: PlannerState,
    context: PlanningContext,
    params: ConsensusParams,
) -> tuple[ObjectCandidate, ...]:
    """The candidates after the detections of one frame; rejected ones stay rejected."""
    target, map_view = state.search.target, context.map_view
    sightings = [
        sighting
        for sighting in sightings_of(
            target, detections, map_view, seen_from=context.pose.xy, params=params
        )
        if not any(
            is_same_object(rejected, sighting, params) for rejected in state.target_state.rejected
        )
    ]
    candidates = merge_sightings(candidates, sightings, params)
    return count_contradictions(
        candidates, detections, sightings, target=target, map_view=map_view, params=params
    )
