"""What an episode is, drawn by the seed: objects and start, stairwells, and keep-out zones.

Stairwells open the floor on the shortest ways, with a way around each opening.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from onemap_shared.geometry import F64, Bool
from onemap_simulator.config import SimulatorConfig
from onemap_simulator.generation.stairwell import Opening, floor_around
from onemap_simulator.ground_truth.truth import CELL_SIZE_M, SceneTruth
from onemap_simulator.parts import scene_truth
from onemap_simulator.physics.collision import FLOOR_MARGIN_M, CollisionMap
from onemap_simulator.scene.cell_masks import connected_part
from onemap_simulator.scene.occupancy_raster import rasterise
from onemap_simulator.scene.scene import Scene
from onemap_tools.bench.navigation.described import (
    DescribedObject,
    described_objects,
    draw_order,
)
from onemap_tools.bench.options import GoalsName, Parity

# What somebody may send a robot to: furniture, appliances and things that stand on the floor.
# Cups and books are too small for the camera of the benchmark, pictures and curtains everywhere.
GOALS = frozenset(
    ("armchair", "bathtub", "bed", "bench", "bicycle", "bookcase", "chair", "coffee table", "desk")
    + ("dishwasher", "dresser", "fan", "guitar", "microwave", "nightstand", "oven", "potted plant")
    + ("refrigerator", "sink", "sofa", "stool", "suitcase", "table", "television", "toilet")
    + ("trash can", "wardrobe", "washing machine")
)
MIN_WAY_M = 1.0  # to each object, from the start or wherever the one before can be found
START_MARGIN_M = 0.1  # between the robot and obstacles at the start
# Of stairwells:
SIDES_M = ((0.5, 0.9), (0.7, 1.2))  # least and largest of the short and the long side
FROM_START_M = 1.2  # no camera sees the floor nearer at the start; the robot stands on floor
FROM_THINGS_M = 0.05  # rugs and furniture stay on floor
FROM_WALLS_M = 0.1
PASSING_M = 0.15  # beside the robot, on ways that stay open
ASIDE_M = 0.5  # of the shortest way, at most
DRAWS = 1000
ROOMS = 0.5  # of the zones; the others are rectangles on the ways


@dataclass(frozen=True, slots=True)
class NavigationEpisode:
    """objects: categories to find, in this order; start: x, y in metres and yaw in radians."""

    objects: tuple[str, ...]
    start: tuple[float, float, float]
    described: DescribedObject | None = None  # if so, ``objects`` is its phrase


def apartment_seeds(first: int, count: int, apartments: Parity) -> tuple[int, ...]:
    """``count`` seeds from ``first`` on."""
    if apartments == "all":
        return tuple(range(first, first + count))
    parity = 0 if apartments == "even" else 1
    first += (first - parity) % 2
    return tuple(range(first, first + 2 * count, 2))


def draw_episode(
    scene: Scene, truth: SceneTruth, simulator: SimulatorConfig, objects: int
) -> NavigationEpisode:
    """The episode of the seed; ValueError if the scene has too few objects that can be reached."""
    rng = np.random.default_rng((simulator.seed, objects))
    start = _draw_start(scene, simulator, rng)
    left = [str(name) for name in rng.permutation(sorted(GOALS.intersection(scene.categories)))]
    chosen: list[str] = []
    while len(chosen) < objects:
        name = next((each for each in left if _is_away(each, chosen, start, truth)), None)
        if name is None:
            raise ValueError(
                f"{scene.name} has {len(chosen)} kinds of object that can be reached one after "
                f"the other, not {objects}; choose fewer with --objects-per-episode"
            )
        chosen.append(name)
        left.remove(name)
    return NavigationEpisode(tuple(chosen), start)


def draw_described(
    scene: Scene, simulator: SimulatorConfig, goals: GoalsName
) -> tuple[NavigationEpisode, SceneTruth]:
    """The episode of the seed for one object of several of its kind, with its ground truth.

    Drawn: the kind of relation, the class, the description. ValueError if the scene has none.
    """
    rng = np.random.default_rng((simulator.seed, 4))
    start = _draw_start(scene, simulator, rng)
    found = described_objects(scene, simulator, goals, GOALS | {"lamp"})
    for drawn in draw_order(found, rng):
        truth = scene_truth(drawn.marked(scene), simulator)
        if _is_away(drawn.phrase, [], start, truth):
            return NavigationEpisode((drawn.phrase,), start, drawn), truth
    raise ValueError(
        f"{scene.name} has no object of several of its kind that --goals {goals} could name and "
        "that can be reached; choose another --seed"
    )


def _draw_start(
    scene: Scene, simulator: SimulatorConfig, rng: np.random.Generator
) -> tuple[float, float, float]:
    """x, y, yaw of a reachable place with ``START_MARGIN_M`` to spare."""
    robot = simulator.robot
    collision = CollisionMap.of(scene, robot.height_m)
    reachable = collision.reachable_cells(*scene.start[:2], robot.radius_m)
    reachable &= collision.clearance >= robot.radius_m + START_MARGIN_M
    places = collision.grid.centres(np.argwhere(reachable))
    x, y = places[int(rng.integers(len(places)))].tolist()
    return x, y, float(rng.uniform(-np.pi, np.pi))


def _is_away(
    name: str, before: list[str], start: tuple[float, float, float], truth: SceneTruth
) -> bool:
    """Whether there is a way to it, not too short from the start or the object before."""
    from_start_m = truth.path_m(name, *start[:2])
    way_m = truth.least_way_m(before[-1], name) if before else from_start_m
    return bool(np.isfinite(from_start_m)) and way_m >= MIN_WAY_M


def draw_openings(
    scene: Scene,
    truth: SceneTruth,
    episode: NavigationEpisode,
    simulator: SimulatorConfig,
    count: int,
) -> tuple[Opening, ...]:
    """At most ``count`` openings, no two in a room, by the seed.

    Every object of the episode can still be reached, and with PASSING_M to spare where it could.
    """
    if not count:
        return ()
    rng = np.random.default_rng((simulator.seed, 3))
    space = _Space(scene, truth, episode, simulator)
    chosen: dict[int, Opening] = {}  # by the floor of its room
    for _ in range(DRAWS):
        if len(chosen) == count:
            break
        opening = _draw(space.ways, rng)
        floor = floor_around(scene, opening, FROM_WALLS_M)
        openings = [*chosen.values(), opening]
        if floor is not None and floor not in chosen and space.allows(openings):
            chosen[floor] = opening
    return tuple(chosen.values())


def draw_zones(
    scene: Scene,
    truth: SceneTruth,
    episode: NavigationEpisode,
    simulator: SimulatorConfig,
    count: int,
) -> tuple[Opening, ...]:
    """At most ``count`` keep-out zones by the seed: rooms and, as often, rectangles on the ways.

    Away from the start; every object can be reached as for openings.
    """
    if not count:
        return ()
    rng = np.random.default_rng((simulator.seed, 5))
    space = _Space(scene, truth, episode, simulator)
    rooms = [scene.rooms[int(index)].bounds_m for index in rng.permutation(len(scene.rooms))]
    chosen: tuple[Opening, ...] = ()
    for _ in range(DRAWS):
        if len(chosen) == count:
            break
        zone = rooms.pop() if rooms and rng.random() < ROOMS else _draw(space.ways, rng)
        if space.leaves_ways((*chosen, zone)):
            chosen = (*chosen, zone)
    return chosen


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
        """Whether nothing stands over them, and they leave the ways."""
        over = self._things & (self._apart_m(openings) <= FROM_THINGS_M)
        return not over.any() and self.leaves_ways(openings)

    def leaves_ways(self, openings: Sequence[Opening]) -> bool:
        """Whether the start is away, and all ways go on."""
        from_start = [_distances_m(opening, self._start[None]).min() for opening in openings]
        if min(from_start) < FROM_START_M:
            return False
        clearance = np.minimum(self._clearance, self._apart_m(openings))
        margins = zip(self._margins_m, self._needed, strict=True)
        return all(needed <= self._goals_within(clearance >= m) for m, needed in margins)

    def _apart_m(self, openings: Sequence[Opening]) -> F64:
        """Distance (nx, ny) to the nearest opening, metres."""
        distances = [_distances_m(opening, self._places) for opening in openings]
        nearest: F64 = np.min(distances, axis=0).reshape(self._grid.shape)
        return nearest

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


def deepest_m(path: Sequence[tuple[float, float]], zones: Sequence[Opening], r_m: float) -> float:
    """How far a disc of radius ``r_m`` on the path (x, y) reached into a zone at most, metres."""
    places = np.array(path)
    deepest = 0.0
    for zone in zones:
        lower, upper = np.array(zone[:2]), np.array(zone[2:])
        inside_m = np.minimum(places - lower, upper - places).min(axis=1)
        outside_m = _distances_m(zone, places)
        deepest = max(deepest, float((r_m + np.where(inside_m > 0, inside_m, -outside_m)).max()))
    return deepest
