"""Searches in simulated time, and their robot: frames, odometry and the truth beside them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from onemap_planner.config import PlannerConfig
from onemap_planner.motion.pure_pursuit import DriveParams
from onemap_planner.search.state_machine import (
    CANCELLED,
    EventStamp,
    LookingAround,
    transition,
)
from onemap_shared.geometry import F64, Velocity2d
from onemap_shared.messages import SearchState
from onemap_simulator.config import SimulatorConfig
from onemap_simulator.generation.apartment import generate_apartment
from onemap_simulator.generation.stairwell import with_stairwell
from onemap_simulator.physics.robot import RobotParams
from onemap_simulator.scene.scene import Scene
from onemap_tools.bench.lockstep import (
    LockstepSimulation,
    PerceptionPipeline,
    SearchEnd,
    SimulatedRobot,
    SystemConfig,
)
from tests.simulator.scenes import box_room


class RecordedRobot(SimulatedRobot):
    """The simulator's robot, with all commands that it was given."""

    def __init__(self, scene: Scene, config: SimulatorConfig) -> None:
        super().__init__(scene, config)
        self.commands: list[Velocity2d] = []

    def advance(self, command: Velocity2d, before_s: float, now_s: float) -> None:
        self.commands.append(command)
        super().advance(command, before_s, now_s)


@pytest.mark.slow
def test_a_holonomic_robot_finds_the_sofa_behind_a_stairwell_and_stays_on_the_floor() -> None:
    """The straight way from the start to the sofa leads over an opening of 0.7 x 1 m."""
    scene = with_stairwell(generate_apartment(2), (4.5, 4.9, 5.2, 5.9))
    drive = DriveParams(max_lateral_mps=0.3)
    simulator = SimulatorConfig(seed=2, rgbd_hz=4.0, robot=RobotParams(max_lateral_mps=0.3))
    config = SystemConfig(simulator=simulator, planner=PlannerConfig(drive=drive))
    robot = RecordedRobot(replace(scene, start=(2.3, 5.43, 0.0)), simulator)
    simulation = LockstepSimulation(robot, config, PerceptionPipeline(config.perception))
    search = simulation.search(("sofa",), 60.0)
    assert [result.outcome for result in search.results] == [SearchState.FOUND]
    counts = robot.simulation.counts
    assert (counts.collisions, counts.edges_crossed) == (0, 0)
    sideways = [abs(command.lateral_mps) for command in robot.commands]
    assert 0.1 < max(sideways) <= drive.max_lateral_mps


class PushedRobot(SimulatedRobot):
    """Its odometry does not tell of a push."""

    pushed_m = (0.0, 0.0)

    def odometry(self) -> F64:
        """As if it had not been pushed."""
        T_map_body: F64 = super().odometry().copy()
        T_map_body[:2, 3] -= self.pushed_m
        return T_map_body

    def push_left(self, by_m: float) -> None:
        """Move sideways at once."""
        state = self.simulation.state
        self.pushed_m = (-by_m * float(np.sin(state.yaw_rad)), by_m * float(np.cos(state.yaw_rad)))
        x_m, y_m = np.add((state.x_m, state.y_m), self.pushed_m).tolist()
        self.simulation.state = replace(state, x_m=x_m, y_m=y_m)


@pytest.mark.slow
def test_a_robot_that_was_pushed_stops_and_goes_on_after_a_look_around_until_it_is_cancelled() -> (
    None
):
    """It stops within one period each of camera and planner, and braking, though its odometry does
    not tell; cancelled, within 0.3 s and braking."""
    config = SystemConfig(simulator=SimulatorConfig(seed=2, rgbd_hz=4.0))
    robot = PushedRobot(generate_apartment(2), config.simulator)
    simulation = LockstepSimulation(robot, config, PerceptionPipeline(config.perception))
    simulation.search(("sofa",), 0.0)

    def step_until(within_s: float, happened: Callable[[], bool]) -> None:
        end_s = simulation.now_s + within_s
        while not happened():
            assert simulation.now_s < end_s, simulation.state.search
            simulation.step()

    truth, fast_mps = robot.simulation, 0.8 * config.planner.drive.max_linear_mps
    step_until(60.0, lambda: truth.state.velocity.linear_mps > fast_mps)
    robot.push_left(0.4)
    braking_s = truth.state.velocity.linear_mps / config.simulator.robot.linear_acceleration_mps2
    step_until(0.6 + braking_s, lambda: truth.state.velocity.speed_mps == 0.0)
    assert "beside where the map has it, was it pushed?" in simulation.state.search.slow
    step_until(3.0, lambda: isinstance(simulation.state.search.phase, LookingAround))
    assert simulation.state.search.reason.startswith("it was moved, or its position was wrong")
    step_until(30.0, lambda: truth.state.velocity.linear_mps > fast_mps)
    assert truth.counts.collisions == 0
    state = simulation.state
    speed, began_s, began_xy = truth.state.velocity.linear_mps, simulation.now_s, simulation.xy
    stamp = EventStamp(began_s, state.active_time_s, began_xy, 0.0)
    simulation.state = replace(state, search=transition(state.search, CANCELLED, stamp))
    braking_mps2 = config.simulator.robot.linear_acceleration_mps2
    step_until(0.3 + speed / braking_mps2, lambda: truth.state.velocity.linear_mps == 0.0)
    away_m = float(np.hypot(*np.subtract(simulation.xy, began_xy)))
    assert away_m <= 0.3 * speed + speed**2 / (2 * braking_mps2)


def drive(robot: SimulatedRobot, steps: int) -> None:
    for k in range(1, steps):
        robot.advance(Velocity2d(0.5), 0.05 * (k - 1), 0.05 * k)
        robot.odometry()


def test_frames_carry_the_pose_of_their_capture_also_if_they_come_late() -> None:
    robot = SimulatedRobot(box_room(), SimulatorConfig())
    (first,), (second,) = (robot.frames(at_s, capture=True) for at_s in (0.0, 0.1))
    assert (first.sequence, second.sequence) == (1, 2)
    assert first.stamp_ns < second.stamp_ns
    assert first.depth_mm.max() > 0
    late = SimulatorConfig(errors="late")
    robot = SimulatedRobot(box_room(), late)
    assert robot.frames(0.0, capture=True) == []
    there = robot.pose
    drive(robot, 13)
    (frame,) = robot.frames(0.6, capture=False)
    mount = late.camera.mount
    np.testing.assert_allclose(robot.truth_of(frame).T_map_camera, there @ mount)
    np.testing.assert_allclose(frame.T_map_camera, there @ mount)
    assert not np.allclose(robot.pose, there)


def test_drift_is_reported_and_the_true_place_of_what_was_told_then_is_known() -> None:
    robot = SimulatedRobot(box_room(), SimulatorConfig(errors="drift"))
    np.testing.assert_array_equal(robot.odometry(), robot.pose)
    drive(robot, 40)
    reported = robot.odometry()
    assert np.linalg.norm((reported - robot.pose)[:2, 3]) > 0.002
    end = SearchEnd(reported, robot.pose)
    assert end.true_place((*reported[:2, 3], 0.7)) == pytest.approx((*robot.pose[:2, 3], 0.7))
    assert end.true_place(()) == ()
    assert robot.localisation.largest_error_m > 0.002
