from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
import trimesh

from onemap_shared.geometry import F64, camera_mount
from onemap_shared.keys import ROBOT_CMD_VEL, ROBOT_ODOMETRY, ROBOT_RGBD, ROBOT_TRUTH
from onemap_shared.messages import RgbdFrame, TruthRequest, VelocityCommand
from onemap_shared.transport import RemoteError
from onemap_simulator.config import SimulatorConfig
from onemap_simulator.errors import ErrorChoice
from onemap_simulator.ground_truth.truth import SceneTruth
from onemap_simulator.rendering.rgbd_camera import CameraParams
from onemap_simulator.service import SimulatorWorker, build, open_scene
from tests.memory_bus import MemoryRouter
from tests.simulator.scene_files import room_of
from tests.simulator.scenes import box_room

CONFIG = SimulatorConfig(rgbd_hz=60, camera=CameraParams(width=32, height=24))


class Robot:
    """A worker on an in-memory bus and what it publishes."""

    def __init__(self, config: SimulatorConfig = CONFIG) -> None:
        router = MemoryRouter()
        self.bus = router.bus()
        self.rgbd = self.bus.subscribe(ROBOT_RGBD)
        self.odometry = self.bus.subscribe(ROBOT_ODOMETRY)
        self.commands = self.bus.publish(ROBOT_CMD_VEL)
        self.worker = SimulatorWorker(router.bus("simulator"), box_room(), config)

    def run_until(self, done: Callable[[], bool], steps: int = 400) -> bool:
        """Step the worker until something is true; False if it never was."""
        for _ in range(steps):
            self.worker.step(0.005)
            if done():
                return True
        return False

    def drive(self, linear: float, angular: float) -> None:
        self.commands.put(VelocityCommand(0, 0, linear, angular))


@pytest.fixture
def robot() -> Iterator[Robot]:
    robot = Robot()
    yield robot
    robot.worker.close()


def test_publishes_images_with_the_pose_of_the_same_instant(robot: Robot) -> None:
    assert not robot.worker.health().ready
    frames = []

    def two_frames() -> bool:
        frame = robot.rgbd.take(0.0)
        frames.extend([frame] if frame else [])
        return len(frames) >= 2

    assert robot.run_until(two_frames)
    first = frames[0]
    assert first.rgb.shape == (24, 32, 3)
    assert frames[1].sequence > first.sequence
    start = np.eye(4)
    start[:2, 3] = box_room().start[:2]
    expected = start @ camera_mount(0.1, 1.0, np.radians(12.0))
    np.testing.assert_allclose(first.T_map_camera, expected, atol=1e-9)
    health = robot.worker.health()
    assert health.ready
    assert {"frames_per_s", "render_ms", "collisions", "commands_received", "deadman_stops"} <= set(
        health.metrics or {}
    )


def test_obeys_commands_and_stops_when_they_cease(robot: Robot) -> None:
    robot.drive(0.0, 1.0)
    last = [0.0]

    def turning() -> bool:
        odometry = robot.odometry.take(0.0)
        last[0] = odometry.angular_radps if odometry else last[0]
        return last[0] > 0.2

    assert robot.run_until(turning)
    assert robot.run_until(lambda: not turning() and last[0] == 0.0)
    metrics = robot.worker.health().metrics or {}
    assert metrics["commands_received"] == 1
    assert metrics["deadman_stops"] == 1


def test_its_odometry_says_which_planner_s_command_it_has(robot: Robot) -> None:
    echoes = []

    def echoed() -> bool:
        odometry = robot.odometry.take(0.0)
        echoes.extend([(odometry.planner, odometry.command_sequence)] if odometry else [])
        return ("a", 3) in echoes

    assert not robot.run_until(echoed, steps=20)
    assert set(echoes) == {("", 0)}
    robot.commands.put(VelocityCommand(3, 0, 0.0, 0.5, planner="a"))
    assert robot.run_until(echoed)
    for planner, stamp_ns in (("b", 0), ("a", 1), ("a", 1)):
        robot.commands.put(VelocityCommand(4, 0, 0.0, 0.5, 300, planner, stamp_ns))
        robot.worker.step(0.02)
    metrics = robot.worker.health().metrics or {}
    counted = ("commands_foreign", "commands_late", "commands_disordered")
    assert [metrics[name] for name in counted] == [1, 1, 1]
    assert metrics["commands_received"] == 2  # the late one as a stop


