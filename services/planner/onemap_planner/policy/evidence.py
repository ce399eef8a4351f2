"""Update of the object candidates from the detections that came since the last step."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from math import dist

from onemap_planner.policy.competition import (
    conflicting_object,
    count_contradictions,
    found_under_other_names,
)
from onemap_planner.policy.context import PlanningContext
from onemap_planner.policy.near_views import with_near_view
from onemap_planner.policy.state import MAX_LOOKS, PlannerState, TargetState
from onemap_planner.policy.undetected_views import with_frame
from onemap_planner.world.candidates import (
    ConsensusParams,
    ObjectCandidate,
    Sighting,
    is_same_object,
    merge_sightings,
    sightings_of,
)
from onemap_shared.messages import Detections

OTHER_SIDE_M = 1.0  # from an earlier viewpoint: at 1 m from an object about 60 degrees


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
    for detections in frames:
        state = replace(state, target_state=_with_frame(state, detections, context, params, near_m))
    target_state = state.target_state
    others = found_under_other_names(state.found_objects, state.search.target, state.synonyms)
    free, disputed = (
        tuple(c for c in known if conflicting_object(c, others, context.map_view) is None)
        for known in (target_state.candidates, target_state.disputed)
    )
    return replace(state, target_state=replace(target_state, candidates=free, disputed=disputed))


def _with_frame(
    state: PlannerState,
    detections: Detections,
    context: PlanningContext,
    params: ConsensusParams,
    near_m: float,
) -> TargetState:
    """The target state after one frame.

    A detector that reads the map's features says nothing that the map does not know: what the map
    does not support is kept of an independent one only.
    """
    target_state, target = state.target_state, state.search.target
    seen = sightings_of(
        target, detections, context.map_view, seen_from=context.pose.xy, params=params
    )
    supported = [s for s in seen if s.supported and not _is_rejected(s, target_state, params)]
    candidates = count_contradictions(
        merge_sightings(target_state.candidates, supported, params),
        detections,
        supported,
        target=target,
        map_view=context.map_view,
        params=params,
    )
    undetected = with_frame(
        target_state.undetected,
        context,
        [sighting.cells for sighting in seen],
        threshold=params.floor,
    )
    target_state = replace(target_state, candidates=candidates, undetected=undetected)
    if not detections.independent:
        return target_state
    return replace(target_state, disputed=_disputed(target_state, seen, context, params, near_m))


def _disputed(
    target_state: TargetState,
    seen: Sequence[Sighting],
    context: PlanningContext,
    params: ConsensusParams,
    near_m: float,
) -> tuple[ObjectCandidate, ...]:
    """The candidates without the map's support after a frame of an independent detector.

    A sighting of a supported candidate is no other object, unless it was disputed before. From
    near, a frame counts for a candidate or against it.
    """
    doubtful = [
        sighting
        for sighting in seen
        if not sighting.supported
        and not _is_rejected(sighting, target_state, params)
        and (
            _is_any(sighting, target_state.disputed, params)
            or not _is_any(sighting, target_state.candidates, params)
        )
    ]
    return tuple(
        with_near_view(
            candidate,
            context,
            hit=any(is_same_object(candidate, sighting, params) for sighting in seen),
            near_m=near_m,
        )
        for candidate in merge_sightings(target_state.disputed, doubtful, params)
    )


def _is_rejected(sighting: Sighting, target_state: TargetState, params: ConsensusParams) -> bool:
    """Rejected candidates stay rejected, those with the map's support and those without.

    A supported one is taken up again when it is seen from a side from which it was not looked at.
    """
    same = (c for c in target_state.rejected if c.supported == sighting.supported)
    if not _is_any(sighting, same, params):
        return False
    if not sighting.supported:
        return True
    if _is_any(sighting, target_state.candidates, params):
        return False
    looks = [
        doubt.from_xy
        for doubt in target_state.doubts
        if dist(doubt.place_xyz, sighting.xyz) <= params.merge_m
    ]
    elsewhere = all(dist(xy, sighting.seen_from) > OTHER_SIDE_M for xy in looks)
    return not (elsewhere and 0 < len(looks) < MAX_LOOKS)


def _is_any(
    sighting: Sighting, candidates: Iterable[ObjectCandidate], params: ConsensusParams
) -> bool:
    return any(is_same_object(candidate, sighting, params) for candidate in candidates)
