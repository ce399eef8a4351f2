"""Simulated truth: how far things really are, for the summaries of demos and benchmarks.

Nothing that searches may read it.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from skimage.graph import MCP_Geometric

from onemap_shared.geometry import F64, I64, Bool
from onemap_shared.grid import GridSpec
from onemap_simulator.collision import CollisionMap
from onemap_simulator.floorplan import rasterise
from onemap_simulator.scene import Scene

CELL_SIZE_M = 0.05
SUCCESS_DISTANCE_M = 1.0  # a robot this close to a thing's surface has found it
ALL_HEIGHTS_M = (-np.inf, np.inf)


@dataclass(frozen=True, slots=True)
class Distances:
    """What is true of one category seen from one place; infinity where there is no way.

    instances: how many there are; straight_m: to the outline of the nearest, seen from above;
    path_m: the shortest way for the robot's disc to within success distance of any.
    """

    instances: int
    straight_m: float
    path_m: float


class SceneTruth:
    """Answers for one scene and a robot of one size."""

    def __init__(self, scene: Scene, *, radius_m: float, height_m: float) -> None:
        self.scene = scene
        collision = CollisionMap.of(scene, height_m, CELL_SIZE_M)
        self._grid = collision.grid
        self._free: Bool = collision.clearance >= radius_m

    def distances(self, name: str, x_m: float, y_m: float) -> Distances:
        """The truth about a category name, in any case, from a place in metres."""
        wanted = " ".join(name.split()).casefold()
        objects = [i for i, thing in enumerate(self.scene.objects) if thing.category == wanted]
        if not objects:
            return Distances(0, np.inf, np.inf)
        triangles = self.scene.vertices[self.scene.faces].astype(np.float64)
        mine = triangles[np.isin(self.scene.face_object, objects)]
        straight = float(distance_from_above(mine, np.array([x_m, y_m])))
        return Distances(len(objects), straight, self._path_m(mine, np.array([x_m, y_m])))

    def _path_m(self, triangles: F64, place: F64) -> float:
        """Length of the way from a place (2,) to within success distance of triangles (N, 3, 3)."""
        outline = rasterise(triangles, self._grid, ALL_HEIGHTS_M)
        apart = cv2.distanceTransform(
            (~outline).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE
        )
        close = np.asarray(apart) * CELL_SIZE_M <= SUCCESS_DISTANCE_M
        start = _nearest(self._free, self._grid, place)
        if start is None:
            return np.inf
        if close[tuple(start)]:
            return 0.0
        search = MCP_Geometric(np.where(self._free, 1.0, -1.0))  # negative: never entered
        costs, _ = search.find_costs([tuple(start)], find_all_ends=True)
        ends = np.argwhere(close & self._free)
        if len(ends) == 0:
            return np.inf
        cost = costs[ends[:, 0], ends[:, 1]]
        if not np.isfinite(cost.min()):
            return np.inf
        cells = np.array(search.traceback(tuple(ends[int(cost.argmin())])))
        return taut_length(cells, self._free) * CELL_SIZE_M


def distance_from_above(triangles: F64, place: F64) -> float:
    """Distance in metres of a place (2,) to triangles (N, 3, 3) projected on the floor."""
    start = triangles[..., :2]
    edge = np.roll(start, -1, axis=1) - start
    to_place = place - start
    squared = np.maximum((edge**2).sum(axis=2), 1e-18)
    along = np.clip((to_place * edge).sum(axis=2) / squared, 0.0, 1.0)
    nearest = np.linalg.norm(to_place - along[..., None] * edge, axis=2).min()
    side = edge[..., 0] * to_place[..., 1] - edge[..., 1] * to_place[..., 0]
    area = edge[:, 0, 0] * edge[:, 1, 1] - edge[:, 0, 1] * edge[:, 1, 0]
    inside = ((side >= 0).all(axis=1) | (side <= 0).all(axis=1)) & (np.abs(area) > 1e-12)
    return 0.0 if inside.any() else float(nearest)


def taut_length(cells: I64, free: Bool) -> float:
    """Length, in cells, of a path of cells (N, 2) pulled tight within the free cells (nx, ny).

    Steps along eight directions are up to 8 % longer than the straight line they stand for.
    """
    length, here = 0.0, 0
    while here < len(cells) - 1:
        ahead = len(cells) - 1
        while ahead > here + 1 and not _sees(cells[here], cells[ahead], free):
            ahead -= 1
        length += float(np.linalg.norm(cells[ahead] - cells[here]))
        here = ahead
    return length


def _sees(start: I64, end: I64, free: Bool) -> bool:
    """Whether the straight line between two cells' centres runs through free cells only."""
    steps = 2 * int(np.abs(end - start).max()) + 1
    line = start + (end - start) * np.linspace(0.0, 1.0, steps)[:, None]
    cells = np.floor(line + 0.5).astype(int)
    return bool(free[cells[:, 0], cells[:, 1]].all())


def _nearest(free: Bool, grid: GridSpec, place: F64) -> I64 | None:
    """The free cell (2,) nearest to a place (2,), None if there is none within two cells."""
    cells: I64 = np.argwhere(free)
    if len(cells) == 0:
        return None
    apart = np.linalg.norm(grid.centres(cells) - place, axis=1)
    nearest = int(apart.argmin())
    return cells[nearest] if apart[nearest] <= 2 * grid.cell_size_m else None
