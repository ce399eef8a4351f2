"""The robot's ROS 2 network over rmw_zenoh: a node with its publishers and subscribers.

A client of the robot's own router, so no DDS and no ROS 2 is needed. It is a session of its own:
OneMap's bus never carries these keys.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from typing import Any, Protocol

import zenoh
import zenoh.ext

from onemap_ros2 import rmw_keys
from onemap_ros2.cdr import type_hash
from onemap_ros2.rmw_keys import Endpoint
from onemap_shared.bus import zenoh_config

STATIC_HISTORY = 100  # latched messages of each publisher, as tf2's own listener asks for


class Reader(Protocol):
    """The newest messages of a topic, encoded, oldest first."""

    def take(self) -> list[bytes]:
        """What came since the last call."""


class Writer(Protocol):
    """Sends encoded messages."""

    def put(self, data: bytes) -> None:
        """Send one message, with what ROS 2 expects beside it."""


class RosNetwork(Protocol):
    """What the adapter needs of the robot's network."""

    def read(self, topic: str, ros_type: str, depth: int, *, latched: bool = False) -> Reader:
        """Follow a topic, keeping the newest ``depth`` messages."""

    def write(self, topic: str, ros_type: str) -> Writer:
        """Announce a publisher of a topic."""

    def endpoints(self) -> tuple[Endpoint, ...]:
        """All publishers and subscribers of the robot that are known now."""

    def wait(self, timeout_s: float) -> None:
        """Until a message arrives on any topic, at most ``timeout_s``."""

    def close(self) -> None:
        """Leave the network."""


class NetworkError(Exception):
    """The robot's network cannot be joined; one sentence."""


class ZenohRosNetwork:
    """One ROS 2 node. Implements ``RosNetwork``."""

    def __init__(self, connect: tuple[str, ...], domain: int, node: str) -> None:
        try:
            self._session = zenoh.open(_settings(connect))
        except zenoh.ZError as problem:
            raise NetworkError(
                f"no ROS 2 router answers at {', '.join(connect)}: start one on the robot with "
                "'ros2 run rmw_zenoh_cpp rmw_zenohd', or correct ros2.connect"
            ) from problem
        self._domain = domain
        self._arrived = threading.Event()
        self._numbers = 0
        self._declared: list[Any] = []
        self._graph: dict[str, Endpoint] = {}
        self._own: set[str] = set()
        self._node = rmw_keys.node_token(domain, str(self._session.info.zid()), node)
        self._declared.append(self._session.liveliness().declare_token(self._node))
        self._declared.append(
            self._session.liveliness().declare_subscriber(
                rmw_keys.graph_key(domain),
                zenoh.handlers.Callback(self._on_token, indirect=False),
                history=True,
            )
        )

    def read(self, topic: str, ros_type: str, depth: int, *, latched: bool = False) -> Reader:
        """See ``RosNetwork``."""
        reader = _Inbox(depth, self._arrived)
        key = rmw_keys.topic_key(self._domain, topic, ros_type)
        handler = zenoh.handlers.Callback(reader.on_sample, indirect=False)
        if latched:
            subscriber: Any = zenoh.ext.declare_advanced_subscriber(
                self._session,
                key,
                handler,
                history=zenoh.ext.HistoryConfig(
                    detect_late_publishers=True, max_samples=STATIC_HISTORY
                ),
                recovery=zenoh.ext.RecoveryConfig(periodic_queries=None, heartbeat=True),
                subscriber_detection=True,
            )
        else:
            subscriber = self._session.declare_subscriber(key, handler)
        self._declared.append(subscriber)
        qos = rmw_keys.QOS_TRANSIENT_LOCAL if latched else rmw_keys.QOS_SENSOR
        self._announce(
            Endpoint(rmw_keys.SUBSCRIBER, "", topic, ros_type, self._hash(ros_type)), qos
        )
        return reader

    def write(self, topic: str, ros_type: str) -> Writer:
        """See ``RosNetwork``."""
        endpoint = Endpoint(rmw_keys.PUBLISHER, "", topic, ros_type, self._hash(ros_type))
        key = rmw_keys.topic_key(self._domain, topic, ros_type, endpoint.type_hash)
        publisher = self._session.declare_publisher(
            key,
            congestion_control=zenoh.CongestionControl.DROP,
            express=True,
            reliability=zenoh.Reliability.RELIABLE,
        )
        self._declared.append(publisher)
        return _ZenohWriter(publisher, self._announce(endpoint, rmw_keys.QOS_RELIABLE))

    def endpoints(self) -> tuple[Endpoint, ...]:
        """See ``RosNetwork``."""
        return tuple(e for token, e in self._graph.copy().items() if token not in self._own)

    def wait(self, timeout_s: float) -> None:
        """See ``RosNetwork``."""
        self._arrived.wait(timeout_s)
        self._arrived.clear()

    def close(self) -> None:
        """Leave the network; nothing is received afterwards."""
        self._session.close()  # type: ignore[no-untyped-call]

    def _hash(self, ros_type: str) -> str:
        """The hash that the robot's own nodes have for a type, else the one of our definition."""
        known = (each.type_hash for each in self.endpoints() if each.ros_type == ros_type)
        return next(known, None) or type_hash(ros_type)

    def _announce(self, endpoint: Endpoint, qos: str) -> bytes:
        """Show the endpoint in the graph; returns the id of a publisher."""
        self._numbers += 1
        token = rmw_keys.endpoint_token(self._node, self._numbers, endpoint, qos)
        self._own.add(token)
        self._declared.append(self._session.liveliness().declare_token(token))
        return rmw_keys.gid_of(token)

    def _on_token(self, sample: zenoh.Sample) -> None:
        token = str(sample.key_expr)
        if sample.kind == zenoh.SampleKind.DELETE:
            self._graph.pop(token, None)
            return
        endpoint = rmw_keys.parse_token(token)
        if endpoint is not None:
            self._graph[token] = endpoint


class _Inbox:
    """Keeps the newest samples; its callback only stores a reference."""

    def __init__(self, depth: int, arrived: threading.Event) -> None:
        self._samples: deque[zenoh.Sample] = deque(maxlen=depth)
        self._arrived = arrived

    def on_sample(self, sample: zenoh.Sample) -> None:
        self._samples.append(sample)
        self._arrived.set()

    def take(self) -> list[bytes]:
        taken = []
        while self._samples:
            taken.append(self._samples.popleft().payload.to_bytes())
        return taken


class _ZenohWriter:
    def __init__(self, publisher: zenoh.Publisher, gid: bytes) -> None:
        self._publisher = publisher
        self._gid = gid
        self._sequence = 0

    def put(self, data: bytes) -> None:
        self._sequence += 1
        note = rmw_keys.attachment(self._sequence, time.time_ns(), self._gid)
        self._publisher.put(data, attachment=note)


def _settings(connect: tuple[str, ...]) -> zenoh.Config:
    """As on OneMap's bus, with time stamps: the history of latched topics needs them."""
    config = zenoh_config("client", connect=connect)
    config.insert_json5("timestamping/enabled", "true")
    return config
