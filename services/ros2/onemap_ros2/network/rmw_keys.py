"""Names of rmw_zenoh: topic keys, tokens of the graph, attachments.

As its design document and version 0.2.10 (Jazzy) have them; the newer releases up to Rolling
keep them. Keys of the robot's network, not of OneMap's bus.
"""

from __future__ import annotations

import struct

import xxhash

from onemap_ros2.network.endpoint import PUBLISHER, SERVER, SUBSCRIBER, Endpoint

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
