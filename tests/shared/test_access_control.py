"""The router's access control says what the table of roles says."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from onemap_shared import keys
from onemap_shared.access_control import access_control
from onemap_shared.keys import ROLES


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


def test_what_is_not_allowed_is_refused() -> None:
    section = access_control()
    assert section["enabled"] is True
    assert section["default_permission"] == "deny"
    assert {rule["permission"] for rule in section["rules"]} == {"allow"}
    names = [rule["id"] for rule in section["rules"]]
    assert len(names) == len(set(names))
    assert all(rule["key_exprs"] for rule in section["rules"])


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


def test_latched_topics_are_asked_for_and_answered() -> None:
    section, latched = access_control(), keys.SEARCH_STATE.key
    assert latched in allowed(section, "planner", "declare_queryable")
    assert latched in allowed(section, "planner", "reply")
    assert latched in allowed(section, "gateway", "query")
    assert latched not in allowed(section, "mapper", "query")


def test_keys_lie_below_the_namespace() -> None:
    plain, fleet = access_control(), access_control("fleet/r1")
    for role in ROLES:
        for message in ("put", "query", "declare_subscriber", "liveliness_token"):
            below = {f"fleet/r1/{key}" for key in allowed(plain, role, message)}
            assert allowed(fleet, role, message) == below
