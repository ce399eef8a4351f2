from __future__ import annotations

import numpy as np
import pytest

from onemap_simulator.physics.robot import RobotState
from onemap_simulator.rendering.renderer import Renderer
from onemap_simulator.rendering.rgbd_camera import (
    CameraParams,
    RgbdCamera,
    measured_mm,
    noisy_depth,
)
from tests.simulator.scenes import box_room

RENDERER = Renderer(box_room())


def camera(**changes: float) -> RgbdCamera:
    params = CameraParams(width=32, height=24).model_copy(update=changes)
    return RgbdCamera(RENDERER, params, np.random.default_rng(0))


def test_the_camera_measures_within_its_range_only() -> None:
    pose = RobotState(1.0, 1.5, 0.0).pose
    everything = camera().capture(pose).depth_mm
    limited = camera(max_depth_m=2.0).capture(pose).depth_mm
    assert everything.dtype == np.uint16
    assert everything.min() > 0
    np.testing.assert_array_equal(limited, np.where(everything <= 2000, everything, 0))
    np.testing.assert_array_equal(
        measured_mm(np.array([[0.0, 0.05, 1.2345, 9.0]], np.float32), 0.1, 8.0),
        np.array([[0, 0, 1234, 0]], np.uint16),
    )


def test_depth_noise_grows_with_the_square_of_distance() -> None:
    rng = np.random.default_rng(0)
    near, far = np.full((200, 200), 1.0, np.float32), np.full((200, 200), 3.0, np.float32)
    assert np.std(noisy_depth(near, 0.002, rng) - near) == pytest.approx(0.002, rel=0.05)
    assert np.std(noisy_depth(far, 0.002, rng) - far) == pytest.approx(0.018, rel=0.05)
    assert (noisy_depth(np.zeros((4, 4), np.float32), 0.1, rng) == 0).all()
    pose = RobotState(1.0, 1.5, 0.0).pose
    clean, noisy = camera().capture(pose), camera(depth_noise_m=0.01).capture(pose)
    np.testing.assert_array_equal(clean.rgb, noisy.rgb)
    assert (clean.depth_mm != noisy.depth_mm).mean() > 0.5


def test_the_parameters_in_degrees_make_the_camera() -> None:
    params = CameraParams(horizontal_fov_deg=90, pitch_down_deg=30, height_m=1.2, forward_m=0.1)
    assert params.intrinsics.x_at(params.width - 0.5) == pytest.approx(1.0)
    np.testing.assert_allclose(params.mount[:3, 3], (0.1, 0.0, 1.2))
    np.testing.assert_allclose(params.mount[:3, 2], (np.sqrt(0.75), 0.0, -0.5))
