"""Properties of generated apartments, measured on their triangles."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest

from onemap_shared.geometry import F64, Bool
from onemap_shared.grid import GridSpec
from onemap_simulator.generation.apartment import generate_apartment
from onemap_simulator.generation.style import HELD_OUT, TRAINING, Style
from onemap_simulator.scene.cell_masks import clearance_m, connected_part
from onemap_simulator.scene.occupancy_raster import occupied_cells
from onemap_simulator.scene.scene import Scene
from tests.simulator.scenes import object_vertices

CASES = [
    (1, TRAINING),
    (2, TRAINING),
    (3, TRAINING),
    (901, TRAINING),
    (1003, TRAINING),
    (4, HELD_OUT),
]
ROBOT_CLEARANCE_M = 0.25
FIXED = {"wall", "floor", "ceiling", "door", "window"}

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
def test_the_start_is_free_and_in_a_room(seed: int, style: Style) -> None:
    scene = apartment(seed, style)
    x, y, yaw = scene.start
    assert any(
        x0 < x < x1 and y0 < y < y1 for x0, y0, x1, y1 in (room.bounds_m for room in scene.rooms)
    )
    grid, free = reachable(seed, style)
    cell = grid.cells(np.array([x, y]))
    assert free[cell[0], cell[1]]
    assert np.isfinite(yaw)


@every_case
def test_many_categories_in_few_triangles(seed: int, style: Style) -> None:
    scene = apartment(seed, style)
    assert len(scene.categories) >= 45
    assert len(scene.faces) < 60_000
    assert {item.room for item in scene.objects} == {room.kind for room in scene.rooms}
    assert scene.face_object.max() == len(scene.objects) - 1
    assert scene.face_texture.max() == len(scene.textures) - 1
    assert len(scene.lights) >= len(scene.rooms)


@every_case
def test_objects_stay_inside_the_apartment(seed: int, style: Style) -> None:
    scene = apartment(seed, style)
    bounds = np.array([room.bounds_m for room in scene.rooms])
    lower, upper = bounds[:, :2].min(axis=0) - 0.2, bounds[:, 2:].max(axis=0) + 0.2
    assert (scene.vertices[:, :2] >= lower).all()
    assert (scene.vertices[:, :2] <= upper).all()
    assert scene.vertices[:, 2].min() >= -0.03


def test_the_same_seed_gives_the_same_scene() -> None:
    first, second = generate_apartment(7), generate_apartment(7)
    assert first.objects == second.objects
    assert first.start == second.start
    np.testing.assert_array_equal(first.vertices, second.vertices)
    for a, b in zip(first.textures, second.textures, strict=True):
        np.testing.assert_array_equal(a, b)


def test_seeds_and_styles_differ() -> None:
    scenes = [apartment(1, TRAINING), apartment(2, TRAINING), generate_apartment(1, HELD_OUT)]
    assert len({scene.vertices.tobytes() for scene in scenes}) == len(scenes)


def test_colour_is_not_the_class() -> None:
    """Across apartments, the mean colours of one category spread over the colour cube."""
    colours = []
    for seed, style in CASES:
        scene = apartment(seed, style)
        for index, item in enumerate(scene.objects):
            if item.category in ("chair", "dresser", "kettle", "sofa", "table"):
                texture = scene.textures[scene.face_texture[scene.face_object == index][0]]
                colours.append(texture.reshape(-1, 3).mean(axis=0))
    assert (np.std(colours, axis=0) > 30).all()
