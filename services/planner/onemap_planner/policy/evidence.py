"""Evidence about an object: what detections and near views say of its candidates."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from onemap_planner.motion.path import line_is_clear
from onemap_planner.policy.context import PlanningContext
from onemap_planner.policy.goals import VIEW_FARTHEST_M
from onemap_planner.policy.names import conflicting_object, count_contradictions
from onemap_planner.policy.state import Evidence, FoundObject, PlannerState
from onemap_planner.policy.viewpoints import own_cells, seen_from_side
from onemap_planner.world.candidates import (
    CERTAIN,
    MIN_SIGHTINGS,
    ObjectCandidate,
    Sighting,
    is_same_object,
    merge_sightings,
    probability,
    sightings_of,
    with_view,
)
from onemap_planner.world.map_view import MapView
from onemap_shared.messages import Detections

AHEAD_RAD = 0.5  # of the robot's heading: well inside the image of a camera of 70 degrees or more
LARGEST_M = 1.5  # from the middle of an object to its edge: half a bed and more
OTHER_NAME_MARGIN = 0.5  # of the similarity: between 0.75 and 0.25, say, nothing is weak


def with_near_view(
    candidate: ObjectCandidate, context: PlanningContext, *, hit: bool
) -> ObjectCandidate:
    """The candidate with this frame counted, if it is a near view of it.

    It is within ``VIEW_FARTHEST_M``, ahead of the robot, and no obstacle lies between, or it was
    seen from this side before.
    """
    pose, costmap = context.pose, context.costmap
    if candidate.distance_m((*pose.xy, 0.0)) > VIEW_FARTHEST_M + LARGEST_M:
        return candidate
    cells = context.map_view.indices_of(candidate.surface)
    if len(cells) == 0 or abs(pose.bearing_to(candidate.xyz[:2])) > AHEAD_RAD:
        return candidate
    here = context.cell_at(pose.xy)
    away = np.hypot(*(cells - here).T)
    if float(away.min()) * costmap.grid.cell_size_m > VIEW_FARTHEST_M:
        return candidate
    nearest, seen_from = cells[away.argmin()], costmap.grid.cells(np.asarray(candidate.seen_from))
    clear = ~costmap.occupied | own_cells(cells, costmap.grid.shape)
    if not (line_is_clear(clear, here, nearest) or seen_from_side(here, nearest, seen_from)):
        return candidate
    return replace(candidate, near_views=with_view(candidate.near_views, pose.xy, hit=hit))


def object_probability(candidate: ObjectCandidate, context: PlanningContext) -> float:
    """Probability that a candidate without the map's support is the object."""
    return probability(candidate.near_views, map_rank(candidate, context))


def likely_unsupported(
    candidates: Iterable[ObjectCandidate], context: PlanningContext
) -> list[tuple[ObjectCandidate, float]]:
    """Those without the map's support that are not certainly something else, with probability."""
    weighed = [(candidate, object_probability(candidate, context)) for candidate in candidates]
    return [(candidate, probable) for candidate, probable in weighed if probable > 1 - CERTAIN]


MAX_CANDIDATES_TRIED = 5  # candidates considered in one step, those with the most sightings


def agreed(state: PlannerState) -> list[ObjectCandidate]:
    """What was detected often enough where the map agrees."""
    often = [c for c in state.evidence.candidates if c.sightings >= MIN_SIGHTINGS]
    return often[:MAX_CANDIDATES_TRIED]


def against_map(
    state: PlannerState, context: PlanningContext
) -> list[tuple[ObjectCandidate, float]]:
    """What was detected, but not accepted because the map did not agree, the most probable first.

    Each with its probability; what is certainly something else is left out.
    """
    unsupported = [
        candidate
        for candidate in (*state.evidence.unsupported, *state.evidence.rejected)
        if not candidate.supported and candidate.sightings >= MIN_SIGHTINGS
    ]
    return sorted(likely_unsupported(unsupported, context), key=lambda pair: -pair[1])


