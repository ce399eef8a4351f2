"""The map as ``nav_msgs/OccupancyGrid``: what is known of the floor, and the similarity."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from onemap_ros2.cdr import encode, header, new, time_of
from onemap_ros2.ros_types import GRID
from onemap_shared.messages import Layer, Occupancy, SearchView

UNKNOWN, FREE, UNEXPLORED, OCCUPIED = -1, 0, 30, 100  # 30: free, and not looked at well enough


def belief_grid(view: SearchView, frame: str) -> bytes:
    """What is known of each cell: -1 nothing, 0 free and explored, 30 free, 100 occupied."""
    free, explored = view.occupancy == Occupancy.FREE, (view.layers & Layer.EXPLORED) > 0
    values = np.full(view.grid.shape, UNKNOWN, np.int8)
    values[free] = UNEXPLORED
    values[free & explored] = FREE
    values[view.occupancy == Occupancy.OCCUPIED] = OCCUPIED
    return _grid(view, values, frame)


def similarity_grid(view: SearchView, frame: str) -> bytes:
    """The similarity to the object in percent, -1 where nothing was observed or none is sought."""
    values = np.full(view.grid.shape, UNKNOWN, np.int8)
    if view.similarity.shape == view.grid.shape:
        observed = ((view.layers & Layer.OBSERVED) > 0) & np.isfinite(view.similarity)
        percent = np.rint(np.clip(view.similarity[observed], 0.0, 1.0) * 100.0)
        values[observed] = percent.astype(np.int8)
    return _grid(view, values, frame)


def _grid(view: SearchView, values: NDArray[np.int8], frame: str) -> bytes:
    """``values`` (nx, ny) as a grid whose rows follow y, the lowest first."""
    x_m, y_m, *_ = view.grid.bounds_m
    (width, height), size_m = view.grid.shape, view.grid.cell_size_m
    origin = new(
        "geometry_msgs/msg/Pose",
        new("geometry_msgs/msg/Point", x_m, y_m, 0.0),
        new("geometry_msgs/msg/Quaternion", 0.0, 0.0, 0.0, 1.0),
    )
    info = new("nav_msgs/msg/MapMetaData", time_of(view.stamp_ns), size_m, width, height, origin)
    return encode(new(GRID, header(view.stamp_ns, frame), info, values.T.ravel()), GRID)
