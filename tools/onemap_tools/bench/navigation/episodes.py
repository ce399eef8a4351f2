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
MIN_WAY_M = 1.0  # to each object, from the start or wherever the one before can be found
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
    return NavigationEpisode(seed, tuple(chosen), start)


def _is_away(
    name: str, before: list[str], start: tuple[float, float, float], truth: SceneTruth
) -> bool:
    """Whether there is a way to it, not too short from the start or the object before."""
    from_start_m = truth.distances(name, *start[:2]).path_m
    way_m = truth.least_way_m(before[-1], name) if before else from_start_m
    return bool(np.isfinite(from_start_m)) and way_m >= MIN_WAY_M


def _draw_start(
    collision: CollisionMap, cells: Bool, rng: np.random.Generator
) -> tuple[float, float, float]:
    places = collision.grid.centres(np.argwhere(cells))
    x, y = places[int(rng.integers(len(places)))]
    return float(x), float(y), float(rng.uniform(-np.pi, np.pi))
