"""The robot's ROS 2 network over rmw_zenoh: a node with its publishers and subscribers."""
# Talks: the robot's network, with its clock.

from __future__ import annotations

import os
import struct
from typing import Any

import xxhash

from onemap_ros2.cdr import type_hash
from onemap_ros2.network.interface import (
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
from onemap_shared.bus import CLOCK

ADVICE = "start one on the robot with 'ros2 run rmw_zenoh_cpp rmw_zenohd'"
GRAPH = "@ros2_lv"
ATTACHMENT = struct.Struct("<qqB16s")  # sequence, nanoseconds, length of the gid, gid
GID_BYTES = 16
TOKEN_PARTS = 12  # of the token of an endpoint
KINDS = (PUBLISHER, SUBSCRIBER, SERVER)
# reliability:durability:history,depth:deadline:lifespan:liveliness; empty where default
QOS_RELIABLE = "::,10:,:,:,,"
QOS_SENSOR = "2::,5:,:,:,,"
QOS_TRANSIENT_LOCAL = ":1:,1:,:,:,,"
# Lyrical and Rolling: of a subscriber that takes images from memory, and where they travel.
BACKENDS, BUFFERS = "backends:cpu:", "_buf_cpu"


def dds_name(ros_type: str) -> str:
    """``pkg/msg/Type`` as ``pkg::msg::dds_::Type_``."""
    package, kind, name = ros_type.split("/")
    return f"{package}::{kind}::dds_::{name}_"


def ros_name(dds_type: str) -> str:
    """``pkg::msg::dds_::Type_`` as ``pkg/msg/Type``."""
    return dds_type.replace("::dds_::", "::").replace("::", "/").removesuffix("_")


def topic_key(domain: int, topic: str, ros_type: str, type_hash: str = "*") -> str:
    """The key on which a topic's messages travel; ``*``: whatever the hash is."""
    return f"{domain}/{topic.strip('/')}/{dds_name(ros_type)}/{type_hash}"


def graph_key(domain: int) -> str:
    """The key expression of all tokens of a domain."""
    return f"{GRAPH}/{domain}/**"


def node_token(domain: int, session: str, node: str, namespace: str = "") -> str:
    """The token of a node; ``session``: the id of its Zenoh session."""
    return f"{GRAPH}/{domain}/{session}/0/0/NN/%/{namespace.replace('/', '%') or '%'}/{node}"


def endpoint_token(node: str, number: int, endpoint: Endpoint, qos: str) -> str:
    """The token of an endpoint of the node whose token is ``node``; ``number``: from 1."""
    head = node.split("/")
    head[4:6] = [str(number), endpoint.kind]
    topic = endpoint.topic.replace("/", "%")
    return "/".join((*head, topic, dds_name(endpoint.ros_type), endpoint.type_hash, qos))


def parse_token(token: str) -> Endpoint | None:
    """The publisher, subscriber or server of a token; None for any other token."""
    parts = token.split("/")
    if len(parts) < TOKEN_PARTS or parts[0] != GRAPH or parts[5] not in KINDS:
        return None
    space, name, topic, dds_type, type_hash = parts[7:12]
    node = f"{space.replace('%', '/').rstrip('/')}/{name}"
    backends = any(part.startswith("backends:") for part in parts[12:])
    return Endpoint(
        parts[5], node, topic.replace("%", "/"), ros_name(dds_type), type_hash, backends
    )


def gid_of(token: str) -> bytes:
    """The 16 bytes that identify a publisher: XXH3-128 of its token, the low half first."""
    digest = xxhash.xxh3_128_intdigest(token.encode())
    return digest.to_bytes(GID_BYTES, "little")


def attachment(sequence: int, stamp_ns: int, gid: bytes) -> bytes:
    """What every sample carries; one without it is dropped by ROS 2."""
    return ATTACHMENT.pack(sequence, stamp_ns, GID_BYTES, gid)


def reply_note(request: bytes | None) -> bytes:
    """The attachment of a reply: the request's sequence and client. ValueError without those."""
    if request is None or len(request) != ATTACHMENT.size:
        raise ValueError("the request has no sequence number and client of rmw_zenoh")
    sequence, _, _, gid = ATTACHMENT.unpack(request)
    return attachment(sequence, CLOCK.wall_ns(), gid)


class RmwNetwork(RobotSession):
    """One ROS 2 node. Implements ``RosNetwork``."""

    def __init__(
        self, connect: tuple[str, ...], domain: int, node: str, namespace: str = ""
    ) -> None:
        super().__init__(connect, ADVICE, parse_token)
        self._domain = domain
        self._numbers = 0
        self._calls = 0
        self._client_id = os.urandom(GID_BYTES)
        self._node = node_token(domain, self.id, node, namespace)
        self._buffered: dict[str, Endpoint] = {}  # topics whose images may come as buffers
        self.announce(self._node)
        self.follow_graph(graph_key(domain))

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
        inbox, key = self.inbox(depth), topic_key(self._domain, topic, ros_type)
        self.subscribe(key, inbox, latched=latched)
        if not latched:
            self.subscribe(f"{key}/{BUFFERS}", inbox, latched=False)
        endpoint = Endpoint(SUBSCRIBER, "", topic, ros_type, self._hash(ros_type))
        volatile = QOS_RELIABLE if reliable else QOS_SENSOR
        self._announce(endpoint, QOS_TRANSIENT_LOCAL if latched else volatile)
        self._buffered[topic] = endpoint
        for known in self.endpoints():
            self.on_endpoint(known)
        return inbox

    def write(self, topic: str, ros_type: str, *, latched: bool = False) -> Writer:
        """See ``RosNetwork``."""
        endpoint = Endpoint(PUBLISHER, "", topic, ros_type, self._hash(ros_type))
        key = topic_key(self._domain, topic, ros_type, endpoint.type_hash)
        publisher = self.publisher(key, latched=latched)
        gid = self._announce(endpoint, QOS_TRANSIENT_LOCAL if latched else QOS_RELIABLE)
        return _RmwWriter(self, publisher, topic, gid)

    def call(self, service: str, ros_type: str, request: bytes, timeout_s: float) -> PendingCall:
        """See ``RosNetwork``."""
        self._calls += 1
        server = next(
            (e for e in self.endpoints() if e.kind == SERVER and e.topic == service), None
        )
        known = server.type_hash if server is not None and server.ros_type == ros_type else "*"
        key = topic_key(self._domain, service, ros_type, known)
        note = attachment(self._calls, CLOCK.wall_ns(), self._client_id)
        return self.ask(key, request, timeout_s, attachment=note)

    def serve(self, service: str, ros_type: str) -> RequestReader:
        """See ``RosNetwork``."""
        endpoint = Endpoint(SERVER, "", service, ros_type, self._hash(ros_type))
        key = topic_key(self._domain, service, ros_type, endpoint.type_hash)
        inbox = self.answer(key, reply_note)
        self._announce(endpoint, QOS_RELIABLE)
        return inbox

    def on_endpoint(self, found: Endpoint) -> None:
        """Lyrical and Rolling publish images only for a token that names a buffer backend."""
        if found.kind == PUBLISHER and found.backends and found.topic in self._buffered:
            endpoint = self._buffered.pop(found.topic)
            self._announce(endpoint, f"{QOS_SENSOR}/{BACKENDS}")

    def _hash(self, ros_type: str) -> str:
        """The hash that the robot's own nodes have for a type, else the one of our definition."""
        known = (each.type_hash for each in self.endpoints() if each.ros_type == ros_type)
        return next(known, None) or type_hash(ros_type)

    def _announce(self, endpoint: Endpoint, qos: str) -> bytes:
        """Show the endpoint in the graph; returns the id of a publisher."""
        self._numbers += 1
        token = endpoint_token(self._node, self._numbers, endpoint, qos)
        self.announce(token)
        return gid_of(token)


class _RmwWriter:
    def __init__(self, network: RmwNetwork, publisher: Any, topic: str, gid: bytes) -> None:
        self._network, self._publisher = network, publisher
        self._topic, self._gid = topic, gid
        self._sequence = 0

    @property
    def has_subscribers(self) -> bool:
        return self._network.has_subscribers(self._topic)

    def put(self, data: bytes) -> None:
        self._sequence += 1
        note = attachment(self._sequence, CLOCK.wall_ns(), self._gid)
        self._publisher.put(data, attachment=note)
