"""Keep-out zones: where no part of the robot's body may be, and the way out of one.

A zone is lethal for paths and commands, but nothing that stands in the way of sight: it is part of
the costmap beside the obstacles, not one of them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from onemap_shared.geometry import F64, Bool
from onemap_shared.grid import GridSpec

ROUNDING_M = 1e-6


@dataclass(frozen=True, slots=True, eq=False)
class KeepOut:
    """The zones around a costmap.

    cells_xy (n, 2): centres, metres, of the cells that a zone covers, also in part and beyond the
    grid; closed (nx, ny) bool: the robot's centre is nearer to one than paths lead; way_out_m
    (nx, ny) float64: from there to where paths lead, 0 outside and infinity without a way.
    """

    grid: GridSpec
    cells_xy: F64
    closed: Bool
    way_out_m: F64

    def distances_m(self, points: F64, within_m: float) -> F64:
        """Distances (n,) of points (n, 2), metres, to the nearest zone; infinity if none is within
        a distance of the first one."""
        near = (np.abs(self.cells_xy - points[0]) <= within_m + self.grid.cell_size_m).all(axis=1)
        apart = np.abs(points[:, None] - self.cells_xy[near][None]) - self.grid.cell_size_m / 2
        away = np.linalg.norm(np.maximum(apart, 0.0), axis=2)
        nearest: F64 = away.min(axis=1, initial=np.inf)
        return nearest

    def allows(self, here: F64, points: F64, radius_m: float, reach_m: float) -> bool:
        """Whether a disc at ``here`` (2,) may take a path of points (n, 2) and ``reach_m`` metres.

        No part of it comes into a zone. A disc that already reaches into one comes no nearer to it,
        and inside it no farther from the way out.
        """
        away_m = self.distances_m(np.vstack([here, points]), reach_m + radius_m)
        if (away_m[1:] < min(radius_m, away_m[0]) - ROUNDING_M).any():
            return False
        if away_m[0] >= radius_m - ROUNDING_M:
            return True
        cells = self.grid.cells(np.vstack([here, points]))
        way_m = self.way_out_m[tuple(np.clip(cells, 0, np.subtract(self.grid.shape, 1)).T)]
        return bool(((way_m[1:] <= way_m[0]) | (away_m[1:] >= radius_m)).all())
