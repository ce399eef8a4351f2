"""Which frames are views of similar cells in which a detector would have found the object."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from onemap_planner.motion.path import line_is_clear
from onemap_planner.policy.context import PlanningContext
from onemap_planner.policy.viewpoints import own_cells
from onemap_planner.world.components import components
from onemap_planner.world.map_view import WorldCells
from onemap_planner.world.undetected import UndetectedViews
from onemap_shared.geometry import I64, wrap_angle

AHEAD_RAD = 0.5  # of the robot's heading: well inside the image of a camera of 70 degrees or more
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
