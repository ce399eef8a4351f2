"""Keys, the roles that use them, and the access control that a router is given."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from typing import Any

import pytest

from onemap_shared import keys
from onemap_shared.access_control import access_control
from onemap_shared.keys import ROLES, Procedure, Topic
from onemap_shared.services import SERVICES
from tests.structure import ROOT, modules

TOPICS = [value for value in vars(keys).values() if isinstance(value, Topic)]
PROCEDURES = [value for value in vars(keys).values() if isinstance(value, Procedure)]


PACKAGES = {
    "robot": ("onemap_simulator", "onemap_ros2"),
    "perception": ("onemap_perception",),
    "mapper": ("onemap_mapper",),
    "planner": ("onemap_planner",),
    "gateway": ("onemap_gateway",),
}
SHARED_USE = {
    "robot": {keys.RGBD_RECEIPTS.key},  # bus
    "perception": {keys.FIELD_RECEIPTS.key},  # bus
    "mapper": {keys.EMBED_TEXT.key, keys.EMBED_IMAGE.key},  # text_embedding
    "planner": {keys.EMBED_TEXT.key},  # text_embedding
}


def used(role: str) -> set[str]:
    """The keys that the role's packages name, however they are imported."""
    named = {n: v.key for n, v in vars(keys).items() if isinstance(v, Topic | Procedure)}
    found = set()
    for module in modules(ROOT):
        if module.package in PACKAGES[role]:
            for node in ast.walk(module.tree):
                name = node.attr if isinstance(node, ast.Attribute) else getattr(node, "id", "")
                found |= {named[name]} if name in named else set()
    return found


@pytest.mark.parametrize("role", PACKAGES)
def test_a_role_may_do_what_its_service_does_and_no_more(role: str) -> None:
    access = keys.ROLES[role]
    topics, procedures = access.publishes + access.subscribes, access.serves + access.calls
    allowed = {topic.key for topic in topics} | {procedure.key for procedure in procedures}
    assert allowed == used(role) | SHARED_USE.get(role, set())


def test_every_key_has_a_role_on_each_side() -> None:
    roles = keys.ROLES.values()
    for topic in set(TOPICS) - {keys.ALL_HEARTBEATS}:
        assert sum(topic in role.publishes for role in roles) == 1, topic.key
        assert any(topic in role.subscribes for role in roles), topic.key
    for procedure in PROCEDURES:
        assert sum(procedure in role.serves for role in roles) == 1, procedure.key


def test_every_service_is_of_one_role() -> None:
    names = [name for role in keys.ROLES.values() for name in role.names]
    assert len(names) == len(set(names))
    assert set(SERVICES) <= set(names)


def rules_of(section: dict[str, Any], subject: str) -> Iterator[dict[str, Any]]:
    (policy,) = (policy for policy in section["policies"] if policy["subjects"] == [subject])
    yield from (rule for rule in section["rules"] if rule["id"] in policy["rules"])


def allowed(section: dict[str, Any], role: str, message: str) -> set[str]:
    """The keys on which a client of the role may send this kind of message."""
    return {
        key
        for rule in rules_of(section, role)
        if rule["flows"] == ["ingress"] and message in rule["messages"]
        for key in rule["key_exprs"]
    }


def test_only_the_planner_commands_and_only_the_robot_reports() -> None:
    section = access_control()
    for key, only in (
        (keys.ROBOT_CMD_VEL.key, "planner"),
        (keys.ROBOT_ODOMETRY.key, "robot"),
        (keys.FIELD.key, "perception"),
    ):
        assert {role for role in ROLES if key in allowed(section, role, "put")} == {only}
    clears = {role for role in ROLES if keys.MAP_CLEAR.key in allowed(section, role, "query")}
    assert clears == {"gateway"}


@pytest.mark.parametrize("role", ROLES)
def test_no_role_may_delete_or_speak_for_another(role: str) -> None:
    section = access_control()
    assert allowed(section, role, "delete") == set()
    tokens = allowed(section, role, "liveliness_token")
    assert tokens == {keys.liveliness(name, "*") for name in ROLES[role].names}
    beats = {key for key in allowed(section, role, "put") if key.startswith("health")}
    assert beats == {keys.heartbeat(name).key for name in ROLES[role].names}
