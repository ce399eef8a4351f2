"""Drives that show all of a scene."""

from __future__ import annotations

import numpy as np

from onemap_shared.geometry import yaw_of
from onemap_simulator.physics.collision import CollisionMap
from onemap_simulator.rendering.rgbd_camera import CameraParams
from onemap_tools.bench.exploration_tour import (
    CELL_SIZE_M,
    HEADINGS,
    SPACING_M,
    STEP_M,
    exploration_poses,
    tour_cells,
)
from tests.simulator.scenes import box_room


def test_a_drive_stays_on_free_floor_and_turns_at_each_place() -> None:
    scene, camera = box_room(), CameraParams(forward_m=0.0)
    poses = exploration_poses(scene, camera)
    collision = CollisionMap.of(scene, camera.height_m)
    places = np.array([pose[:2, 3] for pose in poses])
    assert all(collision.clearance_m(x, y) > 0.05 for x, y in places)
    first = [pose[:2, 3] for pose in poses[:HEADINGS]]
    np.testing.assert_allclose(first, [first[0]] * HEADINGS)
    steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
    assert steps.max() <= STEP_M + 0.2
    assert len({round(yaw_of(pose @ np.linalg.inv(camera.mount)), 3) for pose in poses}) > 4


def test_no_floor_is_far_from_all_places() -> None:
    reachable = np.ones((60, 40), bool)
    cells = tour_cells(reachable, np.zeros_like(reachable), np.array([3, 5]))
    assert cells[0].tolist() == [3, 5]
    floor = np.argwhere(reachable)
    apart = np.linalg.norm(floor[:, None] - np.array(cells), axis=2).min(axis=1)
    assert apart.max() * CELL_SIZE_M <= SPACING_M
