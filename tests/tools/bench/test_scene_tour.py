"""Places from which a scene is looked at."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from onemap_shared.geometry import F64
from onemap_simulator.physics.collision import CollisionMap
from onemap_simulator.rendering.rgbd_camera import CameraParams
from onemap_simulator.scene.loading import load_scene
from onemap_simulator.scene.scene import Scene
from onemap_tools.bench.scene_tour import HEADINGS, MIN_CLEARANCE_M, tour_places, tour_poses
from tests.tools.bench.furnished import write_room

HEIGHT_M = 1.0


@pytest.fixture(scope="module")
def room(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    return load_scene(write_room(tmp_path_factory.mktemp("scene") / "room.glb"))


def nearest_m(places: F64) -> float:
    apart = np.linalg.norm(places[:, None] - places[None], axis=-1)
    return float(apart[~np.eye(len(places), dtype=bool)].min())


def test_places_are_free_and_far_apart(room: Scene) -> None:
    collision = CollisionMap.of(room, HEIGHT_M)
    places = tour_places(room, HEIGHT_M, 6)
    assert len(places) == 6
    for x, y in places.tolist():
        assert collision.clearance_m(x, y) >= MIN_CLEARANCE_M
    assert nearest_m(places) > 1.0
    np.testing.assert_allclose(places[0], room.start[:2], atol=0.05)


def test_the_same_scene_has_the_same_tour(room: Scene) -> None:
    first, again = (tour_places(room, HEIGHT_M, 5) for _ in range(2))
    np.testing.assert_array_equal(first, again)
    np.testing.assert_array_equal(first[:3], tour_places(room, HEIGHT_M, 3))


def test_the_camera_turns_all_around_at_each_place(room: Scene) -> None:
    camera = CameraParams(forward_m=0.0)
    poses = np.array(tour_poses(room, camera, 2))
    assert len(poses) == 2 * HEADINGS
    assert np.ptp(poses[:HEADINGS, :3, 3], axis=0) == pytest.approx(0.0, abs=1e-9)
    assert poses[:, 2, 3] == pytest.approx(camera.height_m)
    ahead = np.arctan2(poses[:HEADINGS, 1, 2], poses[:HEADINGS, 0, 2])
    turns = np.sort(np.mod(ahead, 2 * np.pi))
    assert np.diff(turns) == pytest.approx(2 * np.pi / HEADINGS, abs=1e-6)


def test_a_start_without_free_floor_is_one_sentence(room: Scene) -> None:
    with pytest.raises(ValueError, match=r"no free floor around its start \(50\.00, 0\.00\)"):
        tour_places(replace(room, start=(50.0, 0.0, 0.0)), HEIGHT_M, 3)
