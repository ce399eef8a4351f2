"""Near views of a candidate: in how many of them the detector finds it, and what the map says."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from onemap_planner.motion.path import line_is_clear
from onemap_planner.policy.context import PlanningContext
from onemap_planner.policy.viewpoints import own_cells, seen_from_side
from onemap_planner.world.acceptance import AcceptanceParams, probability, with_view
from onemap_planner.world.candidates import ObjectCandidate
from onemap_shared.geometry import I64, wrap_angle

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


def object_probability(
    candidate: ObjectCandidate, context: PlanningContext, params: AcceptanceParams
) -> float:
    """Probability that a candidate without the map's support is the object."""
    return probability(candidate.near_views, map_rank(candidate, context), params)


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
