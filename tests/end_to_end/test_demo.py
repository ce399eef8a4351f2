"""The demo as real processes, from its start to its summary: with two robots, and over ROS 2.

Each search is cancelled as soon as it did what the test is about.
"""

from __future__ import annotations

import json
import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from subprocess import PIPE, STDOUT, Popen, TimeoutExpired
from typing import Any

import httpx
import pytest

from onemap_shared.config import PREFIX
from onemap_tools.processes.network import any_free_port
from tests.end_to_end.system import CHECK_S, HTTP_S, START_S

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]

ROBOTS, OBJECTS = ("r1", "r2"), ("refrigerator", "bed")


@contextmanager
def demo(folder: Path, *options: str) -> Iterator[tuple[Popen[str], httpx.Client]]:
    """A demo, with few images: the tests are about the composition, not about the search."""
    port = any_free_port()
    command = [sys.executable, "-m", "onemap_tools", "demo", "--headless", "--json", *options]
    limits = ["--time-limit", str(3 * START_S), "--out", str(folder), "--port", str(port)]
    process = Popen(
        [*command, *limits],
        stdout=PIPE,
        stderr=STDOUT,
        text=True,
        env={**os.environ, f"{PREFIX}SIMULATOR__RGBD_HZ": "2"},
    )
    with httpx.Client(base_url=f"http://127.0.0.1:{port}", timeout=HTTP_S) as http:
        try:
            yield process, http
        except BaseException:
            process.terminate()
            process.communicate(timeout=START_S)
            raise


def summary_of(process: Popen[str]) -> dict[str, Any]:
    """What a demo whose searches were cancelled says at its end."""
    output, _ = process.communicate(timeout=START_S)
    assert process.returncode == 1, output
    summary: dict[str, Any] = json.loads(output.splitlines()[-1])
    return summary


def get(http: httpx.Client, path: str) -> dict[str, Any]:
    """A document; an empty one while there is none."""
    try:
        found = http.get(path)
    except httpx.TransportError:
        return {}
    document: dict[str, Any] = found.json() if found.status_code == 200 else {}
    return document


def processes_of(folder: Path) -> list[str]:
    """The command lines of the processes that were given a file below the folder."""
    lines = []
    for file in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            lines.append(file.read_bytes().replace(b"\0", b" ").decode())
        except OSError:  # it ended in between
            continue
    return [line for line in lines if f"{folder}/" in line]


def until(true: Callable[[], bool], demo: Popen[str], what: str) -> None:
    deadline_s = time.monotonic() + 3 * START_S
    while not true():
        with suppress(TimeoutExpired):
            demo.wait(CHECK_S)
        assert demo.returncode is None, f"the demo ended; waited for: {what}"
        assert time.monotonic() < deadline_s, f"not in time: {what}"


def test_two_robots_search_on_one_map_and_all_ends_with_a_summary(tmp_path: Path) -> None:
    options = ("--robots", "2", "--seed", "2", "--objects", ",".join(OBJECTS))
    with demo(tmp_path, *options) as (process, http):

        def search(robot: str) -> dict[str, Any]:
            return get(http, f"/robots/{robot}/v1/searches/current")

        until(lambda: all(search(robot) for robot in ROBOTS), process, "both robots search")
        assert [search(robot)["objects"] for robot in ROBOTS] == [[name] for name in OBJECTS]
        assert all(get(http, f"/robots/{name}/v1/map")["frames_fused"] > 0 for name in ROBOTS)
        assert all("<title>" in http.get(f"/robots/{robot}/").text for robot in ROBOTS)
        services = {"simulator", "perception", "mapper", "planner"}
        listed = get(http, "/v1/robots")["robots"]
        assert all(services <= set(robot["services"]) for robot in listed)
        assert len(processes_of(tmp_path)) == 9
        for robot in ROBOTS:
            http.delete(f"/robots/{robot}/v1/searches/current")
        summary = summary_of(process)
    assert [robot["name"] for robot in summary["robots"]] == list(ROBOTS)
    assert all(robot["contacts"] is not None for robot in summary["robots"])
    assert summary["map_rate_hz"] is not None
    assert Path(summary["picture"]).is_file()
    assert processes_of(tmp_path) == []


def test_a_robot_of_ros_2_is_mapped_with_driven_and_judged(tmp_path: Path) -> None:
    with demo(tmp_path, "--ros2", "--objects", "bed") as (process, http):

        def driven_m() -> float:
            return float(get(http, "/v1/searches/current").get("path_length_m", 0.0))

        until(lambda: driven_m() > 1.0, process, "velocities reach the base, odometry comes")
        http.delete("/v1/searches/current")
        summary = summary_of(process)
    assert summary["map_rate_hz"] > 0.0  # frames reached the map
    assert [bed["judged"] for bed in summary["objects"]] == [True]  # beside its ROS 2 network
    assert summary["contacts"] is not None
    log = (Path(summary["folder"]) / "logs" / "ros2.log").read_text(encoding="utf-8")
    assert "velocities go to /cmd_vel as geometry_msgs/msg/TwistStamped" in log
