"""Malformed packets, and a bare Zenoh session that publishes them."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import msgpack
import numpy as np
import zenoh

from onemap_shared.wire import MAX_BODY_BYTES, MAX_HEADER_BYTES, Packet
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


def truncated_header(packet: Packet) -> Packet:
    return Packet(packet.header[:-1], packet.body)


def truncated_body(packet: Packet) -> Packet | None:
    return Packet(packet.header, packet.body[:-8]) if packet.body else None


def oversized_header(packet: Packet) -> Packet:
    return Packet(packet.header + bytes(MAX_HEADER_BYTES), packet.body)


def oversized_body(packet: Packet) -> Packet:
    return Packet(packet.header, bytes(MAX_BODY_BYTES + 1))


def wrong_version(packet: Packet) -> Packet:
    return with_header(packet, lambda h: h.update(schema=h["schema"].rpartition("/")[0] + "/99"))


def wrong_dtype(packet: Packet) -> Packet | None:
    """Every array declares the dtype of Python objects."""

    def change(header: dict[str, Any]) -> None:
        for array in header["arrays"].values():
            array[0] = "|O"

    return with_header(packet, change) if arrays(packet) else None


def boundless_shape(packet: Packet) -> Packet | None:
    """Every array declares a shape larger than any memory."""

    def change(header: dict[str, Any]) -> None:
        for array in header["arrays"].values():
            array[1] = [2**40, 2**40]

    return with_header(packet, change) if arrays(packet) else None


def not_finite(packet: Packet) -> Packet | None:
    """Every float array is NaN."""
    found = None
    for dtype, shape, offset in arrays(packet).values():
        if "f" in dtype:
            found = overwritten(found or packet, offset, np.full(shape, np.nan, dtype).tobytes())
    return found


def not_rigid(packet: Packet) -> Packet | None:
    """The pose is not a rigid transform."""
    for name, (dtype, _, offset) in arrays(packet).items():
        if name.startswith("T_"):
            return overwritten(packet, offset, np.diag([2, 2, 2, 1]).astype(dtype).tobytes())
    return None


# Faults of a packet; None for messages that cannot have it.
FAULTS: dict[str, Callable[[Packet], Packet | None]] = {
    "truncated header": truncated_header,
    "truncated body": truncated_body,
    "oversized header": oversized_header,
    "wrong version": wrong_version,
    "wrong dtype": wrong_dtype,
    "boundless shape": boundless_shape,
    "not finite": not_finite,
    "not rigid": not_rigid,
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
