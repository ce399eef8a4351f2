"""The simulated robot of a lockstep search: its frames, its odometry and the truth beside them."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest

from onemap_shared.geometry import Velocity2d
from onemap_simulator.config import SimulatorConfig
from onemap_tools.bench.simulated_robot import SearchEnd, SimulatedRobot
from tests.simulator.scenes import box_room


@pytest.fixture
def robot() -> SimulatedRobot:
    return SimulatedRobot(box_room(), SimulatorConfig())


def test_frames_are_numbered_and_carry_the_camera_s_pose(robot: SimulatedRobot) -> None:
    first, second = robot.frame(0.0), robot.frame(0.1)
    assert (first.sequence, second.sequence) == (1, 2)
    assert first.stamp_ns < second.stamp_ns
    np.testing.assert_allclose(first.T_map_camera[:2, 3], robot.xy, atol=0.5)
    assert first.depth_mm.max() > 0


def test_without_noise_odometry_is_the_true_pose(robot: SimulatedRobot) -> None:
    np.testing.assert_allclose(robot.odometry()[:2, 3], robot.xy)
    noisy = SimulatorConfig.model_validate({"pose_noise": {"position_m": 0.05, "yaw_deg": 1.0}})
    drifting = SimulatedRobot(box_room(), noisy)
    odometry = np.array([drifting.odometry()[:2, 3] for _ in range(50)])
    assert 0 < np.abs(odometry - drifting.xy).max() < 0.05 * 6
    assert len(np.unique(odometry[:, 0])) == 50
    assert abs(drifting.xy[0]) < 2 * pi


def test_late_frames_carry_the_pose_of_their_capture(robot: SimulatedRobot) -> None:
    assert [frame.sequence for frame in robot.frames(0.0, capture=True)] == [1]
    late = SimulatorConfig.model_validate({"frame_link": {"min_delay_s": 0.2, "max_delay_s": 0.2}})
    robot = SimulatedRobot(box_room(), late)
    assert robot.frames(0.0, capture=True) == []
    there = robot.pose
    for k in range(1, 5):
        robot.advance(Velocity2d(0.5), 0.05 * (k - 1), 0.05 * k)
    (frame,) = robot.frames(0.2, capture=False)
    mount = late.camera.mount
    np.testing.assert_allclose(robot.truth_of(frame).T_map_camera, there @ mount)
    np.testing.assert_allclose(frame.T_map_camera, there @ mount)
    assert not np.allclose(robot.pose, there)


def test_drift_is_reported_and_the_true_place_of_what_was_told_then_is_known() -> None:
    drift = {"way_percent": 20.0, "yaw_deg_per_m": 10.0}
    config = SimulatorConfig.model_validate({"odometry_drift": drift})
    robot = SimulatedRobot(box_room(), config)
    np.testing.assert_array_equal(robot.odometry(), robot.pose)
    for k in range(1, 40):
        robot.advance(Velocity2d(0.5), 0.05 * (k - 1), 0.05 * k)
        reported = robot.odometry()
    assert np.linalg.norm((reported - robot.pose)[:2, 3]) > 0.02
    end = SearchEnd(reported, robot.pose)
    assert end.true_place((*reported[:2, 3], 0.7)) == pytest.approx((*robot.xy, 0.7))
    assert end.true_place(()) == ()
    assert robot.localisation.largest_error_m > 0.02
