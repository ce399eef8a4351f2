"""The demo with two robots as real processes, from its start to its summary."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import httpx
import pytest

from onemap_shared.config import PREFIX
from onemap_tools.processes.network import any_free_port
from tests.end_to_end.system import CHECK_S, HTTP_S, START_S

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]

ROBOTS, OBJECTS = ("r1", "r2"), ("refrigerator", "bed")


def started(folder: Path, port: int) -> subprocess.Popen[str]:
    """The demo, with few images: the test is about the composition, not about the search."""
    command = [sys.executable, "-m", "onemap_tools", "demo", "--robots", "2", "--headless"]
    given = ["--json", "--seed", "2", "--objects", ",".join(OBJECTS), "--port", str(port)]
    limits = ["--time-limit", str(3 * START_S), "--out", str(folder)]
    return subprocess.Popen(
        [*command, *given, *limits],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        env={**os.environ, f"{PREFIX}SIMULATOR__RGBD_HZ": "2"},
    )


def processes_of(folder: Path) -> list[str]:
    """The command lines of the processes that were given a file below the folder."""
    lines = []
    for file in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            lines.append(file.read_bytes().replace(b"\0", b" ").decode())
        except OSError:  # it ended in between
            continue
    return [line for line in lines if f"{folder}/" in line]


def until(true: Callable[[], bool], demo: subprocess.Popen[str], what: str) -> None:
    deadline_s = time.monotonic() + 3 * START_S
    while not true():
        with suppress(subprocess.TimeoutExpired):
            demo.wait(CHECK_S)
        assert demo.returncode is None, f"the demo ended; waited for: {what}"
        assert time.monotonic() < deadline_s, f"not in time: {what}"


def test_two_robots_search_on_one_map_and_all_ends_with_a_summary(tmp_path: Path) -> None:
    port = any_free_port()
    demo = started(tmp_path, port)

    def get(robot: str, path: str) -> dict[str, Any]:
        try:
            found = http.get(f"/robots/{robot}/{path}")
        except httpx.TransportError:
            return {}
        document: dict[str, Any] = found.json() if found.status_code == 200 else {}
        return document

    def search(robot: str) -> dict[str, Any]:
        return get(robot, "v1/searches/current")

    with httpx.Client(base_url=f"http://127.0.0.1:{port}", timeout=HTTP_S) as http:
        try:
            until(lambda: all(search(robot) for robot in ROBOTS), demo, "both robots search")
            assert [search(robot)["objects"] for robot in ROBOTS] == [[name] for name in OBJECTS]
            assert [get(robot, "v1/map")["frames_fused"] > 0 for robot in ROBOTS] == [True, True]
            pages = [http.get(f"/robots/{robot}/") for robot in ROBOTS]
            assert all("<title>" in page.text for page in pages)
            listed = http.get("/v1/robots").json()["robots"]
            services = {"simulator", "perception", "mapper", "planner"}
            assert all(services <= set(robot["services"]) for robot in listed)
            assert len(processes_of(tmp_path)) == 9
            for robot in ROBOTS:
                http.delete(f"/robots/{robot}/v1/searches/current")
        except BaseException:
            demo.terminate()
            raise
        finally:
            output, _ = demo.communicate(timeout=START_S)
    assert demo.returncode == 1, output
    summary = json.loads(output.splitlines()[-1])
    assert [robot["name"] for robot in summary["robots"]] == list(ROBOTS)
    assert all(robot["contacts"] is not None for robot in summary["robots"])
    assert summary["closest_m"] > 1.0  # they start in different rooms
    assert summary["map_rate_hz"] is not None
    assert Path(summary["picture"]).is_file()
    assert processes_of(tmp_path) == []
