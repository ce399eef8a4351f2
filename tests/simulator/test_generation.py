"""Generated apartments: sound models, closed walls, free ways, the same for the same seed."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest

from onemap_shared.geometry import F64, Bool
from onemap_shared.grid import GridSpec
from onemap_simulator.generation.apartment import generate_apartment
from onemap_simulator.generation.floor_plan import FloorPlan, Opening, Space, sample_floor_plan
from onemap_simulator.generation.placement import PlacedModel
from onemap_simulator.generation.structure import room_surfaces
from onemap_simulator.generation.style import HELD_OUT, TRAINING, Sampler, Style
from onemap_simulator.scene.cell_masks import clearance_m, connected_part
from onemap_simulator.scene.occupancy_raster import occupied_cells
from onemap_simulator.scene.scene import Scene
from tests.simulator.scenes import object_vertices

CASES = [(1, TRAINING), (4, HELD_OUT)]
ROBOT_CLEARANCE_M = 0.25
FIXED = {"wall", "floor", "ceiling", "door", "window"}
PLAN = FloorPlan(
    spaces=(Space("hallway", (0, 0, 4, 2)), Space("bedroom", (0, 2, 4, 6))),
    doors=(Opening(0, 2.0, 1.5, 2.5, 0.0, 2.05, (0, 1)),),
    entrance=Opening(1, 0.0, 0.5, 1.5, 0.0, 2.05, (0,)),
    windows=(Opening(0, 6.0, 1.0, 2.5, 0.9, 2.1, (1,)),),
    height_m=2.5,
)
every_case = pytest.mark.parametrize(
    ("seed", "style"), CASES, ids=[f"{seed}-{style.name}" for seed, style in CASES]
)


@lru_cache
def apartment(seed: int, style: Style) -> Scene:
    return generate_apartment(seed, style)


@lru_cache
def reachable(seed: int, style: Style) -> tuple[GridSpec, Bool]:
    scene = apartment(seed, style)
    grid, blocked = occupied_cells(scene, 0.05, 0.05, 1.4)
    start = grid.cells(np.array(scene.start[:2]))
    return grid, connected_part(clearance_m(blocked, 0.05) >= ROBOT_CLEARANCE_M, start)


def standing_points(seed: int, style: Style) -> F64:
    grid, free = reachable(seed, style)
    return grid.centres(np.argwhere(free))


@every_case
def test_rooms_and_size(seed: int, style: Style) -> None:
    scene = apartment(seed, style)
    kinds = [room.kind for room in scene.rooms]
    assert 5 <= len(kinds) <= 7
    assert {"kitchen", "bathroom", "bedroom", "living room"} <= set(kinds)
    bounds = np.array([room.bounds_m for room in scene.rooms])
    area = ((bounds[:, 2] - bounds[:, 0]) * (bounds[:, 3] - bounds[:, 1])).sum()
    assert 60 < area < 130
    for i, a in enumerate(bounds):
        for b in bounds[i + 1 :]:
            assert (a[2:] <= b[:2]).any() or (b[2:] <= a[:2]).any()


@every_case
def test_every_room_is_reachable_from_the_start(seed: int, style: Style) -> None:
    scene = apartment(seed, style)
    points = standing_points(seed, style)
    assert len(points)
    for room in scene.rooms:
        x0, y0, x1, y1 = room.bounds_m
        inside = ((points > (x0, y0)) & (points < (x1, y1))).all(axis=1)
        assert inside.sum() * 0.05**2 > 0.2, room.kind


@every_case
def test_everything_can_be_approached(seed: int, style: Style) -> None:
    scene = apartment(seed, style)
    points = standing_points(seed, style)
    for index, item in enumerate(scene.objects):
        if item.category in FIXED:
            continue
        surface = object_vertices(scene, index)[:, :2]
        lower, upper = surface.min(axis=0), surface.max(axis=0)
        beyond = np.maximum(np.maximum(lower - points, points - upper), 0)
        assert np.linalg.norm(beyond, axis=1).min() <= 1.0, item


@every_case
def test_every_thing_has_the_size_of_furniture_and_stands_in_its_room(
    seed: int, style: Style
) -> None:
    scene = apartment(seed, style)
    for index, item in enumerate(scene.objects):
        if item.category in FIXED - {"door", "window"}:
            continue
        vertices = object_vertices(scene, index)
        lower, upper = vertices.min(axis=0), vertices.max(axis=0)
        assert (upper - lower > 0.01).all() or item.category == "rug", item
        assert (upper - lower).max() < 3.6, item
        assert lower[2] > -0.02, item
        assert upper[2] < 2.6, item


@every_case
def test_many_categories_in_few_triangles_within_the_walls(seed: int, style: Style) -> None:
    scene = apartment(seed, style)
    assert len(scene.categories) >= 45
    assert len(scene.faces) < 60_000
    assert {item.room for item in scene.objects} == {room.kind for room in scene.rooms}
    assert scene.face_object.max() == len(scene.objects) - 1
    assert scene.face_texture.max() == len(scene.textures) - 1
    assert len(scene.lights) >= len(scene.rooms)
    assert np.isfinite(scene.vertices).all()
    assert np.isfinite(scene.face_uv).all()
    bounds = np.array([room.bounds_m for room in scene.rooms])
    lower, upper = scene.vertices.min(axis=0), scene.vertices.max(axis=0)
    assert (lower >= (*(bounds[:, :2].min(axis=0) - 0.2), -0.03)).all()
    assert (upper[:2] <= bounds[:, 2:].max(axis=0) + 0.2).all()


def test_the_same_seed_gives_the_same_scene_and_another_seed_or_style_another() -> None:
    first, second = apartment(4, HELD_OUT), generate_apartment(4, HELD_OUT)
    assert first.objects == second.objects
    assert first.start == second.start
    np.testing.assert_array_equal(first.vertices, second.vertices)
    for a, b in zip(first.textures, second.textures, strict=True):
        np.testing.assert_array_equal(a, b)
    others = [apartment(1, TRAINING), apartment(4, TRAINING)]
    assert len({scene.vertices.tobytes() for scene in (first, *others)}) == 3


def sampler(seed: int = 0) -> Sampler:
    return Sampler(np.random.default_rng(seed), TRAINING)


def boxes(items: list[PlacedModel]) -> np.ndarray:
    """Boxes (N, 2, 3) of the meshes of placed models."""
    found = []
    for item in items:
        for part in item.model.parts:
            vertices = part.mesh.vertices
            found.append([vertices.min(axis=0), vertices.max(axis=0)])
    return np.array(found)


def covered(pieces: np.ndarray, point: np.ndarray) -> bool:
    return bool(((pieces[:, 0] <= point) & (point <= pieces[:, 1])).all(axis=1).any())


@pytest.mark.parametrize("plan", [PLAN, *(sample_floor_plan(sampler(s)) for s in (1, 2))])
def test_walls_are_closed_except_at_openings(plan: FloorPlan) -> None:
    surfaces = room_surfaces(plan, sampler())
    walls = boxes([item for item in surfaces if item.model.category == "wall"])
    rng = np.random.default_rng(0)
    for index, space in enumerate(plan.spaces):
        for side in ("west", "south", "east", "north"):
            axis, line, start, end = space.side(side)
            across = line + 0.03 * (1 if side in ("west", "south") else -1)
            points = np.column_stack([rng.uniform(start, end, 40), rng.uniform(0.01, 2.4, 40)])
            for along, height in points:
                point = np.array([along, across, height] if axis == 0 else [across, along, height])
                hole = any(
                    index in opening.spaces
                    and opening.axis == axis
                    and abs(opening.line - line) < 1e-6
                    and opening.start - 0.01 < along < opening.end + 0.01
                    and opening.sill - 0.01 < height < opening.top + 0.01
                    for opening in (*plan.doors, plan.entrance, *plan.windows)
                )
                assert covered(walls, point) != hole
