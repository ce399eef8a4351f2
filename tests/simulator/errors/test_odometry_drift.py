from __future__ import annotations

import numpy as np
import pytest

from onemap_shared.geometry import F64, pose_2d, yaw_of
from onemap_simulator.errors.odometry_drift import DriftingOdometry, OdometryDriftParams

PARAMS = OdometryDriftParams(way_percent=2.0, yaw_deg_per_m=0.5)
BIAS_ONLY = PARAMS.model_copy(update={"random_walk": 0.0})


def straight_on(drift: DriftingOdometry, metres: int, every_m: float = 0.1) -> F64:
    """The pose reported after a straight way along x."""
    drift.reported(np.eye(4))
    for k in range(1, round(metres / every_m) + 1):
        reported = drift.reported(pose_2d(k * every_m, 0.0, 0.0))
    return reported


@pytest.mark.parametrize("seed", range(8))
def test_each_run_has_a_bias_within_the_limits_and_of_its_own(seed: int) -> None:
    drift = DriftingOdometry(BIAS_ONLY, np.random.default_rng(seed))
    reported = straight_on(drift, 10)
    assert 0.125 <= abs(np.degrees(yaw_of(reported))) / 10 <= 0.5
    other = straight_on(DriftingOdometry(BIAS_ONLY, np.random.default_rng(seed + 100)), 10)
    assert yaw_of(reported) != yaw_of(other)
    length_only = BIAS_ONLY.model_copy(update={"yaw_deg_per_m": 0.0})
    along = straight_on(DriftingOdometry(length_only, np.random.default_rng(seed)), 10)
    assert 0.05 <= abs(along[0, 3] - 10) <= 0.2
    assert along[1, 3] == 0


def test_the_random_walk_grows_with_the_square_root_of_the_way() -> None:
    walk = OdometryDriftParams(way_percent=1e-9, yaw_deg_per_m=1.0, random_walk=2.0)

    def deviation(metres: int, every_m: float) -> float:
        runs = [DriftingOdometry(walk, np.random.default_rng(seed)) for seed in range(400)]
        biases = np.array([np.degrees(drift._bias[1]) for drift in runs]) * metres
        yaws = [np.degrees(yaw_of(straight_on(drift, metres, every_m))) for drift in runs]
        return float((np.array(yaws) - biases).std())

    assert deviation(1, 0.1) == pytest.approx(2.0, rel=0.1)
    assert deviation(4, 0.5) == pytest.approx(4.0, rel=0.1)  # however often it is asked


def test_without_way_there_is_no_drift_and_a_correction_removes_it() -> None:
    drift = DriftingOdometry(PARAMS, np.random.default_rng(3))
    start = pose_2d(2.0, 1.0, 0.3)
    np.testing.assert_array_equal(drift.reported(start), start)
    np.testing.assert_allclose(drift.reported(pose_2d(2.0, 1.0, 2.3)), pose_2d(2.0, 1.0, 2.3))
    moved = pose_2d(3.0, 1.0, 2.3)
    assert not np.allclose(drift.reported(moved), moved)
    drift.correct(moved)
    np.testing.assert_allclose(drift.reported(moved), moved)


def test_a_seed_repeats_the_drift() -> None:
    first, second = (DriftingOdometry(PARAMS, np.random.default_rng(5)) for _ in range(2))
    np.testing.assert_array_equal(straight_on(first, 5), straight_on(second, 5))
    assert not OdometryDriftParams().active
    assert PARAMS.active