def map_rank(candidate: ObjectCandidate, context: PlanningContext) -> float:
    """Median rank of its cells on the map, in [0, 1]; NaN where the map knows nothing.

    0 where another name of the search, or of a found object, is more similar by half or more:
    there the map says what it is.
    """
    cells = context.map_view.indices_of(candidate.surface)
    x, y = cells.T
    ranks, margins = context.map_view.guidance[x, y], context.map_view.margin[x, y]
    known = np.isfinite(ranks)
    if not known.any():
        return float("nan")
    if float(np.median(margins[known])) <= -OTHER_NAME_MARGIN:
        return 0.0
    return float(np.median(ranks[known]))


def update_evidence(
    state: PlannerState,
    frames: Iterable[Detections],
    context: PlanningContext,
    others: Sequence[FoundObject],
) -> None:
    """Take in what these frames show of the present object.

    others: found objects of other names, of which the candidates are none.
    """
    for detections in frames:
        _take_in(state, detections, context)
    evidence = state.evidence
    evidence.candidates, evidence.unsupported = (
        tuple(c for c in known if conflicting_object(c, others, context.map_view) is None)
        for known in (evidence.candidates, evidence.unsupported)
    )


def _take_in(state: PlannerState, detections: Detections, context: PlanningContext) -> None:
    """Take in one frame.

    A detector that reads the map's features says nothing that the map does not know: what the map
    does not support is kept of an independent one only.
    """
    evidence, target = state.evidence, state.search.target
    seen = _seen(target, detections, context.map_view, context)
    _take_in_anchors(evidence, detections, context)
    supported = [s for s in seen if s.supported and not _is_rejected(s, state)]
    evidence.candidates = count_contradictions(
        merge_sightings(evidence.candidates, supported),
        detections,
        supported,
        names=(target, *evidence.anchors),
        map_view=context.map_view,
    )
    if detections.independent:
        evidence.unsupported = _unsupported(state, seen, context)


def _seen(
    name: str, detections: Detections, map_view: MapView, context: PlanningContext
) -> tuple[Sighting, ...]:
    place, consensus = context.pose.xy, context.consensus
    return sightings_of(name, detections, map_view, seen_from=place, consensus=consensus)


def _take_in_anchors(evidence: Evidence, detections: Detections, context: PlanningContext) -> None:
    """Take in what a frame shows of the other things that the target's description names."""
    for name, similarity in context.description.anchors.items() if context.description else ():
        shown = replace(context.map_view, similarity=similarity)
        shown = replace(shown, margin=np.full_like(shown.margin, np.inf))
        seen = [s for s in _seen(name, detections, shown, context) if s.supported]
        evidence.anchors[name] = merge_sightings(evidence.anchors.get(name, ()), seen)


def _unsupported(
    state: PlannerState, seen: Sequence[Sighting], context: PlanningContext
) -> tuple[ObjectCandidate, ...]:
    """The candidates without the map's support after a frame of an independent detector.

    A sighting of a supported candidate is no other object, unless it had no support before. From
    near, a frame counts for a candidate or against it.
    """
    evidence = state.evidence
    doubtful = [
        sighting
        for sighting in seen
        if not sighting.supported
        and not _is_rejected(sighting, state)
        and (_is_any(sighting, evidence.unsupported) or not _is_any(sighting, evidence.candidates))
    ]
    return tuple(
        with_near_view(candidate, context, hit=any(is_same_object(candidate, s) for s in seen))
        for candidate in merge_sightings(evidence.unsupported, doubtful)
    )


def _is_rejected(sighting: Sighting, state: PlannerState) -> bool:
    """Rejected candidates stay rejected, those with the map's support and those without."""
    rejected = (c for c in state.evidence.rejected if c.supported == sighting.supported)
    return _is_any(sighting, rejected)


def _is_any(sighting: Sighting, candidates: Iterable[ObjectCandidate]) -> bool:
    return any(is_same_object(candidate, sighting) for candidate in candidates)
