from __future__ import annotations

import numpy as np
import pytest

from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import check_rigid
from onemap_simulator.physics.collision import CollisionMap
from onemap_simulator.rendering.camera_poses import CameraPoseRange, sample_camera_poses
from onemap_simulator.rendering.renderer import Renderer
from onemap_simulator.scene.scene import STRUCTURE
from tests.simulator.scenes import SceneBuilder, box_room

SCENE = box_room()
INTRINSICS = Intrinsics.from_fov(80, 60, np.radians(79.0))


def test_poses_are_free_rigid_and_repeatable() -> None:
    collision = CollisionMap.of(SCENE, height_m=1.3)
    poses = sample_camera_poses(SCENE, np.random.default_rng(3), 20)
    again = sample_camera_poses(SCENE, np.random.default_rng(3), 20)
    assert len(poses) == 20
    np.testing.assert_array_equal(poses, again)
    for T in poses:
        check_rigid(T, "T_map_camera")
        assert collision.clearance_m(T[0, 3], T[1, 3]) > 0.2
        assert 0.8 <= T[2, 3] <= 1.3


def test_half_of_the_poses_show_an_object_and_none_stares_at_a_wall() -> None:
    renderer = Renderer(SCENE)
    poses = sample_camera_poses(
        SCENE, np.random.default_rng(0), 40, CameraPoseRange((0.9, 1.0), (0.0, 0.3))
    )
    views = [renderer.render(T, INTRINSICS, width=80, height=60) for T in poses]
    things = [i for i, obj in enumerate(SCENE.objects) if obj.category not in STRUCTURE]
    shows = [bool(np.isin(view.labels, things).any()) for view in views]
    assert np.mean(shows[1::2]) > 0.9
    assert all(view.depth_m[30, 40] > 0.5 for view in views)


def test_a_scene_without_free_space_is_refused() -> None:
    scene = SceneBuilder().add("wall", (0, 0, 0), (0.3, 0.3, 2)).build()
    with pytest.raises(ValueError, match="no free space"):
        sample_camera_poses(scene, np.random.default_rng(0), 1)


def test_a_scene_without_objects_still_gives_poses() -> None:
    scene = SceneBuilder().add("wall", (0, 0, 0), (4, 3, 2.5)).build()
    assert len(sample_camera_poses(scene, np.random.default_rng(0), 4)) == 4
