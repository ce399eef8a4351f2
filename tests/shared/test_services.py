from __future__ import annotations

import importlib.util
from importlib.metadata import metadata
from pathlib import Path

from onemap_shared.services import (
    ALL,
    ROBOTS,
    SERVICES,
    STAGES,
    doubled,
    doubled_sentence,
)

ROOT = Path(__file__).parents[2]


def test_every_service_has_a_module_to_run_and_an_extra_that_installs_it() -> None:
    extras = metadata("onemap").get_all("Provides-Extra") or []
    for service in ALL:
        assert importlib.util.find_spec(f"{service.module}.__main__"), service
        assert service.extra in extras, service


def test_every_service_folder_is_listed() -> None:
    packages = {path.name for path in (ROOT / "services").glob("*/onemap_*")}
    assert packages == {service.module.split(".")[0] for service in ALL}


def test_the_named_groups_are_services() -> None:
    assert {*ROBOTS, *STAGES} < set(SERVICES)


def test_two_processes_of_one_role_are_named() -> None:
    members = {("planner", "a"), ("mapper", "b"), ("gateway", "c"), ("gateway", "d"), ("up", "e")}
    assert doubled(members) == {}
    twice = doubled({*members, ("planner", "f"), ("simulator", "g"), ("robot", "h")})
    assert twice == {"robot": ("robot h", "simulator g"), "planner": ("planner a", "planner f")}
    assert doubled_sentence("robot", twice["robot"]) == (
        "2 processes are the robot (robot h, simulator g): their messages mix"
    )
