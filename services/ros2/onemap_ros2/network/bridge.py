"""The robot's ROS 2 network over zenoh-bridge-ros2dds, which stands between DDS and Zenoh."""
# Talks: answers the robot's network from its threads.

from __future__ import annotations

from typing import Any

import zenoh

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
from onemap_ros2.network.zenoh_session import RobotSession, SampleInbox, callback
from onemap_shared.bus import CLOCK

HISTORY_S = 5.0  # a bridge's own time for the history of a latched topic
ADVICE = "start one on the robot with 'zenoh-bridge-ros2dds', which listens on port 7447"
ADMIN, GRAPH, CACHE = "@", "@ros2_lv", "@ros2_pub_cache"
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


def cache_key(topic: str, session: str = "*") -> str:
    """Where bridges before 1.5.1 keep the newest messages of a latched topic; ``*``: all of them.

    Later ones have the caches of zenoh-ext's advanced publishers, which rmw_zenoh has too.
    """
    return f"{ADMIN}/{session}/{CACHE}/{topic_key(topic)}"


class BridgeNetwork(RobotSession):
    """The robot's topics as bridges show them. Implements ``RosNetwork``."""

    def __init__(self, connect: tuple[str, ...]) -> None:
        super().__init__(connect, ADVICE, parse_token)
        self._latched: dict[str, SampleInbox] = {}
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
        if latched:
            self._latched[topic] = inbox
            self._fetch(topic, inbox)
        return inbox

    def write(self, topic: str, ros_type: str, *, latched: bool = False) -> Writer:
        """See ``RosNetwork``."""
        publisher = self.publisher(topic_key(topic), latched=latched)
        writer = _BridgeWriter(self, publisher, topic)
        if latched:
            cache, handler = cache_key(topic, self.id), callback(writer.on_query)
            self.keep(self.session.declare_queryable(cache, handler))
        qos = QOS_TRANSIENT_LOCAL if latched else QOS_RELIABLE
        self._announce(PUBLISHER, topic, ros_type, qos)
        return writer

    def call(self, service: str, ros_type: str, request: bytes, timeout_s: float) -> PendingCall:
        """See ``RosNetwork``; the bridge knows the type of the service itself."""
        del ros_type
        return self.ask(topic_key(service), request, timeout_s)

    def serve(self, service: str, ros_type: str) -> RequestReader:
        """See ``RosNetwork``; the bridge keeps the client's number itself."""
        inbox = self.answer(topic_key(service), lambda _: None)
        self._announce(SERVER, service, ros_type, "")
        return inbox

    def on_endpoint(self, found: Endpoint) -> None:
        """An old bridge came that may have published a latched topic before."""
        inbox = self._latched.get(found.topic)
        if found.kind == PUBLISHER and inbox is not None:
            self._fetch(found.topic, inbox)

    def _announce(self, kind: str, topic: str, ros_type: str, qos: str) -> None:
        self.announce(endpoint_token(self.id, Endpoint(kind, "", topic, ros_type, ""), qos))

    def _fetch(self, topic: str, inbox: SampleInbox) -> None:
        self.session.get(
            cache_key(topic),
            callback(inbox.on_reply),
            target=zenoh.QueryTarget.ALL,
            consolidation=zenoh.ConsolidationMode.NONE,
            accept_replies=zenoh.ReplyKeyExpr.ANY,
            timeout=HISTORY_S,
        )


class _BridgeWriter:
    """Publishes, and keeps the newest message for old bridges that ask for a latched topic."""

    def __init__(self, network: BridgeNetwork, publisher: Any, topic: str) -> None:
        self._network, self._publisher, self._topic = network, publisher, topic
        self._lock = CLOCK.lock()
        self._newest: bytes | None = None

    @property
    def heard(self) -> bool:
        return self._network.heard(self._topic)

    def put(self, data: bytes) -> None:
        with self._lock:
            self._newest = data
        self._publisher.put(data)

    def on_query(self, query: zenoh.Query) -> None:
        with query, self._lock:
            if self._newest is not None:
                query.reply(topic_key(self._topic), self._newest)
