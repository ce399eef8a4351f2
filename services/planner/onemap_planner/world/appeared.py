"""What has just appeared where the floor was free: somebody who walks about, most likely.

Such a thing may be nearer by the time that the map shows it, and a wall may not: the collision
monitor keeps the robot further from it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from onemap_planner.world.map_view import MapView
from onemap_shared.geometry import F64, Bool
from onemap_shared.grid import GridSpec
from onemap_shared.messages import Occupancy

LASTS_S = 1.0  # then it stands: four views at 4 Hz, in each of which a walker is in other cells
AROUND_M = 2.5  # of the robot: a walker's metre and the robot's way to a stop are less

NEVER = float("-inf")


@dataclass(frozen=True, slots=True, eq=False)
class Appeared:
    """What the last view showed around the robot.

    Arrays (nx, ny) on ``grid``. free bool: floor that a camera saw; since_s float64: when a cell
    that was free became occupied, minus infinity elsewhere.
    """

    grid: GridSpec
    free: Bool
    since_s: F64

    @property
    def xy(self) -> F64:
        """Centres (n, 2) in metres of the cells in which something has appeared."""
        return self.grid.centres(np.argwhere(self.since_s > NEVER))

    def after(self, map_view: MapView, robot_xy: F64, seen_s: float) -> Appeared:
        """With another view of the map, and the robot (2,) metres elsewhere.

        seen_s: when the newest frame in the view was taken: what stands there for a while must
        have been seen to stand.
        """
        grid = _around(map_view.grid, robot_xy)
        occupied = _onto(grid, map_view.grid, map_view.occupancy == Occupancy.OCCUPIED)
        seen = (map_view.occupancy == Occupancy.FREE) & ~map_view.assumed
        since_s = _onto(grid, self.grid, self.since_s, NEVER)
        since_s[_onto(grid, self.grid, self.free)] = seen_s
        since_s[~occupied | (np.abs(seen_s - since_s) > LASTS_S)] = NEVER
        return Appeared(grid, _onto(grid, map_view.grid, seen), since_s)


NOTHING = Appeared(GridSpec(0.1, (0, 0), (0, 0)), np.zeros((0, 0), bool), np.zeros((0, 0)))


def _around(grid: GridSpec, robot_xy: F64) -> GridSpec:
    """The grid of the cells around the robot, on the same raster."""
    reach = int(np.ceil(AROUND_M / grid.cell_size_m))
    x, y = (int(index) for index in grid.cells(robot_xy) + np.asarray(grid.origin_cell) - reach)
    return GridSpec(grid.cell_size_m, (x, y), (2 * reach + 1, 2 * reach + 1))


def _onto(grid: GridSpec, source: GridSpec, layer: NDArray, fill: float = 0) -> NDArray:
    """A layer on ``source`` as it is on ``grid``; ``fill`` where the source has no cells."""
    moved = np.full(grid.shape, fill, layer.dtype)
    shift = np.subtract(source.origin_cell, grid.origin_cell)
    low = np.maximum(shift, 0)
    high = np.minimum(shift + source.shape, grid.shape)
    if (high > low).all():
        (x0, y0), (x1, y1) = low, high
        dx, dy = shift
        moved[x0:x1, y0:y1] = layer[x0 - dx : x1 - dx, y0 - dy : y1 - dy]
    return moved
