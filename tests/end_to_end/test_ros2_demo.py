"""The whole demo with its robot behind ROS 2's formats."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = [pytest.mark.slow, pytest.mark.timeout(420)]

SEARCH_S = 150  # enough to drive and to map on busy cores; to find, on idle ones


def test_a_robot_of_ros_2_is_mapped_with_driven_and_judged(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "onemap_tools", "demo", "--ros2", "--headless", "--json"]
    limits = ["--objects", "bed", "--time-limit", str(SEARCH_S), "--out", str(tmp_path)]
    done = subprocess.run(
        [*command, *limits], capture_output=True, text=True, check=False, timeout=400
    )
    summary = json.loads(done.stdout.splitlines()[-1])
    assert done.returncode == (0 if summary["worked"] else 1), done.stderr
    (bed,) = summary["objects"]
    assert bed["path_length_m"] > 1.0, done.stderr  # velocities reached the base, odometry came
    assert summary["map_rate_hz"] > 0.0  # frames reached the map
    assert bed["judged"]  # the simulator answered beside its ROS 2 network
    assert summary["contacts"] is not None
    log = (Path(summary["folder"]) / "logs" / "ros2.log").read_text(encoding="utf-8")
    assert "velocities go to /cmd_vel as geometry_msgs/msg/TwistStamped" in log
