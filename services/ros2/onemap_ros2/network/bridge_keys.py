"""Names of zenoh-bridge-ros2dds: keys of topics, tokens of the graph, caches of latched topics.

As zenoh-plugin-ros2dds 1.x has them. A key is the topic's name without its outer slash, with no
domain, type, hash or attachment; a bridge's namespace stands before it, which is why topics carry
their namespace here too. Keys of the robot's network, not of OneMap's bus.
"""

from __future__ import annotations

from onemap_ros2.network.endpoint import (
    ACTION_SERVER,
    PUBLISHER,
    SERVER,
    SUBSCRIBER,
    Endpoint,
)

ADMIN, GRAPH, CACHE = "@", "@ros2_lv", "@ros2_pub_cache"
SLASH = "§"  # stands for one inside a token
TOKEN_PARTS = 6  # @, session, @ros2_lv, kind, key, type; topics have their quality of service too
KINDS = (PUBLISHER, SUBSCRIBER, SERVER, ACTION_SERVER)
# key:reliability:durability:history,depth, in the numbers of DDS; empty where default
QOS_RELIABLE = ":1::0,10"
QOS_TRANSIENT_LOCAL = ":1:1:0,1"


def topic_key(topic: str) -> str:
    """The key on which a topic's messages, or a service's questions, travel."""
    return topic.strip("/")


def graph_key() -> str:
    """The key expression of all tokens of all bridges."""
    return f"{ADMIN}/*/{GRAPH}/**"


def bridge_token(session: str) -> str:
    """The token of a bridge; ``session``: the id of its Zenoh session."""
    return f"{ADMIN}/{session}/{GRAPH}"


def endpoint_token(session: str, endpoint: Endpoint, qos: str) -> str:
    """The token of a publisher or a subscriber."""
    key = topic_key(endpoint.topic).replace("/", SLASH)
    ros_type = endpoint.ros_type.replace("/", SLASH)
    return f"{bridge_token(session)}/{endpoint.kind}/{key}/{ros_type}/{qos}"


def parse_token(token: str) -> Endpoint | None:
    """The endpoint of a token; None for any other token."""
    parts = token.split("/")
    if len(parts) < TOKEN_PARTS or parts[0] != ADMIN or parts[2] != GRAPH:
        return None
    kind, key, ros_type = parts[3:6]
    if kind not in KINDS:
        return None
    return Endpoint(kind, "", "/" + key.replace(SLASH, "/"), ros_type.replace(SLASH, "/"), "")


def cache_key(topic: str, session: str = "*") -> str:
    """Where the newest messages of a latched topic are asked for; ``*``: of all bridges."""
    return f"{ADMIN}/{session}/{CACHE}/{topic_key(topic)}"
