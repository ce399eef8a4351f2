"""The robot's ROS 2 network over zenoh-bridge-ros2dds, which stands between DDS and Zenoh."""
# Talks: answers the robot's network from its threads.

from __future__ import annotations

import threading
from typing import Any

import zenoh

from onemap_ros2.network import bridge_keys
from onemap_ros2.network.endpoint import PUBLISHER, SUBSCRIBER, Endpoint
from onemap_ros2.network.interface import PendingCall, Reader, Writer
from onemap_ros2.network.zenoh_session import RobotSession, SampleInbox

HISTORY_S = 5.0  # a bridge's own time for the history of a latched topic
ADVICE = "start one on the robot with 'zenoh-bridge-ros2dds', which listens on port 7447"


class BridgeNetwork:
    """The robot's topics as bridges show them. Implements ``RosNetwork``."""

    def __init__(self, connect: tuple[str, ...]) -> None:
        self._robot = RobotSession(connect, ADVICE, bridge_keys.parse_token)
        self._latched: dict[str, SampleInbox] = {}
        self._robot.on_endpoint = self._fetch_from
        self._robot.announce(bridge_keys.bridge_token(self._robot.id))
        self._robot.follow_graph(bridge_keys.graph_key())

    def read(self, topic: str, ros_type: str, depth: int, *, latched: bool = False) -> Reader:
        """See ``RosNetwork``."""
        inbox = self._robot.inbox(depth)
        handler = zenoh.handlers.Callback(inbox.on_sample, indirect=False)
        key = bridge_keys.topic_key(topic)
        self._robot.keep(self._robot.session.declare_subscriber(key, handler))
        qos = bridge_keys.QOS_TRANSIENT_LOCAL if latched else bridge_keys.QOS_RELIABLE
        self._announce(Endpoint(SUBSCRIBER, "", topic, ros_type, ""), qos)
        if latched:
            self._latched[topic] = inbox
            self._fetch(topic, inbox)
        return inbox

    def write(self, topic: str, ros_type: str, *, latched: bool = False) -> Writer:
        """See ``RosNetwork``."""
        publisher = self._robot.session.declare_publisher(
            bridge_keys.topic_key(topic),
            congestion_control=zenoh.CongestionControl.DROP,
            express=not latched,
            reliability=zenoh.Reliability.RELIABLE,
        )
        writer = _BridgeWriter(publisher)
        self._robot.keep(publisher)
        if latched:
            cache = bridge_keys.cache_key(topic, self._robot.id)
            handler = zenoh.handlers.Callback(writer.on_query, indirect=False)
            self._robot.keep(self._robot.session.declare_queryable(cache, handler))
        qos = bridge_keys.QOS_TRANSIENT_LOCAL if latched else bridge_keys.QOS_RELIABLE
        self._announce(Endpoint(PUBLISHER, "", topic, ros_type, ""), qos)
        return writer

    def call(self, service: str, ros_type: str, request: bytes, timeout_s: float) -> PendingCall:
        """See ``RosNetwork``; the bridge knows the type of the service itself."""
        del ros_type
        return self._robot.ask(bridge_keys.topic_key(service), request, timeout_s)

    def endpoints(self) -> tuple[Endpoint, ...]:
        """See ``RosNetwork``."""
        return self._robot.endpoints()

    def wait(self, timeout_s: float) -> None:
        """See ``RosNetwork``."""
        self._robot.wait(timeout_s)

    def close(self) -> None:
        """Leave the network; nothing is received afterwards."""
        self._robot.close()

    def _announce(self, endpoint: Endpoint, qos: str) -> None:
        self._robot.announce(bridge_keys.endpoint_token(self._robot.id, endpoint, qos))

    def _fetch_from(self, endpoint: Endpoint) -> None:
        """A bridge came that may have published a latched topic before."""
        inbox = self._latched.get(endpoint.topic)
        if endpoint.kind == PUBLISHER and inbox is not None:
            self._fetch(endpoint.topic, inbox)

    def _fetch(self, topic: str, inbox: SampleInbox) -> None:
        self._robot.session.get(
            bridge_keys.cache_key(topic),
            zenoh.handlers.Callback(inbox.on_reply, indirect=False),
            target=zenoh.QueryTarget.ALL,
            consolidation=zenoh.ConsolidationMode.NONE,
            accept_replies=zenoh.ReplyKeyExpr.ANY,
            timeout=HISTORY_S,
        )


class _BridgeWriter:
    """Publishes, and keeps the newest message for those who ask for a latched topic."""

    def __init__(self, publisher: Any) -> None:
        self._publisher = publisher
        self._key = str(publisher.key_expr)
        self._lock = threading.Lock()
        self._newest: bytes | None = None

    @property
    def heard(self) -> bool:
        return bool(self._publisher.matching_status.matching)

    def put(self, data: bytes) -> None:
        with self._lock:
            self._newest = data
        self._publisher.put(data)

    def on_query(self, query: zenoh.Query) -> None:
        with query, self._lock:
            if self._newest is not None:
                query.reply(self._key, self._newest)
