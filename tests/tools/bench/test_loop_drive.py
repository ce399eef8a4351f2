"""Drives that end where they began, odometry that does not, and its correction."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from onemap_shared.geometry import F64, inverse, pose_2d, wrap_angle, yaw_of
from onemap_simulator.generation.apartment import generate_apartment
from onemap_simulator.generation.style import STYLES
from onemap_simulator.physics.collision import CollisionMap
from onemap_simulator.rendering.rgbd_camera import CameraParams
from onemap_tools.bench.loop_drive import (
    STEP_M,
    TURN_RAD,
    OdometryDrift,
    drifting,
    loop_closed,
    loop_drive,
)


def square() -> F64:
    """A way of 12 m around a square, ending at its start with the first heading."""
    poses, pose = [], np.eye(4)
    for _ in range(4):
        for _ in range(24):
            poses.append(pose)
            pose = pose @ pose_2d(0.125, 0.0, 0.0)
        pose = pose @ pose_2d(0.0, 0.0, np.pi / 2)
    return np.stack([*poses, pose])


def way_m(poses: F64) -> float:
    return float(np.linalg.norm(np.diff(poses[:, :2, 3], axis=0), axis=1).sum())


def test_a_drive_returns_to_its_start_on_free_floor() -> None:
    scene = generate_apartment(1, STYLES["training"])
    poses = loop_drive(scene, 3)
    steps = np.linalg.norm(np.diff(poses[:, :2, 3], axis=0), axis=1)
    turns = [wrap_angle(yaw_of(b) - yaw_of(a)) for a, b in pairwise(poses)]
    assert np.linalg.norm(poses[0, :2, 3] - poses[-1, :2, 3]) <= STEP_M + 1e-6
    assert steps.max() <= STEP_M + 1e-6
    assert np.abs(turns).max() <= TURN_RAD + 1e-6
    collision = CollisionMap.of(scene, CameraParams().height_m)
    assert min(collision.clearance_m(x, y) for x, y in poses[:, :2, 3].tolist()) > 0.15


def test_drift_grows_with_the_way() -> None:
    true = square()
    said = drifting(true, OdometryDrift(0.02, 0.01))
    np.testing.assert_array_equal(said[0], true[0])
    assert way_m(said) == pytest.approx(1.02 * way_m(true))
    assert wrap_angle(yaw_of(said[-1]) - yaw_of(true[-1])) == pytest.approx(0.01 * way_m(true))
    np.testing.assert_allclose(drifting(true, OdometryDrift(0.0, 0.0)), true, atol=1e-9)


def test_a_loop_closure_ends_at_the_truth_and_nears_it_on_the_way() -> None:
    true = square()
    said = drifting(true, OdometryDrift(0.02, 0.01))
    closed = loop_closed(said, true[-1])
    np.testing.assert_allclose(closed[-1], true[-1], atol=1e-9)
    np.testing.assert_allclose(closed[0], true[0], atol=1e-12)
    errors = [np.linalg.norm((each - true)[:, :2, 3], axis=1) for each in (said, closed)]
    assert errors[1].max() < 0.5 * errors[0].max()
    for pose in closed:
        np.testing.assert_allclose(pose @ inverse(pose), np.eye(4), atol=1e-9)
