"""The robot's connection slows down, as real processes: commands stop it, and it hits nothing."""

from __future__ import annotations

import json
from collections.abc import Iterator

import pytest

from onemap_shared import keys
from onemap_shared.config import PREFIX
from onemap_shared.messages import VelocityCommand
from onemap_tools.processes.services import CORE
from tests.end_to_end.delaying_proxy import DelayingProxy
from tests.end_to_end.system import START_S, System
from tests.end_to_end.test_faults import absent_object

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]

COMMANDS = 60  # three seconds


@pytest.fixture(scope="module")
def slow(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[System, DelayingProxy]]:
    """Every service, and a simulated robot behind a proxy."""
    simulator = {"seed": 1, "rgbd_hz": 6.0}
    with System(tmp_path_factory.mktemp("slow"), CORE, {"simulator": simulator}) as system:
        host, port = system.endpoint.removeprefix("tcp/").split(":")
        proxy = DelayingProxy((host, int(port)))
        system.environment[f"{PREFIX}BUS__CONNECT"] = json.dumps([proxy.endpoint])
        system.start("simulator")
        del system.environment[f"{PREFIX}BUS__CONNECT"]
        system.until(system.is_ready, "frames go all the way to the map", START_S)
        yield system, proxy
        system.processes["simulator"].terminate()
        proxy.close()


def collisions(system: System) -> float:
    return system.monitor.beats["simulator"].metrics["collisions"]


@pytest.mark.parametrize("delay_s", [0.6, 1.0, 1.5])
def test_a_connection_that_slows_down_stops_the_robot(
    slow: tuple[System, DelayingProxy], delay_s: float
) -> None:
    system, proxy = slow
    proxy.delay_s = 0.0
    system.until(system.is_ready, "the robot is ready", START_S)
    started = system.http.post("/v1/searches", json={"object": absent_object(system)})
    assert started.status_code == 201, started.text
    search = f"/v1/searches/{started.json()['id']}"
    system.monitor.odometry.clear()
    system.until(lambda: system.monitor.moves, "the robot moves", START_S)
    commands = system.monitor.bus.subscribe(keys.ROBOT_CMD_VEL, capacity=1000)
    proxy.delay_s = delay_s
    loop = f"a command takes {2 * delay_s:.0f}"[:-1]

    def waits() -> bool:
        return loop in system.http.get(search).json()["reason"]

    system.until(waits, f"the planner says that {loop}")
    taken: list[VelocityCommand] = []
    while commands.take(0.0) is not None:
        pass
    while len(taken) < COMMANDS:
        taken += [command] if (command := commands.take(1.0)) else []
    assert [command for command in taken if command.moves] == []
    system.until(lambda: system.monitor.stands, "the robot stands", 10.0)
    assert collisions(system) == 0.0
    system.http.delete(search)
