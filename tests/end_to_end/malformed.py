"""Malformed packets, and a bare Zenoh session that publishes them."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import msgpack
import numpy as np
import zenoh

from onemap_shared.wire import MAX_BODY_BYTES, Packet
from tests.shared.samples import SAMPLES


def sample(message: type) -> Any:
    """A valid message of this type."""
    return next(each for each in SAMPLES if isinstance(each, message))


def with_header(packet: Packet, change: Callable[[dict[str, Any]], object]) -> Packet:
    """The packet with its header changed."""
    header = msgpack.unpackb(packet.header)
    change(header)
    return Packet(msgpack.packb(header), packet.body)


def arrays(packet: Packet) -> dict[str, list[Any]]:
    """Name to [dtype, shape, offset]."""
    described: dict[str, list[Any]] = msgpack.unpackb(packet.header)["arrays"]
    return described


def overwritten(packet: Packet, offset: int, content: bytes) -> Packet:
    body = packet.body[:offset] + content + packet.body[offset + len(content) :]
    return Packet(packet.header, body)


def truncated_body(packet: Packet) -> Packet | None:
    return Packet(packet.header, packet.body[:-8]) if packet.body else None


def oversized_body(packet: Packet) -> Packet:
    return Packet(packet.header, bytes(MAX_BODY_BYTES + 1))


def wrong_version(packet: Packet) -> Packet:
    return with_header(packet, lambda h: h.update(schema=h["schema"].rpartition("/")[0] + "/99"))


def not_finite(packet: Packet) -> Packet | None:
    """Every float array is NaN."""
    found = None
    for dtype, shape, offset in arrays(packet).values():
        if "f" in dtype:
            found = overwritten(found or packet, offset, np.full(shape, np.nan, dtype).tobytes())
    return found


# Faults of a packet; None for messages that cannot have it.
FAULTS: dict[str, Callable[[Packet], Packet | None]] = {
    "truncated body": truncated_body,
    "wrong version": wrong_version,
    "not finite": not_finite,
}


@contextmanager
def raw_session(endpoint: str) -> Iterator[zenoh.Session]:
    """A bare Zenoh session at the router."""
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", json.dumps([endpoint]))
    config.insert_json5("scouting/multicast/enabled", "false")
    with zenoh.open(config) as session:
        yield session


def publish(session: zenoh.Session, key: str, packet: Packet) -> None:
    """Publish a packet; a large one waits for the queue, which the services would drop."""
    session.put(
        key,
        packet.body,
        attachment=packet.header,
        congestion_control=zenoh.CongestionControl.BLOCK,
    )
