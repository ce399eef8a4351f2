"""The example robot runs as it is."""

from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Iterator
from itertools import count
from pathlib import Path

import numpy as np
import pytest

from onemap_mapper.config import MapperConfig
from onemap_mapper.service import build
from onemap_shared import keys
from onemap_shared.messages import FeatureField, RgbdFrame, VelocityCommand
from onemap_shared.transport import Bus
from tests.memory_bus import MemoryRouter
from tests.shared.test_bus import Router, eventually, join, router
from tests.structure import ROOT

__all__ = ["router"]  # the fixture
pytestmark = pytest.mark.slow


@pytest.fixture
def client(router: Router) -> Iterator[Bus]:
    """A session on the bus of the example robot; the robot ends by SIGINT."""
    bus = join(router, "planner")
    script = ROOT / "examples" / "my_robot.py"
    robot = subprocess.Popen([sys.executable, str(script), router.endpoint])
    yield bus
    robot.send_signal(signal.SIGINT)
    assert robot.wait(timeout=90) == 0
    bus.close()


BLOCKED = """
import importlib.util, sys, threading
spec = importlib.util.spec_from_file_location("my_robot", sys.argv[1])
example = importlib.util.module_from_spec(spec)
spec.loader.exec_module(example)
for method in sys.argv[3:]:
    setattr(example.Robot, method, lambda *_: threading.Event().wait())
example.Robot.drive = lambda self, velocity: print(velocity.linear_mps, flush=True)
example.main(sys.argv[2])
"""


def said(process: subprocess.Popen[str]) -> str:
    """The next line of a process that runs."""
    assert process.stdout is not None
    line = process.stdout.readline()
    assert line, "it has ended"
    return line.strip()


@pytest.mark.parametrize("blocked", [("image",), ("image", "pose")])
def test_a_camera_or_a_pose_that_blocks_delays_no_brake(
    router: Router, blocked: tuple[str, ...]
) -> None:
    """The planner commands and falls silent; the robot drives, stops and ends all the same."""
    bus = join(router, "planner")
    commands = bus.publish(keys.ROBOT_CMD_VEL)
    script = ROOT / "examples" / "my_robot.py"
    robot = subprocess.Popen(
        [sys.executable, "-c", BLOCKED, str(script), router.endpoint, *blocked],
        stdout=subprocess.PIPE,
        text=True,
    )
    for sequence in count(1):
        commands.put(VelocityCommand(sequence, 1, 0.5, 0.0, planner=bus.instance))
        if said(robot) == "0.5":
            break
    while said(robot) != "0.0":
        pass  # for ever, were the brake waiting for the camera
    robot.send_signal(signal.SIGINT)
    assert robot.wait(timeout=90) == 0
    bus.close()


def field_of(frame: RgbdFrame) -> FeatureField:
    """What perception makes of a frame, with the same feature everywhere."""
    return FeatureField(
        sequence=frame.sequence,
        stamp_ns=frame.stamp_ns,
        encoder_id="encoder-a",
        text_space="space-a",
        features=np.full((6, 8, 16), 0.25, np.float16),
        variance=np.ones(frame.depth_mm.shape, np.float32),
        depth_mm=frame.depth_mm,
        intrinsics=frame.intrinsics,
        T_map_camera=frame.T_map_camera,
    )


def test_the_mapper_finds_nothing_wrong_with_the_example(client: Bus, tmp_path: Path) -> None:
    """Frames and odometry arrive, and the robot stops at SIGINT."""
    frames, odometry = client.subscribe(keys.ROBOT_RGBD), client.subscribe(keys.ROBOT_ODOMETRY)
    memory = MemoryRouter()
    mapper = build(memory.bus("mapper"), MapperConfig(map_folder=tmp_path))
    fields = memory.bus("perception").publish(keys.FIELD)
    sequence = -1
    for _ in range(3):
        frame = eventually(lambda: frames.take(0.5))
        assert frame.sequence > sequence
        assert frame.T_map_camera[2, 3] == 1.0
        sequence = frame.sequence
        fields.put(field_of(frame))
        mapper.step(1.0)
    assert eventually(lambda: odometry.take(0.5)).stamp_ns > 0
    health = mapper.health()
    assert (health.ready, health.problem) == (True, "")
    assert health.metrics is not None
    assert health.metrics["frames_fused"] == 3
    assert health.metrics["floor_height_m"] == pytest.approx(0.0, abs=0.01)
    assert health.metrics["floor_wrong"] == 0
