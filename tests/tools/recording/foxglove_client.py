"""A viewer in Python: the Foxglove WebSocket protocol, spoken with ``websockets``."""

from __future__ import annotations

import base64
import json
import struct
import time
from collections.abc import Iterator
from contextlib import ExitStack
from typing import Any

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from websockets.sync.client import connect
from websockets.typing import Subprotocol

PROTOCOL = Subprotocol("foxglove.sdk.v1")
MESSAGE_DATA = 1  # opcode of the server's binary messages
HEADER = struct.Struct("<BIQ")  # opcode, subscription, log time in ns
PATIENCE_S = 60.0


class FoxgloveClient:
    """Connects, reads what is offered, subscribes and decodes by the schemas that were sent."""

    def __init__(self, port: int, host: str = "127.0.0.1") -> None:
        closing = ExitStack()
        server = connect(
            f"ws://{host}:{port}", subprotocols=[PROTOCOL], max_size=None, open_timeout=PATIENCE_S
        )
        self._socket = closing.enter_context(server)
        self.close = closing.close
        self.info = self.next_json("serverInfo")
        self.channels: dict[str, dict[str, Any]] = {}
        self._topics: dict[int, str] = {}

    def _received(self) -> Iterator[str | bytes]:
        """All that comes within ``PATIENCE_S``; then TimeoutError."""
        ends_s = time.monotonic() + PATIENCE_S
        while True:
            yield self._socket.recv(timeout=max(ends_s - time.monotonic(), 0.0))

    def next_json(self, op: str) -> dict[str, Any]:
        """The next text message of this kind."""
        documents = (json.loads(data) for data in self._received() if isinstance(data, str))
        found: dict[str, Any] = next(each for each in documents if each["op"] == op)
        return found

    def discover(self, count: int) -> set[str]:
        """The topics on offer, once there are so many."""
        while len(self.channels) < count:
            for channel in self.next_json("advertise")["channels"]:
                self.channels[channel["topic"]] = channel
        return set(self.channels)

    def subscribe(self, *topics: str) -> None:
        """Ask for these topics."""
        subscriptions = []
        for topic in topics:
            number = len(self._topics) + 1
            self._topics[number] = topic
            subscriptions.append({"id": number, "channelId": self.channels[topic]["id"]})
        self.send({"op": "subscribe", "subscriptions": subscriptions})

    def send(self, document: dict[str, Any]) -> None:
        """Send a text message."""
        self._socket.send(json.dumps(document))

    def receive(self) -> tuple[str, Any]:
        """The next message with its topic, decoded."""
        data = next(d for d in self._received() if isinstance(d, bytes) and d[0] == MESSAGE_DATA)
        _, number, _ = HEADER.unpack_from(data)
        topic = self._topics[number]
        return topic, self._decode(topic, data[HEADER.size :])

    def _decode(self, topic: str, payload: bytes) -> Any:
        channel = self.channels[topic]
        if channel["encoding"] == "json":
            return json.loads(payload)
        return read_protobuf(channel["schemaName"], base64.b64decode(channel["schema"]), payload)


def read_protobuf(name: str, schema: bytes, payload: bytes) -> Any:
    """A message of the type ``name`` in ``schema``, a FileDescriptorSet."""
    pool = descriptor_pool.DescriptorPool()
    for file in descriptor_pb2.FileDescriptorSet.FromString(schema).file:
        pool.Add(file)
    return message_factory.GetMessageClass(pool.FindMessageTypeByName(name)).FromString(payload)


def read(message: Any) -> Any:
    """A message of the SDK as a viewer reads it."""
    schema = message.get_schema()
    return read_protobuf(schema.name, schema.data, message.encode())
