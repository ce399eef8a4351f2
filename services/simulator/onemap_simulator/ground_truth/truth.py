"""Ground truth of a scene: true distances to objects, for summaries of demos and benchmarks.

The planner and the mapper never read it.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from onemap_shared.geometry import F32, F64, I64, Bool
from onemap_shared.grid import GridSpec
from onemap_shared.messages import Truth, TruthRequest
from onemap_shared.names import normalised, same_name
from onemap_simulator.ground_truth import SUCCESS_RADIUS_M
from onemap_simulator.ground_truth.shortest_paths import ShortestPaths
from onemap_simulator.physics.collision import CollisionMap, MissingFloor
from onemap_simulator.rendering.ray_tracer import SHADOW_MARGIN, RayTracer
from onemap_simulator.scene.cell_masks import distance_m
from onemap_simulator.scene.occupancy_raster import rasterise
from onemap_simulator.scene.scene import STRUCTURE, UNNAMED, Scene

CELL_SIZE_M = 0.05
ALL_HEIGHTS_M = (-np.inf, np.inf)
SAMPLES = 48  # surface points per object to which rays are cast: 0.1 m apart on a chair
# Fractional parts of the multiples of these fill the unit cube evenly (Roberts, R3 sequence).
_EVEN: F64 = 1.2207440846057596 ** -np.arange(1.0, 4.0)


class SceneTruth:
    """Ground truth of one scene for a robot of one size; not thread-safe."""

    def __init__(
        self, scene: Scene, *, radius_m: float, height_m: float, eye_height_m: float
    ) -> None:
        self.scene = scene
        self._radius_m, self._height_m, self._eye_height_m = radius_m, height_m, eye_height_m
        self._paths: dict[str, ShortestPaths] = {}

    @cached_property
    def _tracer(self) -> RayTracer:
        """Made when a view is asked for first, since it takes a tenth of a second."""
        return RayTracer(self.scene)

    @cached_property
    def _collision(self) -> CollisionMap:
        """Made when the first way is asked for: a robot's start need not wait for it."""
        return CollisionMap.of(self.scene, self._height_m, CELL_SIZE_M)

    @property
    def _grid(self) -> GridSpec:
        return self._collision.grid

    @cached_property
    def _free(self) -> Bool:
        """Cells (nx, ny) of the grid on which the robot can stand."""
        floor = MissingFloor.of(self.scene, self._height_m, CELL_SIZE_M)
        return (self._collision.clearance >= self._radius_m) & (floor.distance >= self._radius_m)

    def reply(self, request: TruthRequest) -> Truth:
        """Distances from a place to a category, compared by normalised names.

        Infinity without an instance or a path. ValueError if the place is not finite.
        """
        place = np.array([request.x_m, request.y_m])
        if not np.isfinite(place).all():
            raise ValueError(f"the place ({request.x_m}, {request.y_m}) is not finite")
        objects = self._instances(normalised(request.name)) if request.name else []
        mine = self._triangles(np.isin(self.scene.face_object, objects))
        return Truth(
            scene=self.scene.name,
            instances=len(objects),
            distance_m=float(horizontal_distances(mine, place).min(initial=np.inf)),
            shortest_path_m=self.path_m(request.name, request.x_m, request.y_m)
            if objects
            else np.inf,
            categories=self.scene.categories,
            nearest=self.nearest(request.x_m, request.y_m),
            names_complete=self.scene.names_complete,
        )

    def path_m(self, name: str, x_m: float, y_m: float) -> float:
        """Length of the shortest path of the robot's disc from a place to a success place.

        0 at one, infinity without one; see the package.
        """
        start = self._nearest_cell(np.array([x_m, y_m]))
        if start is None:
            return np.inf
        return self._paths_to(normalised(name)).length(start) * CELL_SIZE_M

    def shortest_path(self, name: str, x_m: float, y_m: float) -> F64:
        """Places (N, 2) in metres from a place to a category's nearest success place.

        Empty if no path leads there. Not string-pulled: ``path_m`` is its length.
        """
        start = self._nearest_cell(np.array([x_m, y_m]))
        if start is None:
            return np.zeros((0, 2))
        return self._grid.centres(self._paths_to(normalised(name)).cells_from(start))

    def least_way_m(self, first: str, second: str) -> float:
        """Least path length in metres from a success place of one category to one of another.

        Infinity without a path. Not string-pulled.
        """
        paths = self._paths_to(normalised(second))
        starts = paths.number[self.success_cells(first)[1]]
        return float(paths.lengths[starts].min(initial=np.inf)) * CELL_SIZE_M

    def success_cells(self, name: str) -> tuple[GridSpec, Bool]:
        """Cells (nx, ny) whose centres are success places of a category, and their grid."""
        places = np.zeros(self._free.shape, bool)
        for index in self._instances(normalised(name)):
            outline = rasterise(
                self._triangles(self.scene.face_object == index), self._grid, ALL_HEIGHTS_M
            )
            near = distance_m(outline, CELL_SIZE_M) <= SUCCESS_RADIUS_M
            cells = np.argwhere(self._free & ~places & near)
            seen = cells[visible_from(self._tracer, self.scene, index, self._eyes(cells))]
            places[seen[:, 0], seen[:, 1]] = True
        return self._grid, places

    def nearest(self, x_m: float, y_m: float) -> str:
        """Category of the object nearest to a place, seen from above; empty if it is unnamed.

        Of objects above one another it is the highest. Structure, such as walls, is left out.
        """
        best, nearest = (np.inf, 0.0), ""
        triangles = self._triangles(np.ones(len(self.scene.faces), bool))
        apart = horizontal_distances(triangles, np.array([x_m, y_m]))
        for index, obj in enumerate(self.scene.objects):
            faces = self.scene.face_object == index
            if obj.category in STRUCTURE or not faces.any():
                continue
            rank = (float(apart[faces].min()), -float(triangles[faces][..., 2].max()))
            if rank < best:
                best, nearest = rank, obj.category
        return "" if nearest == UNNAMED else nearest

    def _instances(self, name: str) -> list[int]:
        return [i for i, obj in enumerate(self.scene.objects) if same_name(obj.category, name)]

    def _triangles(self, faces: Bool) -> F64:
        """Corners (N, 3, 3) in metres of the chosen faces (F,)."""
        return self.scene.vertices[self.scene.faces[faces]].astype(np.float64)

    def _eyes(self, cells: I64) -> F32:
        """Camera positions (N, 3) in metres above cells (N, 2)."""
        heights = np.full(len(cells), self._eye_height_m)
        return np.column_stack([self._grid.centres(cells), heights]).astype(np.float32)

    def _nearest_cell(self, place: F64) -> I64 | None:
        """The free cell (2,) nearest to a place (2,), None if there is none within two cells."""
        cells: I64 = np.argwhere(self._free)
        if len(cells) == 0:
            return None
        apart = np.linalg.norm(self._grid.centres(cells) - place, axis=1)
        nearest = int(apart.argmin())
        return cells[nearest] if apart[nearest] <= 2 * CELL_SIZE_M else None

    def _paths_to(self, category: str) -> ShortestPaths:
        if category not in self._paths:
            self._paths[category] = ShortestPaths.to(self.success_cells(category)[1], self._free)
        return self._paths[category]


