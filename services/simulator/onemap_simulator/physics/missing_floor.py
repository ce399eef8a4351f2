"""Missing floor: stairwells, balconies' edges and steps down, where a robot's wheels would fall."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from onemap_shared.geometry import F32
from onemap_shared.grid import GridSpec
from onemap_simulator.physics.collision import CELL_SIZE_M, FLOOR_MARGIN_M
from onemap_simulator.scene.cell_masks import distance_m
from onemap_simulator.scene.occupancy_raster import occupied_cells
from onemap_simulator.scene.scene import Scene

MIN_RADIUS_M = 0.05  # a hole in which no disc of this radius fits is a joint, or a scan's gap


@dataclass(frozen=True, slots=True)
class MissingFloor:
    """Distance (nx, ny) float32 in metres over ``grid``: from a cell to the edge of missing floor.

    Floor is missing where no geometry lies between FLOOR_MARGIN_M below z = 0 and the robot's
    height. A scene without any floor is taken to have a plane, as for its start.
    """

    grid: GridSpec
    distance: F32

    @classmethod
    def of(cls, scene: Scene, height_m: float, cell_size_m: float = CELL_SIZE_M) -> MissingFloor:
        """From a scene."""
        grid, floor = occupied_cells(scene, cell_size_m, -FLOOR_MARGIN_M, FLOOR_MARGIN_M)
        _, solid = occupied_cells(scene, cell_size_m, -FLOOR_MARGIN_M, height_m)
        missing = ~solid if floor.any() else np.zeros_like(solid)
        core = distance_m(~missing, cell_size_m) >= MIN_RADIUS_M
        missing &= distance_m(core, cell_size_m) <= MIN_RADIUS_M + cell_size_m
        edge_m = distance_m(missing, cell_size_m) - np.float32(cell_size_m / 2)
        return cls(grid, np.maximum(edge_m, np.float32(0.0)))

    def touches(self, x_m: float, y_m: float, radius_m: float) -> bool:
        """Whether a disc on the floor reaches over a place without floor."""
        cell = self.grid.cells(np.array([x_m, y_m]))
        if not self.grid.contains(cell):
            return False
        return bool(self.distance[cell[0], cell[1]] < radius_m)
