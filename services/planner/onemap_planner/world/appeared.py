"""What has just appeared where the floor was free: somebody who walks about, most likely."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from onemap_planner.world.map_view import MapView
from onemap_shared.geometry import F64, Bool
from onemap_shared.grid import GridSpec, onto
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

    def with_view(self, map_view: MapView, robot_xy: F64, seen_s: float) -> Appeared:
        """With another view of the map, and the robot (2,) metres elsewhere.

        seen_s: when the newest frame in the view was taken: what stands there for a while must
        have been seen to stand.
        """
        grid = _around(map_view.grid, robot_xy)
        occupied = onto(grid, map_view.grid, map_view.occupancy == Occupancy.OCCUPIED)
        seen = (map_view.occupancy == Occupancy.FREE) & ~map_view.assumed
        since_s = onto(grid, self.grid, self.since_s, NEVER)
        since_s[onto(grid, self.grid, self.free)] = seen_s
        since_s[~occupied | (np.abs(seen_s - since_s) > LASTS_S)] = NEVER
        return Appeared(grid, onto(grid, map_view.grid, seen), since_s)


NOTHING = Appeared(GridSpec(0.1, (0, 0), (0, 0)), np.zeros((0, 0), bool), np.zeros((0, 0)))


def _around(grid: GridSpec, robot_xy: F64) -> GridSpec:
    """The grid of the cells around the robot, on the same raster."""
    reach = int(np.ceil(AROUND_M / grid.cell_size_m))
    x, y = (int(index) for index in grid.cells(robot_xy) + np.asarray(grid.origin_cell) - reach)
    return GridSpec(grid.cell_size_m, (x, y), (2 * reach + 1, 2 * reach + 1))
