"""Two robots on one router behind one gateway, as real processes."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from typing import Any

import pytest

from onemap import Client
from onemap_shared.config import PREFIX
from onemap_shared.services import SERVICES
from tests.end_to_end.system import START_S, System

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]

ROBOTS = {"r1": "site/r1", "r2": "site/r2"}
SERVED = {
    "r1": ("simulator", "perception", "mapper", "planner"),
    "r2": ("simulator", "perception", "mapper"),  # its planner is missing
}


def start(system: System, robot: str, service: str, seed: int) -> subprocess.Popen[bytes]:
    """A service of one robot, in its namespace."""
    own = {
        "BUS__NAMESPACE": ROBOTS[robot],
        "SIMULATOR__SEED": seed,
        "MAPPER__MAP_FOLDER": str(system.folder / robot / "maps"),
        "PLANNER__STATE_DIR": str(system.folder / robot / "planner"),
    }
    variables = {f"{PREFIX}{name}": json.dumps(value) for name, value in own.items()}
    command = (sys.executable, "-m", SERVICES[service].module, "--config")
    with system.log(f"{robot}-{service}").open("ab") as log:
        return subprocess.Popen(
            (*command, str(system.configuration)),
            stdin=subprocess.DEVNULL,
            stdout=log,
            stderr=subprocess.STDOUT,
            env={**system.environment, **variables},
        )


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> Iterator[System]:
    sections: dict[str, dict[str, Any]] = {
        "gateway": {"robots": ROBOTS},
        "simulator": {"rgbd_hz": 3.0},
    }
    with System(tmp_path_factory.mktemp("fleet"), ("gateway",), sections) as system:
        own = {
            f"{robot}-{service}": start(system, robot, service, seed)
            for seed, (robot, services) in enumerate(SERVED.items(), 1)
            for service in services
        }
        system.processes |= own
        yield system
        for process in own.values():
            process.terminate()


def reports(system: System) -> dict[str, dict[str, Any]]:
    return {each["name"]: each for each in system.http.get("/v1/robots").json()["robots"]}


def fused(system: System, robot: str) -> int:
    count: int = system.http.get(f"/robots/{robot}/v1/map").json().get("frames_fused", 0)
    return count


def test_each_robot_has_its_own_map_and_services(fleet: System) -> None:
    fleet.until(lambda: fleet.ready() is not None, "the gateway answers", START_S)
    fleet.until(
        lambda: all(fused(fleet, robot) > 2 for robot in ROBOTS), "both maps grow", 2 * START_S
    )
    services = {name: set(report["services"]) for name, report in reports(fleet).items()}
    assert services == {name: set(running) for name, running in SERVED.items()}
    maps = [fleet.http.get(f"/robots/{robot}/v1/map.npz").content for robot in ROBOTS]
    assert maps[0] != maps[1]  # of two apartments
    assert fleet.http.get("/readyz").status_code == 503  # the gateway's own robot is none


def test_only_the_robot_that_is_asked_moves(fleet: System) -> None:
    fleet.until(lambda: reports(fleet)["r1"]["ready"], "r1 is ready", START_S)
    refused = fleet.http.post("/robots/r2/v1/searches", json={"object": "bed"})
    assert (refused.status_code, refused.json()["service"]) == (503, "planner")
    started = fleet.http.post("/robots/r1/v1/searches", json={"object": "bed"})
    assert started.status_code == 201, started.text
    address = started.headers["location"]
    assert address.startswith("/robots/r1/v1/searches/")

    def commands(robot: str) -> float:
        """Velocity commands that its simulator has received."""
        services = fleet.http.get(f"/robots/{robot}/v1/status").json()["services"]
        metrics = {each["name"]: each["metrics"] for each in services}
        return float(metrics.get("simulator", {}).get("commands_received") or 0)

    fleet.until(lambda: commands("r1") > 0, "commands reach r1", START_S)
    assert commands("r2") == 0
    with Client(str(fleet.http.base_url.join("/robots/r1"))) as client:
        conditions = {each.name: each.condition for each in client.status().services}
    assert conditions["planner"] != "down"
    assert fleet.http.delete(address).status_code == 200


def test_the_end_of_one_robot_is_not_the_others(fleet: System) -> None:
    killed = fleet.processes.pop("r2-mapper")
    killed.kill()
    killed.wait()
    fleet.until(lambda: "mapper" in str(reports(fleet)["r2"]["problem"]), "r2 lacks its mapper")
    before = fused(fleet, "r1")
    fleet.until(lambda: fused(fleet, "r1") > before, "r1 goes on", START_S)
