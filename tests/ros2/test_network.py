"""The adapter's process between a fake robot's process and OneMap's bus, through a real router."""

from __future__ import annotations

import json
import queue
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import yaml

from onemap_ros2.network import ZenohRosNetwork
from onemap_shared import keys
from onemap_shared.messages import VelocityCommand
from onemap_shared.transport import Bus
from tests.ros2.fake_robot import COMMAND, FX, HEIGHT, WIDTH
from tests.shared.test_bus import Router, eventually, join, router
from tests.structure import ROOT

__all__ = ["router"]  # the fixture
pytestmark = pytest.mark.slow
TOPICS = {
    "color": "/camera/color",
    "depth": "/camera/depth",
    "camera_info": "/camera/camera_info",
}


class RobotProcess:
    """The fake robot, and what its base was told: sequence, forward and turning speed."""

    def __init__(self, endpoint: str) -> None:
        self.told: queue.SimpleQueue[tuple[int, float, float]] = queue.SimpleQueue()
        self.process = subprocess.Popen(
            [sys.executable, "-m", "tests.ros2.fake_robot", endpoint],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            cwd=ROOT,
        )
        threading.Thread(target=self._listen, daemon=True).start()

    def _listen(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            sequence, linear, angular = json.loads(line)
            self.told.put((sequence, linear, angular))

    def close(self) -> None:
        assert self.process.stdin is not None
        self.process.stdin.close()
        assert self.process.wait(timeout=20) == 0


@pytest.fixture
def robot(router: Router) -> Iterator[RobotProcess]:
    made = RobotProcess(router.endpoint)
    yield made
    if made.process.poll() is None:
        made.close()


@pytest.fixture
def adapter(
    router: Router, robot: RobotProcess, tmp_path: Path
) -> Iterator[subprocess.Popen[bytes]]:
    config = tmp_path / "robot.yaml"
    ros2 = {"connect": [router.endpoint], "map_frame": "odom", "topics": TOPICS}
    config.write_text(yaml.safe_dump({"bus": {"connect": [router.endpoint]}, "ros2": ros2}))
    process = subprocess.Popen([sys.executable, "-m", "onemap_ros2", "--config", str(config)])
    yield process
    process.terminate()
    assert process.wait(timeout=20) == 0


@pytest.fixture
def planner(router: Router) -> Iterator[Bus]:
    bus = join(router, "planner")
    yield bus
    bus.close()


@pytest.mark.usefixtures("adapter")
def test_a_robot_of_ros_2_is_seen_and_driven(planner: Bus, robot: RobotProcess) -> None:
    frames, odometry = planner.subscribe(keys.ROBOT_RGBD), planner.subscribe(keys.ROBOT_ODOMETRY)
    frame = eventually(lambda: frames.take(0.5))
    assert frame.rgb.shape == (HEIGHT, WIDTH, 3)
    assert frame.rgb[0, 0].tolist() == [0, 1, 2]
    assert (frame.depth_mm[0, 0], frame.depth_mm[1, 1]) == (0, 1500)
    assert (frame.intrinsics.fx, frame.intrinsics.cx) == (FX, WIDTH / 2)
    np.testing.assert_allclose(frame.T_map_camera[:3, 3], (1.2, 0.0, 0.0), atol=1e-9)
    commands = planner.publish(keys.ROBOT_CMD_VEL)
    eventually(lambda: odometry.take(0.5))
    commands.put(VelocityCommand(1, 1, 0.25, -0.5, 300, "p1"))
    told = [robot.told.get(timeout=20)]
    assert told[0] == (1, 0.25, -0.5)
    echoed = eventually(lambda: m if (m := odometry.take(0.5)) and m.planner == "p1" else None)
    assert echoed.command_sequence == 1
    told = [robot.told.get(timeout=20) for _ in range(3)]
    assert [velocity for _, *velocity in told] == [[0.0, 0.0]] * 3
    assert [sequence for sequence, *_ in told] == [2, 3, 4]


@pytest.mark.usefixtures("adapter")
def test_the_base_is_stopped_when_the_adapter_ends(
    planner: Bus, robot: RobotProcess, adapter: subprocess.Popen[bytes]
) -> None:
    odometry = planner.subscribe(keys.ROBOT_ODOMETRY)
    eventually(lambda: odometry.take(0.5))
    drive = VelocityCommand(1, 1, 0.25, 0.0, 60_000, "p1")
    planner.publish(keys.ROBOT_CMD_VEL).put(drive)
    assert robot.told.get(timeout=20) == (1, 0.25, 0.0)
    adapter.terminate()
    assert adapter.wait(timeout=20) == 0
    assert robot.told.get(timeout=20)[1:] == (0.0, 0.0)


@pytest.mark.usefixtures("planner")  # which waits for the router
def test_the_graph_shows_the_robot_and_forgets_it(router: Router, robot: RobotProcess) -> None:
    network = ZenohRosNetwork((router.endpoint,), 0, "onemap")
    try:
        network.read("/tf", "tf2_msgs/msg/TFMessage", 5)
        found = eventually(lambda: network.endpoints() if len(network.endpoints()) == 7 else None)
        base = next(each for each in found if each.kind == "MS")
        assert (base.node, base.topic, base.ros_type) == ("/fake_robot", "/cmd_vel", COMMAND)
        robot.close()
        assert eventually(lambda: None if network.endpoints() else True)
    finally:
        network.close()


@pytest.mark.usefixtures("planner", "robot")
def test_the_command_lists_topics_and_names_the_missing_one(router: Router, tmp_path: Path) -> None:
    config = tmp_path / "robot.yaml"
    topics = {**TOPICS, "color": "/camera/colour"}
    config.write_text(yaml.safe_dump({"ros2": {"connect": [router.endpoint], "topics": topics}}))
    command = [sys.executable, "-m", "onemap_tools", "ros2", "topics", "--config", str(config)]
    done = subprocess.run(
        [*command, "--seconds", "1", "--json"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 1, done.stderr
    document = json.loads(done.stdout.splitlines()[-1])
    listed = {each["topic"]: each for each in document["topics"]}
    assert listed["/odom"]["setting"] == "odometry"
    assert listed["/odom"]["rate_hz"] > 1.0
    assert listed["/cmd_vel"]["rate_hz"] is None
    (sentence,) = document["missing"]
    assert sentence.endswith("the nearest of its type is /camera/color")
