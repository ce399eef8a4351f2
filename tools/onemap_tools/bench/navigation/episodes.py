"""Episodes: an apartment, a start on its free floor and the objects to find, drawn by seed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from onemap_shared.geometry import Bool
from onemap_simulator.ground_truth.truth import SceneTruth
from onemap_simulator.physics.collision import CollisionMap
from onemap_simulator.scene.scene import Scene
from onemap_tools.bench.navigation.choices import Apartments

# What somebody may send a robot to: furniture, appliances and things that stand on the floor.
# Cups and books are too small for the camera of the benchmark, pictures and curtains everywhere.
GOALS = frozenset(
    ("armchair", "bathtub", "bed", "bench", "bicycle", "bookcase", "chair", "coffee table", "desk")
    + ("dishwasher", "dresser", "fan", "guitar", "microwave", "nightstand", "oven", "potted plant")
    + ("refrigerator", "sink", "sofa", "stool", "suitcase", "table", "television", "toilet")
    + ("trash can", "wardrobe", "washing machine")
)
MIN_START_M = 1.0  # shortest way to the first object: the robot does not start in front of it
START_MARGIN_M = 0.1  # between the robot and obstacles at the start


@dataclass(frozen=True, slots=True)
class NavigationEpisode:
    """objects: categories to find, in this order; start: x, y in metres and yaw in radians."""

    seed: int
    objects: tuple[str, ...]
    start: tuple[float, float, float]


def apartment_seeds(first: int, count: int, apartments: Apartments) -> tuple[int, ...]:
    """``count`` seeds from ``first`` on."""
    if apartments is Apartments.ALL:
        return tuple(range(first, first + count))
    parity = 0 if apartments is Apartments.EVEN else 1
    first += (first - parity) % 2
    return tuple(range(first, first + 2 * count, 2))


def draw_episode(
    scene: Scene, truth: SceneTruth, *, seed: int, objects: int, radius_m: float, height_m: float
) -> NavigationEpisode:
    """The episode of a seed; ValueError if the scene has too few objects that can be reached."""
    rng = np.random.default_rng((seed, objects))
    collision = CollisionMap.of(scene, height_m)
    reachable = collision.reachable_cells(*scene.start[:2], radius_m)
    reachable &= collision.clearance >= radius_m + START_MARGIN_M
    start = _draw_start(collision, reachable, rng)
    first: list[str] = []
    others: list[str] = []
    for name in rng.permutation(sorted(GOALS.intersection(scene.categories))):
        way_m = truth.distances(str(name), *start[:2]).path_m
        if not np.isfinite(way_m):
            continue
        chosen = others if first or way_m < MIN_START_M else first
        chosen.append(str(name))
        if first and len(others) >= objects - 1:
            return NavigationEpisode(seed, (*first, *others[: objects - 1]), start)
    raise ValueError(
        f"{scene.name} has {len(first) + len(others)} kinds of object that can be reached, "
        f"not {objects}; choose fewer with --objects-per-episode"
    )


def _draw_start(
    collision: CollisionMap, cells: Bool, rng: np.random.Generator
) -> tuple[float, float, float]:
    places = collision.grid.centres(np.argwhere(cells))
    x, y = places[int(rng.integers(len(places)))]
    return float(x), float(y), float(rng.uniform(-np.pi, np.pi))
