from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from onemap_shared.geometry import Velocity2d
from onemap_simulator.physics.collision import CollisionMap
from onemap_simulator.physics.robot import RobotParams, RobotState
from onemap_simulator.physics.simulation import Simulation, SimulationCounts
from onemap_simulator.rendering.renderer import Renderer
from onemap_simulator.rendering.rgbd_camera import (
    CameraParams,
    RgbdCamera,
    measured_mm,
    noisy_depth,
    noisy_pose,
)
from tests.simulator.scenes import box_room

SCENE = box_room()
COLLISION = CollisionMap.of(SCENE, 1.1)
RENDERER = Renderer(SCENE)


def simulation(start: RobotState | None = None) -> Simulation:
    return Simulation(
        COLLISION,
        RobotParams(),
        start or RobotState(1.0, 1.5, 0.0),
        deadman_s=0.3,
        now_s=100.0,
    )


def test_the_result_depends_on_time_and_not_on_how_often_it_is_asked() -> None:
    often, seldom = simulation(), simulation()
    for run in (often, seldom):
        run.receive_command(Velocity2d(0.5, 0.4), 100.0, validity_s=0.3)
    for k in range(1, 121):
        often.advance(100.0 + k / 120)
    for k in range(1, 6):
        seldom.advance(100.0 + k / 5)
    a, b = often.state, seldom.state
    assert (a.x_m, a.y_m, a.yaw_rad) == pytest.approx((b.x_m, b.y_m, b.yaw_rad), abs=0.015)
    assert a.velocity == b.velocity == Velocity2d()


def test_counts_commands_deadman_stops_and_collisions() -> None:
    run = simulation(RobotState(0.5, 1.5, np.pi))
    now_s, collided = 100.0, False
    for _ in range(100):
        now_s += 0.02
        run.receive_command(Velocity2d(0.5), now_s, validity_s=0.3)
        collided = run.advance(now_s) or collided
    assert collided
    assert run.counts.commands_received == 100
    assert 1 <= run.counts.collisions <= 3  # it leans on the wall for a second and more
    assert COLLISION.clearance_m(run.state.x_m, run.state.y_m) >= 0.2
    run.advance(now_s + 0.5)
    assert run.counts.deadman_stops == 1
    assert run.state.velocity.linear_mps == 0.0


def test_after_a_long_pause_it_has_not_driven_on() -> None:
    run = simulation()
    run.receive_command(Velocity2d(0.5), 100.0, validity_s=0.3)
    run.advance(100.1)
    x = run.state.x_m
    run.advance(4000.0)
    assert run.state.x_m < x + 0.05
    assert run.counts == SimulationCounts(0, 1, run.counts.deadman_stops)


def test_a_start_too_close_to_an_obstacle_is_refused() -> None:
    with pytest.raises(ValueError, match=r"0\.0\d m from an obstacle; its radius is 0\.2 m"):
        simulation(RobotState(0.1, 1.0, 0.0))


def camera(**changes: float) -> RgbdCamera:
    params = replace(CameraParams(width=32, height=24), **changes)  # type: ignore[arg-type]
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


def test_pose_noise_has_the_deviation_asked_for() -> None:
    rng = np.random.default_rng(1)
    poses = np.array([noisy_pose(np.eye(4), 0.05, 0.02, rng) for _ in range(2000)])
    assert poses[:, 0, 3].std() == pytest.approx(0.05, rel=0.1)
    assert np.arctan2(poses[:, 1, 0], poses[:, 0, 0]).std() == pytest.approx(0.02, rel=0.1)
