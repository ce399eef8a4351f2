"""Two simulated robots in one apartment with one map, as real processes."""

from __future__ import annotations

import json
import math
import subprocess
import sys
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from onemap import Client
from onemap_shared.config import PREFIX
from onemap_shared.services import SERVICES
from onemap_simulator.config import SimulatorConfig
from onemap_simulator.generation.apartment import generate_apartment
from onemap_simulator.generation.style import STYLES
from onemap_simulator.parts import scene_truth
from tests.end_to_end.system import START_S, System

pytestmark = pytest.mark.timeout(1500)

SEED, THING = 2, "refrigerator"  # in the kitchen; the apartment's start is in the living room
ROBOTS = {"r1": "site/r1", "r2": "site/r2"}
MAPPING = ("simulator", "perception", "mapper", "planner")  # r1's; r2 has no mapper
SEARCH_S = 400.0  # on shared cores; 20 s on two that are free
NEAR_M = 1.5  # of the thing's middle
BEFORE_M = 1.2  # from where it is found to where the first robot starts
VIEW_M = 3.0  # from where a robot looks at it; the start is farther away


def start_of_the_first() -> tuple[float, float, float]:
    """A place on the way to the thing, in sight of it, and the way to look.

    Not before it: what stands below the camera's image there, a robot that starts may run into.
    """
    scene = generate_apartment(SEED, STYLES["training"])
    truth = scene_truth(scene, SimulatorConfig())
    path = truth.shortest_path(THING, *scene.start[:2])
    x_m, y_m = next(xy for xy in reversed(path) if math.dist(xy, path[-1]) >= BEFORE_M)
    index = next(k for k, each in enumerate(scene.objects) if each.category == THING)
    corners = scene.vertices[scene.faces[scene.face_object == index]].reshape(-1, 3)
    to_x, to_y = (corners.min(axis=0) + corners.max(axis=0))[:2] / 2 - (x_m, y_m)
    return float(x_m), float(y_m), math.atan2(to_y, to_x)


def start(system: System, robot: str, service: str) -> subprocess.Popen[bytes]:
    """A service of one robot, in its namespace."""
    own: dict[str, object] = {
        "BUS__NAMESPACE": ROBOTS[robot],
        "PLANNER__STATE_DIR": str(system.folder / robot / "planner"),
    }
    if robot == "r1":
        own["SIMULATOR__START"] = start_of_the_first()
    variables = {f"{PREFIX}{name}": json.dumps(value) for name, value in own.items()}
    command = (sys.executable, "-m", SERVICES[service].module, "--config")
    with system.log(f"{robot}-{service}").open("ab") as log:
        process = subprocess.Popen(
            (*command, str(system.configuration)),
            stdin=subprocess.DEVNULL,
            stdout=log,
            stderr=subprocess.STDOUT,
            env={**system.environment, **variables},
        )
    system.processes[f"{robot}-{service}"] = process
    return process


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> Iterator[System]:
    sections: dict[str, dict[str, Any]] = {
        "gateway": {"robots": ROBOTS},
        "simulator": {"seed": SEED, "rgbd_hz": 4.0},
        "mapper": {"robots": list(ROBOTS.values())},
    }
    with System(tmp_path_factory.mktemp("shared"), ("gateway",), sections) as system:
        for service in MAPPING:
            start(system, "r1", service)
        yield system
        for name, process in system.processes.items():
            if name not in ("router", "gateway"):
                system.resume(name)
                process.terminate()


def get(system: System, robot: str, path: str) -> dict[str, Any]:
    found: dict[str, Any] = system.http.get(f"/robots/{robot}/v1/{path}").json()
    return found


def metrics(system: System, robot: str, service: str) -> dict[str, float]:
    """What the service last said of its work; empty before that."""
    services = {each["name"]: each for each in get(system, robot, "status")["services"]}
    said: dict[str, float] = services.get(service, {}).get("metrics") or {}
    return said


def problem(system: System, robot: str) -> str:
    robots = system.http.get("/v1/robots").json()["robots"]
    return str({each["name"]: each["problem"] for each in robots}[robot])


def ready(system: System, robot: str) -> bool:
    return system.http.get(f"/robots/{robot}/readyz").status_code == 200


def search(system: System, robot: str) -> str:
    started = system.http.post(f"/robots/{robot}/v1/searches", json={"object": THING})
    assert started.status_code == 201, started.text
    address: str = started.headers["location"]
    return address


def test_the_second_robot_profits_from_what_the_first_saw(fleet: System) -> None:
    fleet.until(lambda: ready(fleet, "r1"), "r1 is ready", 2 * START_S)
    assert not ready(fleet, "r2")
    first = search(fleet, "r1")
    fleet.until(lambda: not fleet.http.get(first).json()["active"], "r1 has searched", SEARCH_S)
    status = fleet.http.get(first).json()
    assert status["state"] == "found", status
    (found,) = get(fleet, "r1", "objects")["objects"]
    for service in ("simulator", "perception"):
        start(fleet, "r2", service)
    fleet.until(lambda: "planner" in problem(fleet, "r2"), "r2 lacks its planner", 2 * START_S)
    refused = fleet.http.post("/robots/r2/v1/searches", json={"object": THING})
    assert (refused.status_code, refused.json()["service"]) == (503, "planner")
    start(fleet, "r2", "planner")
    fleet.until(lambda: ready(fleet, "r2"), "r2 is ready", 2 * START_S)
    assert fleet.http.get("/readyz").status_code == 503  # the gateway's own robot is none
    fleet.until(lambda: metrics(fleet, "r2", "simulator"), "r2's simulator says what it does")
    commands = [metrics(fleet, each, "simulator")["commands_received"] for each in ROBOTS]
    assert commands[0] > 0 == commands[1]  # nobody has asked r2
    with Client(str(fleet.http.base_url.join("/robots/r2"))) as client:
        conditions = {each.name: each.condition for each in client.status().services}
    assert conditions["planner"] != "down"
    assert get(fleet, "r2", "objects")["objects"] == [found]
    reply = fleet.http.post("/robots/r2/v1/queries", json={"text": THING}).json()
    centre = reply["regions"][0]["centre_m"]
    assert math.dist(centre, found["position_m"][:2]) < NEAR_M
    second = search(fleet, "r2")

    def drives_there() -> bool:
        choice = fleet.http.get(second).json()["choice"] or {"options": []}
        chosen = [each for each in choice["options"] if each["chosen"]]
        return any(math.dist(each["xy_m"], found["position_m"][:2]) < VIEW_M for each in chosen)

    fleet.until(drives_there, "r2 drives to what r1 saw", SEARCH_S)
    assert fleet.http.get(second).json()["choice"]["number"] <= 2  # it has not explored first
    fleet.http.delete(second)


def test_a_robot_whose_frames_end_stops_alone(fleet: System) -> None:
    assert ready(fleet, "r2"), "the test before started it"
    fleet.suspend("r2-perception")
    fleet.until(lambda: not ready(fleet, "r2"), "r2 is not ready", START_S)
    assert problem(fleet, "r2")
    assert ready(fleet, "r1")
    before = get(fleet, "r1", "map")["frames_fused"]
    fleet.until(lambda: get(fleet, "r1", "map")["frames_fused"] > before, "r1 goes on")
    fleet.resume("r2-perception")
    fleet.until(lambda: ready(fleet, "r2"), "r2 is back", START_S)
    counts = [metrics(fleet, robot, "mapper") for robot in ROBOTS]
    assert all(each["robot_frames_fused"] > 0 and each["frames_late"] == 0 for each in counts)
    assert np.ptp([each["frames_fused"] for each in counts]) < 100  # of one map
