"""One publisher, subscriber or server of a robot, as its graph shows it."""

from __future__ import annotations

from dataclasses import dataclass

PUBLISHER, SUBSCRIBER, SERVER, ACTION_SERVER = "MP", "MS", "SS", "AS"
SEND_GOAL = "/_action/send_goal"  # end of the name of the service that takes an action's goals


@dataclass(frozen=True, slots=True)
class Endpoint:
    """A publisher, a subscriber or a server.

    Attributes:
        kind: ``MP``, ``MS``, ``SS`` or ``AS`` (an action, as the bridge names it).
        node: full name with its namespace, such as ``/robot/camera``; empty if unknown.
        topic: of a service its name; with its outer slash.
        ros_type: ``pkg/msg/Type``.
        type_hash: ``RIHS01_`` and 64 digits; empty where the network has none.
        backends: whether the token ends in a list of buffer backends (Lyrical, Rolling).
    """

    kind: str
    node: str
    topic: str
    ros_type: str
    type_hash: str
    backends: bool = False


def serves_action(endpoints: tuple[Endpoint, ...], action: str) -> bool:
    """Whether a node serves this action."""
    return any(
        (each.kind == SERVER and each.topic == f"{action}{SEND_GOAL}")
        or (each.kind == ACTION_SERVER and each.topic == action)
        for each in endpoints
    )
