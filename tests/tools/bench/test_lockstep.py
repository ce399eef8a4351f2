"""Searches in simulated time, and their robot: frames, odometry and the truth beside them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from onemap_planner.config import PlannerConfig
from onemap_planner.motion.pure_pursuit import DriveParams
from onemap_planner.search.phases import Cancelled, Destination, EventStamp, Finished
from onemap_planner.search.state_machine import transition
from onemap_shared.geometry import Velocity2d
from onemap_shared.messages import SearchKind, SearchState
from onemap_simulator.config import SimulatorConfig
from onemap_simulator.generation.apartment import generate_apartment
from onemap_simulator.generation.stairwell import with_stairwell
from onemap_simulator.generation.style import STYLES
from onemap_simulator.physics.collision import CollisionMap
from onemap_simulator.physics.robot import RobotParams
from onemap_simulator.scene.scene import Scene
from onemap_tools.bench.lockstep import (
    LockstepSimulation,
    PerceptionPipeline,
    SearchEnd,
    SimulatedClock,
    SimulatedRobot,
    SystemConfig,
)
from tests.simulator.scenes import box_room

FOUR_HZ = SimulatorConfig(seed=2, rgbd_hz=4.0)  # the rate that a search needs, at half the work


def test_tasks_are_due_at_their_rate() -> None:
    clock = SimulatedClock()
    due = {"plan": 0, "frame": 0}
    for _ in range(100):  # 5 s of control at 20 Hz
        due["plan"] += clock.is_due("plan", 2.0)
        due["frame"] += clock.is_due("frame", 8.0)
        clock.now_s += 1 / 20
    assert due == {"plan": 10, "frame": 40}


@pytest.mark.slow
def test_a_place_in_a_room_that_was_never_seen_is_reached() -> None:
    config = SystemConfig(simulator=SimulatorConfig(rgbd_hz=4.0))
    scene = generate_apartment(config.simulator.seed, STYLES[config.simulator.style])
    start = np.array(scene.start[:2])
    floor = CollisionMap.of(scene, config.simulator.robot.height_m)
    roomy = floor.reachable_cells(*scene.start[:2], radius_m=0.25) & (floor.clearance > 0.5)
    places = floor.grid.centres(np.argwhere(roomy))
    farthest = places[np.argmax(np.hypot(*(places - start).T))]
    assert np.hypot(*(farthest - start)) > 5.0  # in another room

    simulation = LockstepSimulation(scene, config, PerceptionPipeline(config.perception))
    destination = Destination(SearchKind.GO_TO, (float(farthest[0]), float(farthest[1])))
    search = simulation.drive(destination, limit_s=300.0)
    assert search.phase == Finished(SearchState.ARRIVED), search.reason
    assert np.hypot(*(farthest - simulation.robot.xy)) < 0.3
    (result,) = search.results
    assert result.path_length_m < 3.0 * np.hypot(*(farthest - start))


@pytest.mark.slow
def test_a_search_for_what_stands_behind_a_stairwell_stays_on_the_floor() -> None:
    """The straight way from the start to the sofa leads over an opening of 0.7 x 1 m."""
    scene = with_stairwell(generate_apartment(2), (4.5, 4.9, 5.2, 5.9))
    scene = replace(scene, start=(2.3, 5.43, 0.0))
    config = SystemConfig(simulator=FOUR_HZ)
    simulation = LockstepSimulation(scene, config, PerceptionPipeline(config.perception))
    search = simulation.search(("sofa",), 60.0)
    assert [result.outcome for result in search.results] == [SearchState.FOUND]
    assert simulation.robot.edges_crossed == 0
    assert simulation.robot.contacts == 0


class RecordedRobot(SimulatedRobot):
    """The simulator's robot, with all commands that it was given."""

    def __init__(self, scene: Scene, config: SimulatorConfig) -> None:
        super().__init__(scene, config)
        self.commands: list[Velocity2d] = []

    def advance(self, command: Velocity2d, before_s: float, now_s: float) -> None:
        self.commands.append(command)
        super().advance(command, before_s, now_s)


