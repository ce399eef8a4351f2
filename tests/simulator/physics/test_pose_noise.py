from __future__ import annotations

import numpy as np
import pytest

from onemap_simulator.physics.pose_noise import PoseNoiseParams, noisy_pose


def test_pose_noise_has_the_deviation_asked_for() -> None:
    params = PoseNoiseParams(position_m=0.05, yaw_deg=float(np.degrees(0.02)))
    rng = np.random.default_rng(1)
    poses = np.array([noisy_pose(np.eye(4), params, rng) for _ in range(2000)])
    assert poses[:, 0, 3].std() == pytest.approx(0.05, rel=0.1)
    assert np.arctan2(poses[:, 1, 0], poses[:, 0, 0]).std() == pytest.approx(0.02, rel=0.1)


def test_without_noise_the_pose_is_exact_and_nothing_is_drawn() -> None:
    rng = np.random.default_rng(1)
    np.testing.assert_array_equal(noisy_pose(np.eye(4), PoseNoiseParams(), rng), np.eye(4))
    assert rng.random() == np.random.default_rng(1).random()
