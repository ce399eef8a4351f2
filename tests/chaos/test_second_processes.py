"""A second process of every role on one bus, and two planners with one robot."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from onemap_shared import keys
from onemap_shared.messages import VelocityCommand
from onemap_shared.services import SERVICES
from tests.chaos.report import Attack
from tests.end_to_end.system import START_S, System
from tests.end_to_end.test_faults import absent_object

pytestmark = pytest.mark.timeout(300)

COMMANDS = 120  # of both planners, three seconds
# A planner that does not ask whether another one runs, as one of an earlier release.
UNASKED = """
import runpy, sys
from onemap_shared.bus import ZenohBus

ZenohBus.claim = lambda self: self.announce() or ()
runpy.run_module("onemap_planner", run_name="__main__", alter_sys=True)
"""


@contextmanager
def second(system: System, *command: str) -> Iterator[subprocess.Popen[bytes]]:
    """Another process with this system's configuration, killed at the end."""
    process = subprocess.Popen(
        (sys.executable, *command, "--config", str(system.configuration)),
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        env=system.environment,
    )
    try:
        yield process
    finally:
        process.kill()
        process.wait()


def test_a_second_process_of_each_role(attack: Attack, system: System) -> None:
    system.until(system.is_ready, "the system is ready", START_S)
    codes = {}
    for name in ("perception", "mapper", "planner", "simulator"):
        with second(system, "-m", SERVICES[name].module) as process:
            codes[name] = process.wait(60)
    attack.holds(
        "a second perception, mapper, planner and simulator",
        limit="each ends with code 1, the first go on",
        measured=f"codes {codes}, ready {system.is_ready()}",
        held=set(codes.values()) == {1} and system.is_ready(),
    )


def taken(system: System, count: int) -> list[VelocityCommand]:
    """The next commands on the bus, or those of four seconds."""
    commands = system.monitor.bus.subscribe(keys.ROBOT_CMD_VEL, capacity=1000)
    received: list[VelocityCommand] = []
    while len(received) < count and (command := commands.take(1.0)) is not None:
        received.append(command)
    return received


def test_two_planners_and_one_robot(attack: Attack, system: System) -> None:
    started = system.http.post("/v1/searches", json={"object": absent_object(system)})
    assert started.status_code == 201, started.text
    system.until(lambda: system.monitor.moves, "the robot moves", START_S)
    first = system.monitor.odometry[-1].planner
    with second(system, "-c", UNASKED):  # it resumes the same search from the journal
        problem = "2 processes are the planner"
        system.until(lambda: problem in system.http.get("/v1/status").text, problem, 60.0)
        received = taken(system, COMMANDS)
        rivals = [command for command in received if command.planner != first]
        moving = [command for command in rivals if command.moves]
        followed = {message.planner for message in system.monitor.odometry}
        attack.holds(
            "two planners in one search",
            limit="the robot follows the first; the second sends stops",
            measured=f"{len(rivals)} of {len(received)} commands of the second, {len(moving)} move",
            held=followed == {first} and bool(rivals) and not moving,
        )
        reply = system.http.delete(f"/v1/searches/{started.json()['id']}")
        system.monitor.odometry.clear()
        system.until(lambda: system.monitor.stands, "the robot stands", 10.0)
        after = taken(system, COMMANDS)
        attack.holds(
            "a cancel beside a second planner",
            limit="0 commands that move afterwards",
            measured=f"{reply.json()['state']}, {sum(c.moves for c in after)} of {len(after)} move",
            held=reply.json()["state"] == "cancelled" and not any(c.moves for c in after),
        )
