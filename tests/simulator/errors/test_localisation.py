from __future__ import annotations

import numpy as np
import pytest

from onemap_shared.geometry import pose_2d, transform
from onemap_simulator.errors.localisation import Localisation, true_place
from onemap_simulator.errors.loop_closure import LoopClosureParams
from onemap_simulator.errors.odometry_drift import OdometryDriftParams
from onemap_simulator.physics.pose_noise import PoseNoiseParams
from tests.simulator.errors.test_loop_closure import circle

DRIFT = OdometryDriftParams(way_percent=2.0, yaw_deg_per_m=0.5)


def localisation(
    drift: OdometryDriftParams = DRIFT, closure_m: float = 0.0, noise_m: float = 0.0
) -> Localisation:
    noise, drawn = np.random.default_rng(1).spawn(2)
    return Localisation(
        PoseNoiseParams(position_m=noise_m),
        noise,
        drift=drift,
        loop_closure=LoopClosureParams(radius_m=closure_m),
        drift_rng=drawn,
    )


def test_without_errors_the_pose_is_the_true_one_and_so_is_every_place() -> None:
    exact = localisation(OdometryDriftParams())
    for pose in circle(0.2):
        np.testing.assert_array_equal(exact.reported(pose), pose)
    assert exact.true_place(3.0, 4.0) == (3.0, 4.0)
    assert (exact.largest_error_m, exact.jumps) == (0.0, 0)


def test_a_loop_closure_takes_the_pose_back_to_the_true_one_at_once() -> None:
    poses = circle(1.2)
    jumping = localisation(closure_m=1.0)
    errors = [np.linalg.norm((jumping.reported(pose) - pose)[:2, 3]) for pose in poses]
    assert jumping.jumps == 1
    closed = int(np.argmin(errors[50:])) + 50
    assert errors[closed] == 0.0
    assert errors[closed - 1] > 0.1
    assert jumping.largest_error_m == pytest.approx(max(errors))
    drifting = localisation()
    errors_without = [np.linalg.norm((drifting.reported(pose) - pose)[:2, 3]) for pose in poses]
    assert errors_without[:closed] == errors[:closed]
    assert errors_without[closed] > 0.02


def test_a_place_told_in_the_reported_frame_is_judged_where_it_truly_is() -> None:
    drifting = localisation()
    ahead = np.array([1.5, 0.2, 0.0])
    for pose in circle(0.6):
        reported = drifting.reported(pose)
    told, truly = transform(reported, ahead), transform(pose, ahead)
    assert np.linalg.norm(told - truly) > 0.02
    assert true_place(reported, pose, tuple(told)) == pytest.approx(tuple(truly[:2]))
    here = drifting.true_place(float(reported[0, 3]), float(reported[1, 3]))
    assert here == pytest.approx(tuple(pose[:2, 3]), abs=0.01)


def test_white_noise_comes_on_top() -> None:
    noisy, clean = localisation(noise_m=0.05), localisation()
    away = [
        float(np.linalg.norm((noisy.reported(pose) - clean.reported(pose))[:2, 3]))
        for pose in (pose_2d(0.1 * k, 0.0, 0.0) for k in range(200))
    ]
    assert np.sqrt(np.mean(np.square(away))) == pytest.approx(0.05 * np.sqrt(2), rel=0.15)
    assert noisy.largest_error_m == clean.largest_error_m  # of the drift