def test_replies_with_the_ground_truth(robot: Robot) -> None:
    truth = robot.bus.call(ROBOT_TRUTH, TruthRequest("sofa", 1.5, 2.4))
    assert truth.instances == 1
    assert truth.distance_m == pytest.approx(1.0)
    assert truth.shortest_path_m == 0.0
    assert truth.nearest == "sofa"
    assert "ball" in truth.categories
    assert robot.bus.call(ROBOT_TRUTH, TruthRequest("elephant", 1.0, 1.0)).distance_m == np.inf
    with pytest.raises(RemoteError, match="not finite"):
        robot.bus.call(ROBOT_TRUTH, TruthRequest("sofa", float("nan"), 0.0))


def test_a_place_of_the_drifting_frame_is_judged_where_it_truly_is() -> None:
    robot = Robot(CONFIG.model_copy(update={"errors": "drift"}))
    place: list[F64] = []

    def driven() -> bool:
        if odometry := robot.odometry.take(0.0):
            place.append(odometry.T_map_body[:2, 3])
            robot.drive(0.4, 0.0)
        error_m = (robot.worker.health().metrics or {})["largest_pose_error_m"]
        return error_m > 0.005

    assert robot.run_until(driven, steps=2000)
    robot.drive(0.0, 0.0)
    x_m, y_m = (float(value) for value in place[-1])
    told = robot.bus.call(ROBOT_TRUTH, TruthRequest("sofa", x_m, y_m)).distance_m
    state = robot.worker._simulation.state
    truly = SceneTruth(box_room(), radius_m=0.2, height_m=1.1, eye_height_m=1.0)
    there = truly.reply(TruthRequest("sofa", state.x_m, state.y_m))
    assert told == pytest.approx(there.distance_m, abs=0.06)
    robot.worker.close()


def frames_with(errors: ErrorChoice, count: int) -> tuple[list[RgbdFrame], list[float], Robot]:
    """The first frames that arrive, and their ages in seconds."""
    robot = Robot(CONFIG.model_copy(update={"errors": errors}))
    frames: list[RgbdFrame] = []
    ages_s: list[float] = []

    def some_frames() -> bool:
        if frame := robot.rgbd.take(0.0):
            frames.append(frame)
            ages_s.append((time.time_ns() - frame.stamp_ns) / 1e9)
        return len(frames) >= count

    assert robot.run_until(some_frames, steps=4000)
    robot.worker.close()
    return frames, ages_s, robot


def test_late_frames_have_the_stamp_of_their_capture_and_dropped_ones_are_counted() -> None:
    _, ages_s, _ = frames_with("late", 5)
    assert min(ages_s) >= 0.1
    _, _, robot = frames_with("dropped", 30)
    assert (robot.worker.health().metrics or {})["frames_lost"] > 0


def first_frame(config: SimulatorConfig) -> RgbdFrame:
    """What a started simulator publishes first."""
    router = MemoryRouter()
    frames = router.bus().subscribe(ROBOT_RGBD)
    worker = build(router.bus("simulator"), config)
    for _ in range(100):
        worker.step(0.005)
        frame = frames.take(0.0)
        if frame is not None:
            worker.close()
            return frame
    raise AssertionError("no frame in 100 steps")


def test_a_scene_of_the_users_is_shown(tmp_path: Path) -> None:
    box = trimesh.creation.box((4.0, 0.1, 4.0))  # a floor: glTF has y up
    box.export(tmp_path / "plain.glb")
    frame = first_frame(CONFIG.model_copy(update={"scene": str(tmp_path / "plain.glb")}))
    assert (frame.depth_mm[-1] > 500).all()
    assert (frame.depth_mm[0] == 0).all()  # nothing above the floor


def test_the_configured_start_is_where_the_robot_stands_or_is_refused(tmp_path: Path) -> None:
    room_of("z").export(tmp_path / "room.obj")
    config = CONFIG.model_copy(update={"scene": str(tmp_path / "room.obj")})
    x, y, _ = open_scene(config).start
    assert open_scene(config.model_copy(update={"start": (x, y, 1.0)})).start == (x, y, 1.0)
    for start in ((1000.0, 0.0, 0.0), (1.0, 1.0, 0.0)):  # outside, in the sofa
        with pytest.raises(ValueError, match="choose a place on its free floor"):
            open_scene(config.model_copy(update={"start": start}))
