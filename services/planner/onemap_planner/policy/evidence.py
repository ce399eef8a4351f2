"""Update of the object candidates from the detections that came since the last step."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from math import dist

import numpy as np

from onemap_planner.motion.path import line_is_clear
from onemap_planner.policy.competition import (
    conflicting_object,
    count_contradictions,
    found_under_other_names,
)
from onemap_planner.policy.context import PlanningContext
from onemap_planner.policy.state import MAX_LOOKS, PlannerState, TargetState
from onemap_planner.policy.viewpoints import own_cells, seen_from_side
from onemap_planner.search.events import Confirmed, Event
from onemap_planner.search.phases import Search
from onemap_planner.world.candidates import (
    MERGE_M,
    ObjectCandidate,
    Sighting,
    is_same_object,
    merge_sightings,
    probability,
    sightings_of,
    with_view,
)
from onemap_planner.world.map_view import WorldCells, components
from onemap_planner.world.regions import UndetectedViews
from onemap_shared.geometry import I64, wrap_angle
from onemap_shared.grid import GridSpec
from onemap_shared.messages import Detections, ObjectFind

AHEAD_RAD = 0.5  # of the robot's heading: well inside the image of a camera of 70 degrees or more
LARGEST_M = 1.5  # from the middle of an object to its edge: half a bed and more
OTHER_NAME_MARGIN = 0.5  # of the similarity: between 0.75 and 0.25, say, nothing is weak


def with_near_view(
    candidate: ObjectCandidate, context: PlanningContext, *, hit: bool, near_m: float
) -> ObjectCandidate:
    """The candidate with this frame counted, if it is a near view of it.

    It is within ``near_m`` metres, ahead of the robot, and in sight over the map.
    """
    pose, grid = context.pose, context.costmap.grid
    if candidate.distance_m((*pose.xy, 0.0)) > near_m + LARGEST_M:
        return candidate
    cells = context.map_view.indices_of(candidate.surface)
    if len(cells) == 0:
        return candidate
    here = grid.cells(np.asarray(pose.xy))
    away = np.hypot(*(cells - here).T)
    x, y = candidate.xyz[0] - pose.xy[0], candidate.xyz[1] - pose.xy[1]
    ahead = abs(wrap_angle(float(np.arctan2(y, x)) - pose.yaw_rad)) <= AHEAD_RAD
    near = float(away.min()) * grid.cell_size_m <= near_m
    if not (ahead and near and _in_sight(candidate, cells, here, context)):
        return candidate
    return replace(candidate, near_views=with_view(candidate.near_views, pose.xy, hit=hit))


def object_probability(candidate: ObjectCandidate, context: PlanningContext) -> float:
    """Probability that a candidate without the map's support is the object."""
    return probability(candidate.near_views, map_rank(candidate, context))


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


def _in_sight(candidate: ObjectCandidate, cells: I64, here: I64, context: PlanningContext) -> bool:
    """Whether no obstacle lies before it, or it was seen from this side before."""
    grid = context.costmap.grid
    nearest = cells[np.hypot(*(cells - here).T).argmin()]
    clear = ~context.costmap.occupied | own_cells(cells, grid.shape)
    seen_from = grid.cells(np.asarray(candidate.seen_from))
    return line_is_clear(clear, here, nearest) or seen_from_side(here, nearest, seen_from)


LEAST_RAD = 0.12  # width of a thing in view, 7 degrees: twice what detectors need
BLUR_M = 0.2  # by which the map shows a thing wider than it is, a cell on each side
SPACING_M = 0.2  # views from nearer to each other show the same again,
SPACING_RAD = 0.35  # unless the camera has turned by 20 degrees


def with_frame(
    views: UndetectedViews,
    context: PlanningContext,
    detected: Iterable[WorldCells],
    *,
    threshold: float,
) -> UndetectedViews:
    """The views with one more frame, in which the object was detected on these cells.

    threshold: similarity from which a cell may show the object.
    """
    pose = (*context.pose.xy, context.pose.yaw_rad)
    if views.seen_from is not None and not _is_elsewhere(pose, views.seen_from):
        return views
    counts = dict(views.counts)
    found: WorldCells = frozenset().union(*detected)
    for cells in components(np.nan_to_num(context.map_view.similarity, nan=0.0) >= threshold):
        world = context.map_view.world_cells(cells)
        if found.isdisjoint(world) and _is_in_view(cells, context):
            counts.update({cell: counts.get(cell, 0) + 1 for cell in world})
    return UndetectedViews(counts, pose) if counts != views.counts else views


def _is_elsewhere(pose: tuple[float, float, float], before: tuple[float, float, float]) -> bool:
    moved_m = float(np.hypot(pose[0] - before[0], pose[1] - before[1]))
    return moved_m >= SPACING_M or abs(wrap_angle(pose[2] - before[2])) >= SPACING_RAD


def _is_in_view(cells: I64, context: PlanningContext) -> bool:
    """Whether a detector would find what is on the cells (K, 2): ahead, large enough, in sight."""
    costmap, pose = context.costmap, context.pose
    size_m = costmap.grid.cell_size_m
    middle = cells[np.hypot(*(cells - cells.mean(axis=0)).T).argmin()]
    x, y = costmap.grid.centres(middle) - np.asarray(pose.xy)
    width_m = max(np.sqrt(len(cells)) * size_m - BLUR_M, size_m)
    if np.hypot(x, y) * LEAST_RAD > width_m:
        return False
    if abs(wrap_angle(float(np.arctan2(y, x)) - pose.yaw_rad)) > AHEAD_RAD:
        return False
    clear = ~costmap.occupied | own_cells(cells, costmap.grid.shape)
    return line_is_clear(clear, costmap.grid.cells(np.asarray(pose.xy)), middle)