def horizontal_distances(triangles: F64, place: F64) -> F64:
    """Distances (N,) in metres of a place (2,) to triangles (N, 3, 3) projected on the floor."""
    start = triangles[..., :2]
    edge = np.roll(start, -1, axis=1) - start
    to_place = place - start
    squared = np.maximum((edge**2).sum(axis=2), 1e-18)
    along = np.clip((to_place * edge).sum(axis=2) / squared, 0.0, 1.0)
    nearest = np.linalg.norm(to_place - along[..., None] * edge, axis=2).min(axis=1)
    side = edge[..., 0] * to_place[..., 1] - edge[..., 1] * to_place[..., 0]
    area = edge[:, 0, 0] * edge[:, 1, 1] - edge[:, 0, 1] * edge[:, 1, 0]
    inside = ((side >= 0).all(axis=1) | (side <= 0).all(axis=1)) & (np.abs(area) > 1e-12)
    return np.where(inside, 0.0, nearest)


def visible_from(tracer: RayTracer, scene: Scene, index: int, eyes: F32) -> Bool:
    """Whether (N,) object ``index`` is visible from eyes (N, 3) float32 in metres.

    It is if the ray to any of its sampled surface points hits no other object first. A part of
    the object that occludes the point counts as the object.
    """
    seen = np.zeros(len(eyes), bool)
    triangles = scene.vertices[scene.faces[scene.face_object == index]].astype(np.float64)
    for point in surface_points(triangles, SAMPLES).astype(np.float32):
        waiting = np.flatnonzero(~seen)
        if not len(waiting):
            break
        hits = tracer.first_hits(eyes[waiting], point - eyes[waiting])
        free = (hits.face < 0) | (hits.distance >= 1.0 - SHADOW_MARGIN)
        seen[waiting] = free | (scene.face_object[hits.face] == index)
    return seen


def surface_points(triangles: F64, count: int) -> F64:
    """Points (count, 3) spread evenly by area over triangles (N, 3, 3), deterministic.

    Any first few of them cover the surface coarsely. Triangles without any area give their
    corners.
    """
    edges = triangles[:, 1:] - triangles[:, :1]
    area = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1).cumsum()
    if area[-1] <= 0:
        return triangles.reshape(-1, 3)[:count]
    even = (0.5 + np.arange(1, count + 1)[:, None] * _EVEN) % 1.0
    chosen = np.minimum(np.searchsorted(area, even[:, 0] * area[-1], "right"), len(area) - 1)
    u, v = even[:, 1], even[:, 2]
    beyond = u + v > 1  # the other half of the parallelogram, folded back
    weights = np.where(beyond, 1.0 - np.stack([u, v]), np.stack([u, v]))
    points: F64 = triangles[chosen, 0] + np.einsum("kn,nkd->nd", weights, edges[chosen])
    return points
