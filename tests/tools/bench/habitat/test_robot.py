"""The agent in Habitat as a robot on the bus."""

from __future__ import annotations

import ast

import numpy as np
import pytest

from onemap_shared.geometry import Velocity2d, yaw_of
from onemap_shared.keys import ROBOT_CMD_VEL, ROBOT_ODOMETRY, ROBOT_RGBD
from onemap_shared.memory_bus import MemoryRouter
from onemap_shared.messages import Odometry, RgbdFrame, VelocityCommand
from onemap_tools.bench.habitat.params import HabitatRobotParams
from onemap_tools.bench.habitat.robot import HabitatRobot, PlanarPose, after, measured_mm
from tests.structure import ROOT
from tests.tools.bench.habitat.fake_world import FLOOR_Y_M, FakeWorld

PARAMS = HabitatRobotParams(width=16, height=16)


class Harness:
    """A robot and what it publishes."""

    def __init__(self) -> None:
        router = MemoryRouter()
        ours = router.bus()
        self.world = FakeWorld()
        self.robot = HabitatRobot(router.bus("robot"), self.world, PARAMS, now_s=0.0)
        self._commands = ours.publish(ROBOT_CMD_VEL)
        self._odometry, self._frames = ours.subscribe(ROBOT_ODOMETRY), ours.subscribe(ROBOT_RGBD)

    def command(self, linear: float, angular: float = 0.0, validity_ms: int = 300) -> None:
        self._commands.put(VelocityCommand(1, 0, linear, angular, validity_ms))

    def drive(self, seconds: float, linear: float, angular: float = 0.0) -> Odometry:
        """Twenty commands a second; the odometry at the end."""
        start_s, steps = self.robot._now_s, round(seconds * 20)
        for n in range(steps):
            self.command(linear, angular)
            self.robot.obey(self.robot.received(), start_s + n / 20, 0)
            self.robot.advance(start_s + (n + 1) / 20)
        return self.odometry()

    def odometry(self) -> Odometry:
        self.robot.publish_odometry(5)
        odometry = self._odometry.take(0.0)
        assert odometry is not None
        return odometry

    def frame(self) -> RgbdFrame:
        self.robot.publish_frame(7)
        frame = self._frames.take(0.0)
        assert frame is not None
        return frame


def test_it_stands_on_the_floor_of_the_map_and_looks_along_x() -> None:
    harness = Harness()
    assert harness.robot.floor_y_m == FLOOR_Y_M
    np.testing.assert_allclose(harness.odometry().T_map_body, np.eye(4), atol=1e-12)
    frame = harness.frame()
    np.testing.assert_allclose(frame.T_map_camera[:3, 3], [0, 0, 0.88])
    np.testing.assert_allclose(frame.T_map_camera[:3, 2], [1, 0, 0], atol=1e-12)  # optical axis
    assert frame.rgb.shape == (16, 16, 3)
    assert frame.intrinsics.fx == pytest.approx(8.0)  # 90 degrees
    assert [frame.depth_mm[row, 0] for row in (0, 1, 2)] == [0, 0, 2000]
    assert (frame.sequence, frame.stamp_ns, harness.frame().sequence) == (1, 7, 2)
    assert harness.robot.image is not None
    assert harness.robot.image.semantic_ids[0, 0] == 7


def test_it_drives_forward_and_turns_left() -> None:
    harness = Harness()
    odometry = harness.drive(2.0, 0.5)
    np.testing.assert_allclose(odometry.T_map_body[:3, 3], [1, 0, 0], atol=1e-9)
    assert (odometry.linear_mps, odometry.angular_radps) == (0.5, 0.0)
    np.testing.assert_allclose(harness.world.pose[0], [0, FLOOR_Y_M, -1], atol=1e-9)
    odometry = harness.drive(1.0, 0.0, 0.5)
    assert yaw_of(odometry.T_map_body) == pytest.approx(0.5)
    odometry = harness.drive(1.0, 0.5)
    assert odometry.T_map_body[1, 3] > 0.2  # left
    assert harness.world.pose[0][0] < -0.2  # which is minus x of Habitat
    assert harness.robot.contacts == 0


def test_speeds_are_limited() -> None:
    odometry = Harness().drive(0.1, 9.0, -9.0)
    assert (odometry.linear_mps, odometry.angular_radps) == (0.7, -1.6)


def test_a_command_that_expired_stops_it() -> None:
    harness = Harness()
    harness.command(0.5, validity_ms=100)
    harness.robot.obey(harness.robot.received(), 0.0, 0)
    harness.robot.obey(harness.robot.received(), 0.0, 0)  # nothing new: the command stays
    harness.robot.advance(0.5)
    odometry = harness.odometry()
    assert odometry.T_map_body[0, 3] == pytest.approx(0.05)
    assert odometry.linear_mps == 0.0
    harness.command(0.5, validity_ms=9000)  # the deadman limit is shorter
    harness.robot.obey(harness.robot.received(), 0.5, 0)
    harness.robot.advance(1.4)
    assert harness.odometry().T_map_body[0, 3] == pytest.approx(0.05 + 0.5 * 0.3)


def test_a_pause_is_not_caught_up_with_for_long() -> None:
    harness = Harness()
    harness.robot.advance(100.0)
    harness.command(0.5)
    harness.robot.obey(harness.robot.received(), 100.0, 0)
    harness.robot.advance(100.1)
    assert harness.odometry().T_map_body[0, 3] == pytest.approx(0.05)


def test_a_wall_stops_it_and_counts_once() -> None:
    harness = Harness()
    odometry = harness.drive(8.0, 0.6)
    assert odometry.T_map_body[0, 3] == pytest.approx(4.0)
    assert odometry.collided
    assert harness.robot.contacts == 1
    assert not harness.odometry().collided  # since the message before
    harness.drive(1.0, -0.5)
    harness.drive(2.0, 0.5)
    assert harness.robot.contacts == 2


def test_an_arc_ends_where_many_small_steps_end() -> None:
    velocity, pose = Velocity2d(0.7, 1.3), PlanarPose(1.0, 2.0, 0.1, 3.0)
    many = pose
    for _ in range(10_000):
        many = after(many, velocity, 1e-4)
    once = after(pose, velocity, 1.0)
    expected = (many.x_m, many.y_m, many.z_m, many.yaw_rad)
    np.testing.assert_allclose((once.x_m, once.y_m, once.z_m, once.yaw_rad), expected, atol=1e-4)


def test_depth_out_of_range_is_no_return() -> None:
    depth = np.array([[0.0, 0.49, 0.5, 4.9996, 5.1, np.inf, np.nan]], np.float32)
    assert measured_mm(depth, 0.5, 5.0).tolist() == [[0, 0, 500, 5000, 0, 0, 0]]


ADAPTER = {"coordinates", "params", "world", "habitat_world", "robot", "live", "__main__"}
ADAPTER |= {"episode_layout", "episode_files"}


@pytest.mark.parametrize("name", sorted(ADAPTER))
def test_in_habitat_s_environment_nothing_of_onemap_is_needed_but_shared(name: str) -> None:
    path = ROOT / "tools" / "onemap_tools" / "bench" / "habitat" / f"{name}.py"
    tree = ast.parse(path.read_text(encoding="utf-8"))
    modules = [node.module or "" for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
    ours = [each for each in modules if each.startswith("onemap")]
    allowed = ("onemap_shared.", "onemap_tools.bench.habitat.")
    assert [each for each in ours if not each.startswith(allowed)] == []
    siblings = {each.rpartition(".")[2] for each in ours if each.startswith(allowed[1])}
    assert siblings <= ADAPTER
