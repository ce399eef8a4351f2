"""Zenoh's access control from the table of roles: what is not in the table is refused.

A router reads it as its section ``access_control``. It judges what comes from a client by the
name in the client's certificate; what a client is sent follows from what it was let declare.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from onemap_shared.keys import ALL_HEARTBEATS, ALL_LIVELINESS, ROLES, Access, heartbeat, liveliness

LOCAL = "local"
EVERYTHING = (
    "put",
    "delete",
    "declare_subscriber",
    "query",
    "reply",
    "declare_queryable",
    "liveliness_token",
    "liveliness_query",
    "declare_liveliness_subscriber",
)


def access_control(namespace: str = "", roles: Mapping[str, Access] = ROLES) -> dict[str, Any]:
    """The section for keys below ``namespace``, as in ``bus.namespace``; empty: without one.

    A link over plain TCP has no certificate. Routers that control access listen for it on
    loopback only, so it is one of this machine, and may do everything.
    """
    rules = [
        _rule("sent", "egress", EVERYTHING, ["**"]),
        _rule(LOCAL, "ingress", EVERYTHING, ["**"]),
    ]
    subjects: list[dict[str, Any]] = [{"id": LOCAL, "link_protocols": ["tcp"]}]
    policies = [{"subjects": [LOCAL], "rules": ["sent", LOCAL]}]
    for role, access in roles.items():
        own = [
            _rule(f"{role}-{message}", "ingress", [message], [_below(namespace, k) for k in keys])
            for message, keys in _allowed(access).items()
            if keys
        ]
        rules += own
        subjects.append({"id": role, "cert_common_names": [role], "link_protocols": ["tls"]})
        policies.append({"subjects": [role], "rules": ["sent", *(rule["id"] for rule in own)]})
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": rules,
        "subjects": subjects,
        "policies": policies,
    }


def _allowed(access: Access) -> dict[str, list[str]]:
    """The keys of each kind of message that a client of this role may send, sorted."""
    latched = [topic.key for topic in access.publishes if topic.latched]
    served = [procedure.key for procedure in access.serves]
    asked = [topic.key for topic in access.subscribes if topic.latched]
    beats = [heartbeat(name).key for name in access.names]  # heard by a container's health check
    heard = [topic.key for topic in access.subscribes]
    allowed: dict[str, Iterable[str]] = {
        "put": [*(topic.key for topic in access.publishes), *beats],
        "declare_subscriber": heard if ALL_HEARTBEATS.key in heard else [*heard, *beats],
        "declare_queryable": [*served, *latched],
        "reply": [*served, *latched],
        "query": [*(procedure.key for procedure in access.calls), *asked],
        "liveliness_token": [liveliness(name, "*") for name in access.names],
        "liveliness_query": [ALL_LIVELINESS],
        "declare_liveliness_subscriber": [ALL_LIVELINESS],
    }
    return {message: sorted(keys) for message, keys in allowed.items()}


def _rule(name: str, flow: str, messages: Iterable[str], keys: list[str]) -> dict[str, Any]:
    return {
        "id": name,
        "permission": "allow",
        "flows": [flow],
        "messages": list(messages),
        "key_exprs": keys,
    }


def _below(namespace: str, key: str) -> str:
    return f"{namespace}/{key}" if namespace else key
