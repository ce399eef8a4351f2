"""Keep-out zones on the grid of a costmap: no path leads into them, and a way out of one does."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from onemap_planner.world.distances import distances_to_edge_m
from onemap_planner.world.least_costs import least_costs
from onemap_shared.geometry import F64, I64, Bool
from onemap_shared.grid import GridSpec
from onemap_shared.places import Zones

MARGIN_M = 0.05  # half a map cell
ROUNDING_M = 1e-6


@dataclass(frozen=True, slots=True, eq=False)
class KeepOut:
    """Keep-out zones around a costmap: lethal for paths and commands, but no obstacle to sight.

    cells_xy (n, 2): centres, metres, of the cells that a zone covers, also in part and beyond the
    grid; clearance_m (nx, ny) float64: to the nearest one's edge, less the margin; closed (nx, ny)
    bool: the robot's centre is nearer to one than paths lead; way_out_m (nx, ny) float64: from
    there to where paths lead, 0 outside and infinity without a way.
    """

    grid: GridSpec
    cells_xy: F64
    clearance_m: F64
    closed: Bool
    way_out_m: F64

    @classmethod
    def of(
        cls, zones: Zones, grid: GridSpec, passable: Bool, min_clearance_m: float
    ) -> KeepOut | None:
        """Those of these zones around the grid, None without any; passable (nx, ny): without them.

        Paths keep ``MARGIN_M`` more from them than ``min_clearance_m`` from obstacles, since
        nothing there may be touched.
        """
        size = grid.cell_size_m
        pad = int(np.ceil((min_clearance_m + MARGIN_M) / size)) + 1
        (x, y), (nx, ny) = grid.origin_cell, grid.shape
        mask = zones.mask(GridSpec(size, (x - pad, y - pad), (nx + 2 * pad, ny + 2 * pad)))
        if not mask.any():
            return None
        clearance_m = distances_to_edge_m(mask, size)[pad:-pad, pad:-pad] - MARGIN_M
        closed = clearance_m < min_clearance_m
        way_out_m = np.where(closed, np.inf, 0.0)
        ends = np.argwhere(passable & ~closed)
        if len(ends):
            lengths, _ = least_costs(np.where(passable, 1.0, -1.0), ends)
            way_out_m = np.where(closed, lengths * size, 0.0)
        cells_xy = grid.centres(np.argwhere(mask) - pad)
        return cls(grid, cells_xy, clearance_m, closed, way_out_m)

    def ways_out(self, cell: I64, passable: Bool) -> Bool:
        """Cells (nx, ny) through which a robot in a cell (2,) may leave: not farther in."""
        robot, out = (int(cell[0]), int(cell[1])), np.zeros(self.grid.shape, bool)
        if self.closed[robot]:
            _, parts = cv2.connectedComponents(self.closed.astype(np.uint8), connectivity=8)
            out = (parts == parts[robot]) & passable & np.isfinite(self.way_out_m)
            out &= self.way_out_m <= self.way_out_m[robot]
            out[robot] = True
        return out

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