OTHER_SIDE_M = 1.0  # from an earlier viewpoint: at 1 m from an object about 60 degrees


def update_candidates(
    state: PlannerState, frames: tuple[Detections, ...], context: PlanningContext, *, near_m: float
) -> PlannerState:
    """The state with the new sightings merged, without candidates that are a found object.

    near_m: metres within which a frame that does not show a candidate counts against it.
    """
    for detections in frames:
        state = replace(state, target_state=_with_frame(state, detections, context, near_m))
    target_state = state.target_state
    others = found_under_other_names(state.found_objects, state.search.target, state.synonyms)
    free, disputed = (
        tuple(c for c in known if conflicting_object(c, others, context.map_view) is None)
        for known in (target_state.candidates, target_state.disputed)
    )
    return replace(state, target_state=replace(target_state, candidates=free, disputed=disputed))


def _with_frame(
    state: PlannerState, detections: Detections, context: PlanningContext, near_m: float
) -> TargetState:
    """The target state after one frame.

    A detector that reads the map's features says nothing that the map does not know: what the map
    does not support is kept of an independent one only.
    """
    target_state, target = state.target_state, state.search.target
    seen = sightings_of(
        target,
        detections,
        context.map_view,
        seen_from=context.pose.xy,
        consensus=context.consensus,
    )
    supported = [s for s in seen if s.supported and not _is_rejected(s, target_state)]
    candidates = count_contradictions(
        merge_sightings(target_state.candidates, supported),
        detections,
        supported,
        target=target,
        map_view=context.map_view,
    )
    undetected = with_frame(
        target_state.undetected,
        context,
        [sighting.cells for sighting in seen],
        threshold=context.consensus.floor,
    )
    target_state = replace(target_state, candidates=candidates, undetected=undetected)
    if not detections.independent:
        return target_state
    return replace(target_state, disputed=_disputed(target_state, seen, context, near_m))


def _disputed(
    target_state: TargetState, seen: Sequence[Sighting], context: PlanningContext, near_m: float
) -> tuple[ObjectCandidate, ...]:
    """The candidates without the map's support after a frame of an independent detector.

    A sighting of a supported candidate is no other object, unless it was disputed before. From
    near, a frame counts for a candidate or against it.
    """
    doubtful = [
        sighting
        for sighting in seen
        if not sighting.supported
        and not _is_rejected(sighting, target_state)
        and (
            _is_any(sighting, target_state.disputed)
            or not _is_any(sighting, target_state.candidates)
        )
    ]
    return tuple(
        with_near_view(
            candidate,
            context,
            hit=any(is_same_object(candidate, sighting) for sighting in seen),
            near_m=near_m,
        )
        for candidate in merge_sightings(target_state.disputed, doubtful)
    )


def _is_rejected(sighting: Sighting, target_state: TargetState) -> bool:
    """Rejected candidates stay rejected, those with the map's support and those without.

    A supported one is taken up again when it is seen from a side from which it was not looked at.
    """
    same = (c for c in target_state.rejected if c.supported == sighting.supported)
    if not _is_any(sighting, same):
        return False
    if not sighting.supported:
        return True
    if _is_any(sighting, target_state.candidates):
        return False
    looks = [
        doubt.from_xy
        for doubt in target_state.doubts
        if dist(doubt.place_xyz, sighting.xyz) <= MERGE_M
    ]
    elsewhere = all(dist(xy, sighting.seen_from) > OTHER_SIDE_M for xy in looks)
    return not (elsewhere and 0 < len(looks) < MAX_LOOKS)


def _is_any(sighting: Sighting, candidates: Iterable[ObjectCandidate]) -> bool:
    return any(is_same_object(candidate, sighting) for candidate in candidates)


def finds_of(search: Search, events: Iterable[Event], grid: GridSpec) -> tuple[ObjectFind, ...]:
    """The finds among the events of a step; ``search`` is the search before them."""
    return tuple(
        object_find(search, event.candidate, grid)
        for event in events
        if isinstance(event, Confirmed)
    )


def object_find(search: Search, candidate: ObjectCandidate, grid: GridSpec) -> ObjectFind:
    """The candidate as a find, with the frame in which it was seen best."""
    view = candidate.best_view
    return ObjectFind(
        name=search.target,
        position_m=candidate.xyz,
        extent_m=extent_m(candidate, grid),
        score=min(candidate.similarity, 1.0),  # rounding
        stamp_ns=view.stamp_ns if view else 0,
        search_id=search.search_id,
        box_px=view.box_px if view else (),
        picture=view.picture if view else b"",
    )


def extent_m(candidate: ObjectCandidate, grid: GridSpec) -> tuple[float, float, float, float]:
    """x_min, y_min, x_max, y_max of the candidate's cells, metres in the map frame.

    ``grid``: any grid of the map, for the size of a cell.
    """
    cells = np.array(sorted(candidate.cells), np.int64).reshape(-1, 2)
    if len(cells) == 0:
        x, y, _ = candidate.xyz
        return x, y, x, y
    (ix, iy), (jx, jy) = cells.min(axis=0), cells.max(axis=0)
    covered = GridSpec(grid.cell_size_m, (int(ix), int(iy)), (int(jx - ix) + 1, int(jy - iy) + 1))
    return covered.bounds_m
