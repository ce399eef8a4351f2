"""A rigid motion of a map's plane: of a saved map into the frame of the map in use."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, sin

import numpy as np

from onemap_shared.geometry import F64, I64
from onemap_shared.grid import GridSpec


@dataclass(frozen=True, slots=True)
class PlanarMotion:
    """The rigid motion p -> R(yaw) p + t of the map's plane, in radians and metres."""

    yaw_rad: float = 0.0
    x_m: float = 0.0
    y_m: float = 0.0

    def apply(self, points_m: F64) -> F64:
        """Where points (n, 2) lie after the motion."""
        moved: F64 = points_m @ _rotation(self.yaw_rad).T + (self.x_m, self.y_m)
        return moved

    def undo(self, points_m: F64) -> F64:
        """Where points (n, 2) lay before the motion."""
        original: F64 = (points_m - (self.x_m, self.y_m)) @ _rotation(self.yaw_rad)
        return original


NO_MOTION = PlanarMotion()


def _rotation(yaw_rad: float) -> F64:
    c, s = cos(yaw_rad), sin(yaw_rad)
    return np.array([[c, -s], [s, c]])


def moved_cells(cells: I64, motion: PlanarMotion, cell_size_m: float) -> tuple[I64, I64]:
    """World cells (m, 2) that distinct cells (n, 2) fill after a motion; and which of those (m,)
    each one's content is from.

    Every cell takes the content of the one in which its centre lay, so there are no holes.
    """
    if motion == NO_MOTION or len(cells) == 0:
        return cells, np.arange(len(cells))
    low, high = cells.min(axis=0), cells.max(axis=0)
    shape = high - low + 1
    index = np.full(tuple(shape), -1, np.int64)
    index[tuple((cells - low).T)] = np.arange(len(cells))
    before = GridSpec(cell_size_m, (int(low[0]), int(low[1])), (int(shape[0]), int(shape[1])))
    corners = before.centres(np.array([(i, j) for i in (-1, shape[0]) for j in (-1, shape[1])]))
    moved = motion.apply(corners)
    (low_x, low_y), (high_x, high_y) = moved.min(axis=0), moved.max(axis=0)
    after = GridSpec.covering(cell_size_m, (low_x, low_y), (high_x, high_y))
    wanted = np.argwhere(np.ones(after.shape, bool))
    place = before.cells(motion.undo(after.centres(wanted)))
    inside = before.contains(place)
    source = index[tuple(place[inside].T)]
    filled: I64 = (wanted[inside] + np.asarray(after.origin_cell))[source >= 0]
    return filled, source[source >= 0]
