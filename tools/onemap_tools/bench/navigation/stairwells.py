"""Where the benchmark opens the floor: on the shortest ways, with a way around each opening."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from onemap_shared.geometry import F64, Bool
from onemap_simulator.config import SimulatorConfig
from onemap_simulator.generation.stairwell import Opening, floor_around
from onemap_simulator.ground_truth.truth import CELL_SIZE_M, SceneTruth
from onemap_simulator.physics.collision import FLOOR_MARGIN_M, CollisionMap
from onemap_simulator.scene.cell_masks import connected_part
from onemap_simulator.scene.occupancy_raster import rasterise
from onemap_simulator.scene.scene import Scene
from onemap_tools.bench.navigation.episodes import NavigationEpisode

SIDES_M = ((0.5, 0.9), (0.7, 1.2))  # least and largest of the short and the long side
FROM_START_M = 1.2  # no camera sees the floor nearer at the start; the robot stands on floor
FROM_THINGS_M = 0.05  # rugs and furniture stay on floor
FROM_WALLS_M = 0.1
PASSING_M = 0.15  # beside the robot, on ways that stay open
ASIDE_M = 0.5  # of the shortest way, at most
DRAWS = 1000


def draw_openings(
    scene: Scene,
    truth: SceneTruth,
    episode: NavigationEpisode,
    simulator: SimulatorConfig,
    count: int,
) -> tuple[Opening, ...]:
    """At most ``count`` openings, no two in a room, by the episode's seed.

    Every object of the episode can still be reached, and with PASSING_M to spare where it could.
    """
    rng = np.random.default_rng((episode.seed, 3))
    space = _Space(scene, truth, episode, simulator)
    chosen: list[Opening] = []
    floors = set[int]()
    for _ in range(DRAWS):
        if len(chosen) == count:
            break
        opening = _draw(space.ways, rng)
        floor = floor_around(scene, opening, FROM_WALLS_M)
        if floor is not None and floor not in floors and space.allows([*chosen, opening]):
            chosen.append(opening)
            floors.add(floor)
    return tuple(chosen)


def _draw(ways: Sequence[F64], rng: np.random.Generator) -> Opening:
    """A rectangle about a place beside one of the ways (N, 2)."""
    way = ways[int(rng.integers(len(ways)))]
    x, y = way[int(rng.integers(len(way)))] + rng.uniform(-ASIDE_M, ASIDE_M, 2)
    width, depth = rng.permutation([rng.uniform(*side) for side in SIDES_M])
    return float(x - width / 2), float(y - depth / 2), float(x + width / 2), float(y + depth / 2)


class _Space:
    """What of an apartment decides about openings, over the cells of the ground truth."""

    def __init__(
        self,
        scene: Scene,
        truth: SceneTruth,
        episode: NavigationEpisode,
        simulator: SimulatorConfig,
    ) -> None:
        self._start = np.array(episode.start[:2])
        self.ways = [truth.shortest_path(name, *episode.start[:2]) for name in episode.objects]
        collision = CollisionMap.of(scene, simulator.robot.height_m, CELL_SIZE_M)
        self._grid = collision.grid
        self._places = self._grid.centres(np.argwhere(np.ones(self._grid.shape, bool)))
        self._clearance = collision.clearance
        radius_m = simulator.robot.radius_m
        self._margins_m = (radius_m, radius_m + PASSING_M)
        things = np.array([thing.category != "floor" for thing in scene.objects])
        triangles = scene.vertices[scene.faces[things[scene.face_object]]].astype(np.float64)
        heights = (-FLOOR_MARGIN_M, simulator.robot.height_m)
        self._things = rasterise(triangles, self._grid, heights)
        self._goals = [truth.success_cells(name)[1] for name in episode.objects]
        self._needed = [self._goals_within(self._clearance >= m) for m in self._margins_m]

    def allows(self, openings: Sequence[Opening]) -> bool:
        """Whether nothing stands over them, the start is away, and all ways go on."""
        from_start = [_distances_m(opening, self._start[None]).min() for opening in openings]
        if min(from_start) < FROM_START_M:
            return False
        apart = np.min([_distances_m(opening, self._places) for opening in openings], axis=0)
        apart = apart.reshape(self._grid.shape)
        if (self._things & (apart <= FROM_THINGS_M)).any():
            return False
        clearance = np.minimum(self._clearance, apart)
        margins = zip(self._margins_m, self._needed, strict=True)
        return all(needed <= self._goals_within(clearance >= m) for m, needed in margins)

    def _goals_within(self, free: Bool) -> set[int]:
        """Objects that are reached over free cells from the one nearest to the start."""
        cells = np.argwhere(free)
        if len(cells) == 0:
            return set()
        apart = np.linalg.norm(self._grid.centres(cells) - self._start, axis=1)
        reached = connected_part(free, cells[int(apart.argmin())])
        return {index for index, goal in enumerate(self._goals) if (goal & reached).any()}


def _distances_m(opening: Opening, places: F64) -> F64:
    """Distances (N,) in metres of places (N, 2) from a rectangle; 0 inside."""
    lower, upper = np.array(opening[:2]), np.array(opening[2:])
    outside = np.maximum(np.maximum(lower - places, places - upper), 0.0)
    distances: F64 = np.linalg.norm(outside, axis=1)
    return distances
