"""The apartments: every class in each, nothing in another thing's place, all shapes shown."""

from __future__ import annotations

from functools import cache
from itertools import combinations

import numpy as np
import pytest

from onemap_simulator.physics.collision import CollisionMap
from onemap_tools.foreign.apartment_plan import free, on, wall
from onemap_tools.foreign.finish_picker import LOFT, FinishPicker
from onemap_tools.foreign.frames import ForeignSetSpec, foreign_scene, shown_shapes
from onemap_tools.foreign.furnishing import PlacedPiece, ShapeRota, furnish, surface_height
from onemap_tools.foreign.plans import PLANS
from onemap_tools.foreign.shapes.catalogue import CATALOGUE, SHAPES, build_piece

LEAVES_M = 0.35  # of a plant may reach so far into a wall
INTO_WALL_M = 0.15
ROBOT_RADIUS_M = 0.25
MIN_FREE_M2 = 0.8  # of each room, for the robot's centre
# Things that stand on, hang before or are pushed under others.
TOUCHING = {
    "pillow",
    "rug",
    "vase",
    "lamp",
    "laptop",
    "microwave",
    "television",
    "curtain",
    "chair",
}


@cache
def pieces(plan: int) -> tuple[PlacedPiece, ...]:
    """A furnished plan."""
    return tuple(furnish(PLANS[plan], ShapeRota(), (5, plan)))


@pytest.mark.parametrize("plan", range(len(PLANS)))
def test_every_class_stands_in_every_apartment(plan: int) -> None:
    assert {placed.slot.category for placed in pieces(plan)} == set(CATALOGUE)


@pytest.mark.parametrize("plan", range(len(PLANS)))
def test_things_stay_in_their_room_and_apart(plan: int) -> None:
    rooms = {room.kind: room.bounds_m for room in PLANS[plan].rooms}
    for placed in pieces(plan):
        lower, upper = placed.bounds
        x0, y0, x1, y1 = rooms[placed.room]
        beyond = max(x0 - lower[0], y0 - lower[1], upper[0] - x1, upper[1] - y1)
        limit = LEAVES_M if placed.slot.category == "potted plant" else INTO_WALL_M
        assert beyond < limit, (placed.slot, placed.shape)
        assert upper[2] < PLANS[plan].height_m
    for one, other in combinations(pieces(plan), 2):
        if not {one.slot.category, other.slot.category} & TOUCHING:
            assert shared_part(one, other) < 0.45, (one.slot, other.slot)


def shared_part(one: PlacedPiece, other: PlacedPiece) -> float:
    """Volume of the intersection of the boxes over that of the smaller one."""
    (low_a, high_a), (low_b, high_b) = one.bounds, other.bounds
    inside = np.clip(np.minimum(high_a, high_b) - np.maximum(low_a, low_b), 0, None)
    return float(inside.prod() / min((high_a - low_a).prod(), (high_b - low_b).prod()))


@pytest.mark.slow
def test_the_set_shows_every_shape() -> None:
    shown = shown_shapes(ForeignSetSpec())
    assert {name: len(shapes) for name, shapes in shown.items()} == dict.fromkeys(CATALOGUE, SHAPES)


@pytest.mark.slow
@pytest.mark.timeout(600)
@pytest.mark.parametrize("scene", ForeignSetSpec().scenes)
def test_a_robot_can_reach_every_room(scene: tuple[int, int]) -> None:
    made = foreign_scene(*scene).scene
    collision = CollisionMap.of(made, 1.3, 0.05)
    reached = collision.reachable_cells(made.start[0], made.start[1], ROBOT_RADIUS_M)
    places = collision.grid.centres(np.argwhere(reached))
    for room in made.rooms:
        x0, y0, x1, y1 = room.bounds_m
        inside = (places > (x0, y0)).all(axis=1) & (places < (x1, y1)).all(axis=1)
        assert inside.sum() * 0.05**2 > MIN_FREE_M2, room.kind


def test_the_rota_goes_round_the_allowed_shapes() -> None:
    rota = ShapeRota()
    some = wall("lamp", "N", 1.0, shapes=(1, 3))
    assert [rota.take(some) for _ in range(3)] == [1, 3, 1]
    assert [rota.take(free("lamp", 0, 0)) for _ in range(3)] == [0, 2, 4]


def test_things_on_others_lie_on_their_surface() -> None:
    table = build_piece("table", 0, FinishPicker(np.random.default_rng(0), LOFT))
    assert surface_height(table, 0.0, -0.4) == pytest.approx(0.74, abs=0.01)
    assert surface_height(table, 5.0, 0.0) == 0.0
    for placed in pieces(0):
        if placed.slot == on("microwave", "kitchen cabinet", 0.3, 0.02):
            assert 0.85 < placed.z < 1.0 or placed.z > 2.0
