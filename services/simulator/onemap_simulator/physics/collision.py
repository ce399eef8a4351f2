"""Distances to the nearest obstacle, and to the nearest place without floor, of a scene."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from onemap_shared.geometry import F32, F64, Bool
from onemap_shared.grid import GridSpec
from onemap_simulator.scene.cell_masks import clearance_m, connected_part, distance_m
from onemap_simulator.scene.occupancy_raster import (
    SCENES,
    faces_between,
    occupied_cells,
    outline_segments,
)
from onemap_simulator.scene.scene import Scene

CELL_SIZE_M = 0.025  # an eighth of the robot's radius
FLOOR_MARGIN_M = 0.05  # rugs and thresholds below this height are not obstacles
REACH_M = 0.5  # outlines up to this distance are exact; a robot's radius is less
BLOCK_M = 0.5  # side of the squares for which the outlines nearby are gathered once
MIN_RADIUS_M = 0.05  # a hole in which no disc of this radius fits is a joint, or a scan's gap


class Outlines:
    """Segments (M, 2, 2) in metres: the outlines of everything at the heights of a robot."""

    def __init__(self, segments: F64) -> None:
        self._segments = segments
        self._lower = segments.min(axis=1)
        self._upper = segments.max(axis=1)
        self._blocks: dict[tuple[int, int], F64] = {}

    def distance_m(self, x_m: float, y_m: float) -> float:
        """Distance in metres to the nearest outline; infinity if it is above ``REACH_M``."""
        segments = self._near(int(x_m // BLOCK_M), int(y_m // BLOCK_M))
        if not len(segments):
            return float("inf")
        start, along = segments[:, 0], segments[:, 1] - segments[:, 0]
        to_place = np.array([x_m, y_m]) - start
        squared = np.maximum((along**2).sum(axis=1), 1e-18)
        part = np.clip((to_place * along).sum(axis=1) / squared, 0.0, 1.0)
        distance = float(np.hypot(*(to_place - part[:, None] * along).T).min())
        return distance if distance <= REACH_M else float("inf")

    def _near(self, i: int, j: int) -> F64:
        """The segments whose bounding box comes within ``REACH_M`` of a block."""
        if (i, j) not in self._blocks:
            lower = np.array([i, j]) * BLOCK_M - REACH_M
            upper = lower + BLOCK_M + 2 * REACH_M
            near = ((self._upper >= lower) & (self._lower <= upper)).all(axis=1)
            self._blocks[i, j] = np.unique(self._segments[near], axis=0)
        return self._blocks[i, j]


@dataclass(frozen=True, slots=True)
class CollisionMap:
    """Clearance (nx, ny) float32 in metres over ``grid``: from a cell's centre to an obstacle.

    A lower bound of the true distance: an obstacle may begin anywhere in the cells it
    touches, so half a cell's diagonal is subtracted, and those cells are negative.
    Beyond the grid counts as obstacle. outlines: for the exact distance of a place near one.
    """

    grid: GridSpec
    clearance: F32
    outlines: Outlines

    @classmethod
    @lru_cache(maxsize=SCENES)
    def of(cls, scene: Scene, height_m: float, cell_size_m: float = CELL_SIZE_M) -> CollisionMap:
        """From a scene; obstacles are all triangles between FLOOR_MARGIN_M and ``height_m``."""
        grid, occupied = occupied_cells(scene, cell_size_m, FLOOR_MARGIN_M, height_m)
        distance = clearance_m(occupied, cell_size_m) - np.float32(cell_size_m / np.sqrt(2))
        outlines = Outlines(outline_segments(scene, FLOOR_MARGIN_M, height_m))
        return cls(grid, distance, outlines)

    def clearance_m(self, x_m: float, y_m: float) -> float:
        """Distance in metres from a place on the floor to the nearest obstacle; 0 inside one.

        Exact where an obstacle is near but not in the same cell, else a lower bound: the bound
        alone stopped robots up to 35 mm before they touched anything.
        """
        bound = self._lower_bound_m(x_m, y_m)
        if bound <= 0.0 or bound > REACH_M:
            return max(bound, 0.0)
        return max(bound, min(self.outlines.distance_m(x_m, y_m), REACH_M))

    def _lower_bound_m(self, x_m: float, y_m: float) -> float:
        """Interpolated between cell centres; negative inside an obstacle."""
        at = np.array([x_m, y_m]) / self.grid.cell_size_m - self.grid.origin_cell - 0.5
        low = np.floor(at).astype(int)
        if (low < 0).any() or (low + 1 >= self.grid.shape).any():
            return 0.0
        (ix, iy), (tx, ty) = low, at - low
        block = self.clearance[ix : ix + 2, iy : iy + 2]
        return float(np.array([1 - tx, tx]) @ block @ np.array([1 - ty, ty]))

    def reachable_cells(self, x_m: float, y_m: float, radius_m: float) -> Bool:
        """Cells (nx, ny) that a robot of this radius can reach from a place, maybe none.

        Starts at the free cell nearest to the place, within one radius of it.
        """
        free: Bool = self.clearance >= radius_m
        cells = np.argwhere(free)
        if len(cells) == 0:
            return free
        apart: F64 = np.linalg.norm(self.grid.centres(cells) - (x_m, y_m), axis=1)
        nearest = int(apart.argmin())
        if apart[nearest] > radius_m:
            return np.zeros_like(free)
        return connected_part(free, cells[nearest])


@dataclass(frozen=True, slots=True)
class MissingFloor:
    """Distance (nx, ny) float32 in metres over ``grid``: from a cell to the edge of missing floor.

    Stairwells, balconies and steps down: no geometry lies between FLOOR_MARGIN_M below z = 0 and
    the robot's height. A scene without any floor is taken to have a plane, as for its start.
    """

    grid: GridSpec
    distance: F32

    @classmethod
    @lru_cache(maxsize=SCENES)
    def of(cls, scene: Scene, height_m: float, cell_size_m: float = CELL_SIZE_M) -> MissingFloor:
        """From a scene."""
        grid, solid = occupied_cells(scene, cell_size_m, -FLOOR_MARGIN_M, height_m)
        has_floor = faces_between(scene, -FLOOR_MARGIN_M, FLOOR_MARGIN_M).any()
        missing = ~solid if has_floor else np.zeros_like(solid)
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
