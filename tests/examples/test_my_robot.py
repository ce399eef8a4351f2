"""The example that a user copies runs as it is."""

from __future__ import annotations

import signal
import subprocess
import sys

from onemap_shared import keys
from tests.shared.test_bus import Router, eventually, join, router
from tests.test_architecture import ROOT

__all__ = ["router"]  # the fixture


def test_the_example_robot_sends_frames_and_odometry_and_stops(router: Router) -> None:
    bus = join(router, "planner")
    frames, odometry = bus.subscribe(keys.ROBOT_RGBD), bus.subscribe(keys.ROBOT_ODOMETRY)
    script = ROOT / "examples" / "my_robot.py"
    robot = subprocess.Popen([sys.executable, str(script), router.endpoint])
    first = eventually(lambda: frames.take(0.5))
    later = eventually(lambda: frames.take(0.5))
    assert later.sequence > first.sequence
    assert first.T_map_camera[2, 3] == 1.0
    assert eventually(lambda: odometry.take(0.5)).stamp_ns > 0
    robot.send_signal(signal.SIGINT)
    assert robot.wait(timeout=10) == 0
    bus.close()
