"""Update of the object candidates from the detections that came since the last step."""

from __future__ import annotations

from dataclasses import replace

from onemap_planner.policy.competition import (
    conflicting_object,
    count_contradictions,
    found_under_other_names,
)
from onemap_planner.policy.context import PlanningContext
from onemap_planner.policy.near_views import with_near_view
from onemap_planner.policy.state import PlannerState
from onemap_planner.world.candidates import (
    ConsensusParams,
    ObjectCandidate,
    Sighting,
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
    *,
    near_m: float,
) -> PlannerState:
    """The state with the new sightings merged, without candidates that are a found object.

    near_m: metres within which a frame that does not show a candidate counts against it.
    """
    target_state = state.target_state
    for detections in frames:
        sightings = _sightings(state, detections, context, params)
        candidates = merge_sightings(
            target_state.candidates, (s for s in sightings if s.supported), params
        )
        candidates = count_contradictions(
            candidates,
            detections,
            [s for s in sightings if s.supported],
            target=state.search.target,
            map_view=context.map_view,
            params=params,
        )
        disputed = merge_sightings(
            target_state.disputed,
            (s for s in sightings if not _is_any(s, candidates, params) and not s.supported),
            params,
        )
        disputed = tuple(
            with_near_view(
                candidate,
                context,
                hit=any(is_same_object(candidate, sighting, params) for sighting in sightings),
                near_m=near_m,
            )
            for candidate in disputed
        )
        target_state = replace(target_state, candidates=candidates, disputed=disputed)
    others = found_under_other_names(state.found_objects, state.search.target, state.synonyms)
    free, disputed = (
        tuple(c for c in known if conflicting_object(c, others, context.map_view) is None)
        for known in (target_state.candidates, target_state.disputed)
    )
    return replace(state, target_state=replace(target_state, candidates=free, disputed=disputed))


def _sightings(
    state: PlannerState, detections: Detections, context: PlanningContext, params: ConsensusParams
) -> list[Sighting]:
    """The sightings of one frame; rejected candidates stay rejected."""
    return [
        sighting
        for sighting in sightings_of(
            state.search.target,
            detections,
            context.map_view,
            seen_from=context.pose.xy,
            params=params,
        )
        if not any(
            is_same_object(rejected, sighting, params)
            for rejected in state.target_state.rejected
            if rejected.supported or not sighting.supported
        )
    ]


def _is_any(
    sighting: Sighting, candidates: tuple[ObjectCandidate, ...], params: ConsensusParams
) -> bool:
    return any(is_same_object(candidate, sighting, params) for candidate in candidates)