@pytest.mark.slow
def test_a_holonomic_robot_finds_the_sofa_and_drives_sideways_on_the_way() -> None:
    drive = DriveParams(max_lateral_mps=0.3)
    config = SystemConfig(
        simulator=SimulatorConfig(seed=2, rgbd_hz=4.0, robot=RobotParams(max_lateral_mps=0.3)),
        planner=PlannerConfig(drive=drive),
    )
    robot = RecordedRobot(generate_apartment(2), config.simulator)
    simulation = LockstepSimulation(robot, config, PerceptionPipeline(config.perception))
    search = simulation.search(("sofa",), 60.0)
    assert [result.outcome for result in search.results] == [SearchState.FOUND]
    assert (robot.contacts, robot.edges_crossed) == (0, 0)
    sideways = [abs(command.lateral_mps) for command in robot.commands]
    assert 0.1 < max(sideways) <= drive.max_lateral_mps


def stopping(simulation: LockstepSimulation, robot: SimulatedRobot) -> tuple[float, float, float]:
    """Cancel the search: speed then (m/s), seconds and metres until the robot stands."""
    assert simulation.state is not None
    state = simulation.state
    speed, began_s, began_xy = robot.speed_mps, simulation.now_s, robot.xy
    stamp = EventStamp(simulation.now_s, state.active_time_s, robot.xy, 0.0)
    simulation.state = replace(state, search=transition(state.search, Cancelled(), stamp))
    while robot.speed_mps > 0.0:
        simulation._step(simulation.state)
    away_m = float(np.hypot(*np.subtract(robot.xy, began_xy)))
    return speed, simulation.now_s - began_s, away_m


@pytest.mark.slow
def test_a_cancelled_search_stops_within_300_ms_and_braking() -> None:
    config = SystemConfig(simulator=FOUR_HZ)
    perception = PerceptionPipeline(config.perception)
    robot = SimulatedRobot(generate_apartment(2), config.simulator)
    simulation = LockstepSimulation(robot, config, perception)
    braking_mps2 = config.simulator.robot.linear_acceleration_mps2
    fast = 0.8 * config.planner.drive.max_linear_mps
    stops: list[tuple[float, float, float]] = []
    for name in ("sofa", "bed"):  # one is not near the other
        simulation.search((name,), 0.0)
        while robot.speed_mps < fast:
            assert simulation.state is not None
            assert simulation.state.search.active
            assert simulation.now_s < 120.0
            simulation._step(simulation.state)
        stops.append(stopping(simulation, robot))
    for speed, took_s, away_m in stops:
        assert took_s - speed / braking_mps2 <= 0.3
        assert away_m <= 0.3 * speed + speed**2 / (2 * braking_mps2)


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


def test_late_frames_carry_the_pose_of_their_capture(robot: SimulatedRobot) -> None:
    assert [frame.sequence for frame in robot.frames(0.0, capture=True)] == [1]
    late = SimulatorConfig(errors="late")
    robot = SimulatedRobot(box_room(), late)
    assert robot.frames(0.0, capture=True) == []
    there = robot.pose
    for k in range(1, 13):
        robot.advance(Velocity2d(0.5), 0.05 * (k - 1), 0.05 * k)
    (frame,) = robot.frames(0.6, capture=False)
    mount = late.camera.mount
    np.testing.assert_allclose(robot.truth_of(frame).T_map_camera, there @ mount)
    np.testing.assert_allclose(frame.T_map_camera, there @ mount)
    assert not np.allclose(robot.pose, there)


def test_drift_is_reported_and_the_true_place_of_what_was_told_then_is_known() -> None:
    config = SimulatorConfig(errors="drift")
    robot = SimulatedRobot(box_room(), config)
    np.testing.assert_array_equal(robot.odometry(), robot.pose)
    for k in range(1, 40):
        robot.advance(Velocity2d(0.5), 0.05 * (k - 1), 0.05 * k)
        reported = robot.odometry()
    assert np.linalg.norm((reported - robot.pose)[:2, 3]) > 0.002
    end = SearchEnd(reported, robot.pose)
    assert end.true_place((*reported[:2, 3], 0.7)) == pytest.approx((*robot.xy, 0.7))
    assert end.true_place(()) == ()
    assert robot.localisation.largest_error_m > 0.002
