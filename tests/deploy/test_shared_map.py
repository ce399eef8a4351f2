"""Two robots with one map, under compose and under systemd: who meets whom on which keys."""

from __future__ import annotations

import math
import shlex
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from onemap_shared.config import BusConfig, read, section
from onemap_simulator.config import SimulatorConfig
from onemap_simulator.physics.collision import CollisionMap
from onemap_simulator.service import open_scene
from tests.deploy.deployment import (
    COMMON,
    DEPLOY,
    UNITS,
    compose,
    compose_document,
    models,
    mounts,
    settings,
    with_file,
)

R1, R2 = "site/r1", "site/r2"
MIN_APART_M = 1.0  # between the middles of two robots
NAMESPACES = {  # of every process
    "perception": R1,
    "perception-r2": R2,
    "mapper": R1,
    "planner": R1,
    "planner-r2": R2,
    "gateway": R1,
}
Sections = Mapping[str, Any]
BOTH = pytest.mark.parametrize("deployment", ["compose", "systemd"])


@cache
def containers() -> dict[str, dict[str, Any]]:
    """The services of both compose files as compose joins them."""
    before, joined = compose(), {}
    for name, added in compose("compose.robots.yaml").items():
        base = added.pop("extends", {"file": "compose.yaml", "service": name})
        assert base["file"] == "compose.yaml"
        joined[name] = with_file(before[base["service"]], added)
    return before | joined


def of_container(name: str) -> Sections:
    service = containers()[name]
    command = service["command"]
    file = Path(command[command.index("--config") + 1]).name
    return read(DEPLOY / "config" / file, given(service["environment"]))


def of_unit(name: str) -> Sections:
    """What the unit's process reads where ONEMAP_CONFIG is shared-map.yaml."""
    service, _, robot = name.partition("-")
    file = UNITS / f"onemap-{service}{'@' if robot else ''}.service"
    assignments = [
        assignment.replace("%i", robot)
        for path in (COMMON, file)
        for line in settings(path).get("Environment", [])
        for assignment in shlex.split(line)
    ]
    environment = dict(assignment.split("=", 1) for assignment in assignments)
    return read(DEPLOY / "config" / "shared-map.yaml", given(environment))


def given(environment: Mapping[str, str]) -> dict[str, str]:
    """The environment with a word for what a person has to give."""
    return {
        name: "secret" if value.startswith("${") else value for name, value in environment.items()
    }


def deployed(deployment: str) -> dict[str, Sections]:
    """What each process reads."""
    reads = of_container if deployment == "compose" else of_unit
    found = {name: reads(name) for name in NAMESPACES}
    for sections in found.values():
        for part, model in models().items():
            section(sections, part, model)
    return found


@BOTH
def test_each_process_is_under_its_robots_keys(deployment: str) -> None:
    found = deployed(deployment)
    assert {
        name: section(sections, "bus", BusConfig).namespace for name, sections in found.items()
    } == NAMESPACES


@BOTH
def test_mapper_and_gateway_know_every_robot(deployment: str) -> None:
    found = deployed(deployment)
    robots = {namespace for name, namespace in NAMESPACES.items() if "perception" in name}
    assert set(found["mapper"]["mapper"]["robots"]) == robots
    assert set(found["gateway"]["gateway"]["robots"].values()) == robots
    for name, namespace in found["gateway"]["gateway"]["robots"].items():
        assert namespace.endswith(f"/{name}")


def test_planners_keep_their_searches_apart() -> None:
    folders = [of_unit(name)["planner"]["state_dir"] for name in ("planner", "planner-r2")]
    assert len(set(folders)) == 2
    volumes = [mounts(containers()[name])["/var/lib/onemap"] for name in ("planner", "planner-r2")]
    assert len(set(volumes)) == 2
    declared = compose_document()["volumes"] | compose_document("compose.robots.yaml")["volumes"]
    assert set(volumes) <= set(declared)


def test_the_simulated_robots_start_apart_in_one_apartment() -> None:
    first, second = (
        section(of_container(name), "simulator", SimulatorConfig)
        for name in ("simulator", "simulator-r2")
    )
    assert first == second.model_copy(update={"start": first.start})
    scene, start = open_scene(first), second.start
    assert start is not None
    assert math.dist(scene.start[:2], start[:2]) > MIN_APART_M
    floor = CollisionMap.of(scene, second.robot.height_m)
    assert floor.clearance_m(*start[:2]) >= second.robot.radius_m
    assert containers()["simulator-r2"]["profiles"] == ["demo"]
