"""A robot never drives by itself after a restart of its planner, its driver, or all."""

from __future__ import annotations

import signal
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from math import dist
from typing import Any

import psutil
import pytest

from onemap_shared.messages import Odometry
from onemap_tools.processes.launch import onemap_command
from tests.end_to_end.system import MOVING_MPS, PATIENCE_S, START_S, System, absent_object

pytestmark = pytest.mark.timeout(1200)

PLANNER_ENDED, DRIVER = "the planner ended before", "driver was restarted"
WATCHED_S = 4.0
STILL_M = 0.02


def searching(system: System) -> dict[str, Any]:
    """A search that drives the robot, and is on disk."""
    system.until(system.is_ready, "frames go all the way to the map", START_S)
    search = system.http.post("/v1/searches", json={"objects": [absent_object(system)]})
    if search.status_code == 409:  # that of the test before
        search = system.http.get("/v1/searches/current")
    assert search.is_success, search.text
    system.until(lambda: system.monitor.moves, "the robot moves", START_S)
    document: dict[str, Any] = search.json()
    records = system.folder / "planner" / "decisions"
    system.until(lambda: list(records.glob(f"*{document['id']}.jsonl")), "the search is on disk")
    return document


def kill_all(system: System) -> None:
    """As power that goes: no process has time for anything."""
    for process in system.processes.values():
        process.kill()
    for process in system.processes.values():
        process.wait()
    system.monitor.odometry.clear()


def start_all(system: System) -> None:
    for name in ("router", *system.services):
        system.start(name)
    system.until(system.is_ready, "all is ready again", START_S)


def newest(system: System) -> Odometry:
    before = system.monitor.odometry[-1] if system.monitor.odometry else None
    system.until(
        lambda: system.monitor.odometry and system.monitor.odometry[-1] is not before, "odometry"
    )
    return system.monitor.odometry[-1]


def stays_where_it_is(system: System) -> None:
    """The robot stands for ``WATCHED_S``, and nobody drives it."""
    first = newest(system).T_map_body
    until_s = time.monotonic() + WATCHED_S
    while time.monotonic() < until_s:
        message = newest(system)
        assert dist(first[:2, 3], message.T_map_body[:2, 3]) < STILL_M
        assert max(abs(message.linear_mps), abs(message.angular_radps)) < MOVING_MPS


def is_interrupted(system: System, search: dict[str, Any], why: str) -> None:
    """The search is over, with the reason, and can be started again."""
    now = system.http.get("/v1/searches/current").json()
    assert (now["id"], now["state"], now["active"]) == (search["id"], "interrupted", False)
    assert why in now["reason"]
    assert now["results"][-1]["outcome"] == "interrupted"
    assert now["updated_at"] >= search["started_at"]
    said = system.onemap("status", "--url", str(system.http.base_url), config=False)
    assert "onemap search --again" in said.stdout
    again = system.http.post("/v1/searches/current/again")
    assert again.status_code == 201, again.text
    assert again.json()["objects"] == search["objects"]
    system.until(lambda: system.monitor.moves, "the robot moves for who asked", START_S)


def test_after_power_was_lost_the_robot_stays_where_it_is(system: System) -> None:
    search = searching(system)
    kill_all(system)
    start_all(system)
    stays_where_it_is(system)
    is_interrupted(system, search, PLANNER_ENDED)


@pytest.mark.parametrize(("killed", "why"), [("planner", PLANNER_ENDED), ("simulator", DRIVER)])
def test_who_was_killed_alone_does_not_go_on(system: System, killed: str, why: str) -> None:
    search = searching(system)
    system.kill(killed)
    system.monitor.odometry.clear()
    system.start(killed)
    system.until(lambda: system.monitor.stands, "the robot brakes", START_S)
    stays_where_it_is(system)  # also while it starts
    system.until(system.is_ready, f"the {killed} is back", START_S)
    stays_where_it_is(system)
    is_interrupted(system, search, why)


@contextmanager
def supervised_planner(system: System) -> Iterator[psutil.Process]:
    """The launcher of ``onemap up``, which runs a planner beside the system's other services."""
    options = ("--config", str(system.configuration), "--logs", str(system.folder / "logs"))
    with (system.folder / "up.txt").open("ab") as log:
        launcher = psutil.Popen(
            onemap_command("up", *options, "--only", "planner"),
            stdout=log,
            stderr=subprocess.STDOUT,
            env={k: v for k, v in system.environment.items() if k != "ONEMAP_PARENT_PID"},
        )
    try:
        system.until(
            lambda: "planner" in system.monitor.alive and system.is_ready(),
            "the planner is there",
            START_S,
        )
        yield launcher
    finally:
        launcher.send_signal(signal.SIGINT)
        assert launcher.wait(PATIENCE_S) == 0


def test_a_supervised_planner_does_not_go_on_and_ctrl_c_ends_the_search(system: System) -> None:
    system.processes["planner"].terminate()
    system.until(lambda: "planner" not in system.monitor.alive, "the planner has left")
    with supervised_planner(system) as launcher:
        search = searching(system)
        (planner,) = launcher.children()
        planner.kill()
        system.monitor.odometry.clear()
        system.until(lambda: system.monitor.stands, "the robot brakes")
        system.until(lambda: launcher.children() not in ([], [planner]), "it is started again")
        system.until(system.is_ready, "the planner is back", START_S)
        stays_where_it_is(system)
        is_interrupted(system, search, PLANNER_ENDED)
        search = system.http.get("/v1/searches/current").json()
    system.until(lambda: "planner" not in system.monitor.alive, "the planner has left")
    system.monitor.odometry.clear()
    with supervised_planner(system):
        stays_where_it_is(system)
        is_interrupted(system, search, "the planner was stopped")
