"""The robot's ROS 2 network over zenoh-bridge-ros2dds, which stands between DDS and Zenoh."""

from __future__ import annotations

from typing import Any

from onemap_ros2.network.interface import (
    ACTION_SERVER,
    PUBLISHER,
    SERVER,
    SUBSCRIBER,
    Endpoint,
    PendingCall,
    Reader,
    RequestReader,
    Writer,
)
from onemap_ros2.network.zenoh_session import RobotSession

ADVICE = "start one on the robot with 'zenoh-bridge-ros2dds', which listens on port 7447"
ADMIN, GRAPH = "@", "@ros2_lv"
SLASH = "§"  # stands for one inside a token
TOKEN_PARTS = 6  # @, session, @ros2_lv, kind, key, type; topics have their quality of service too
KINDS = (PUBLISHER, SUBSCRIBER, SERVER, ACTION_SERVER)
# key:reliability:durability:history,depth, in the numbers of DDS; empty where default
QOS_RELIABLE = ":1::0,10"
QOS_SENSOR = ":0::0,10"  # of readers: a reliable one never matches a best-effort camera
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


def endpoint_token(session: str, endpoint: Endpoint, qos: str = "") -> str:
    """The token of a publisher or a subscriber, or without quality of service of a server."""
    key = topic_key(endpoint.topic).replace("/", SLASH)
    ros_type = endpoint.ros_type.replace("/", SLASH)
    return f"{bridge_token(session)}/{endpoint.kind}/{key}/{ros_type}/{qos}".removesuffix("/")


def parse_token(token: str) -> Endpoint | None:
    """The endpoint of a token; None for any other token."""
    parts = token.split("/")
    if len(parts) < TOKEN_PARTS or parts[0] != ADMIN or parts[2] != GRAPH:
        return None
    kind, key, ros_type = parts[3:6]
    if kind not in KINDS:
        return None
    return Endpoint(kind, "", "/" + key.replace(SLASH, "/"), ros_type.replace(SLASH, "/"), "")


class BridgeNetwork(RobotSession):
    """The robot's topics as bridges from 1.5.1 on show them. Implements ``RosNetwork``."""

    def __init__(self, connect: tuple[str, ...]) -> None:
        super().__init__(connect, ADVICE, parse_token)
        self.announce(bridge_token(self.id))
        self.follow_graph(graph_key())

    def read(
        self,
        topic: str,
        ros_type: str,
        depth: int,
        *,
        latched: bool = False,
        reliable: bool = False,
    ) -> Reader:
        """See ``RosNetwork``."""
        inbox = self.inbox(depth)
        self.subscribe(topic_key(topic), inbox, latched=latched)
        volatile = QOS_RELIABLE if reliable else QOS_SENSOR
        qos = QOS_TRANSIENT_LOCAL if latched else volatile
        self._announce(SUBSCRIBER, topic, ros_type, qos)
        return inbox

    def write(self, topic: str, ros_type: str, *, latched: bool = False) -> Writer:
        """See ``RosNetwork``."""
        publisher = self.publisher(topic_key(topic), latched=latched)
        qos = QOS_TRANSIENT_LOCAL if latched else QOS_RELIABLE
        self._announce(PUBLISHER, topic, ros_type, qos)
        return _BridgeWriter(self, publisher, topic)

    def call(self, service: str, ros_type: str, request: bytes, timeout_s: float) -> PendingCall:
        """See ``RosNetwork``; the bridge knows the type of the service itself."""
        del ros_type
        return self.ask(topic_key(service), request, timeout_s)

    def serve(self, service: str, ros_type: str) -> RequestReader:
        """See ``RosNetwork``; the bridge keeps the client's number itself."""
        inbox = self.answer(topic_key(service), lambda _: None)
        self._announce(SERVER, service, ros_type, "")
        return inbox

    def _announce(self, kind: str, topic: str, ros_type: str, qos: str) -> None:
        self.announce(endpoint_token(self.id, Endpoint(kind, "", topic, ros_type, ""), qos))


class _BridgeWriter:
    def __init__(self, network: BridgeNetwork, publisher: Any, topic: str) -> None:
        self._network, self._publisher, self._topic = network, publisher, topic

    @property
    def has_subscribers(self) -> bool:
        return self._network.has_subscribers(self._topic)

    def put(self, data: bytes) -> None:
        self._publisher.put(data)
