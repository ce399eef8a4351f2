"""A robot's network in memory."""

from __future__ import annotations

import queue
from collections import defaultdict

from onemap_ros2.network.interface import Endpoint


class FakeReader:
    def __init__(self) -> None:
        self.waiting: list[bytes] = []

    def take(self) -> list[bytes]:
        taken, self.waiting = self.waiting, []
        return taken


class FakeWriter:
    def __init__(self) -> None:
        self.sent: list[bytes] = []
        self.has_subscribers = True

    def put(self, data: bytes) -> None:
        self.sent.append(data)


class FakeCall:
    """A question; a test answers it with ``answer``, or with None: nobody does."""

    def __init__(self, service: str, request: bytes) -> None:
        self.service, self.request = service, request
        self.done = False
        self.reply: bytes | None = None

    def answer(self, reply: bytes | None) -> None:
        self.done, self.reply = True, reply


class FakeRequest:
    """A question to a service of the adapter; ``answer``: what it said."""

    def __init__(self, data: bytes) -> None:
        self.data = data
        self.answers: queue.SimpleQueue[bytes] = queue.SimpleQueue()

    def reply(self, data: bytes) -> None:
        self.answers.put(data)


class FakeService:
    def __init__(self) -> None:
        self.waiting: list[FakeRequest] = []

    def take(self) -> list[FakeRequest]:
        taken, self.waiting = self.waiting, []
        return taken


class FakeNetwork:
    """Implements ``RosNetwork``: what is said to it waits in the readers."""

    def __init__(self, *endpoints: Endpoint) -> None:
        self.readers: dict[str, FakeReader] = defaultdict(FakeReader)
        self.types: dict[str, str] = {}
        self.latched: set[str] = set()
        self.writers: dict[tuple[str, str], FakeWriter] = {}
        self.calls: list[FakeCall] = []
        self.services: dict[str, FakeService] = defaultdict(FakeService)
        self.known = endpoints
        self.closed = False

    def read(
        self,
        topic: str,
        ros_type: str,
        depth: int,
        *,
        latched: bool = False,
        reliable: bool = False,
    ) -> FakeReader:
        assert depth > 0
        self.types[topic] = ros_type
        self.latched |= {topic} if latched else set()
        return self.readers[topic]

    def call(self, service: str, ros_type: str, request: bytes, timeout_s: float) -> FakeCall:
        assert ros_type
        assert timeout_s > 0
        self.calls.append(FakeCall(service, request))
        return self.calls[-1]

    def serve(self, service: str, ros_type: str) -> FakeService:
        self.types[service] = ros_type
        return self.services[service]

    def write(self, topic: str, ros_type: str, *, latched: bool = False) -> FakeWriter:
        self.latched |= {topic} if latched else set()
        return self.writers.setdefault((topic, ros_type), FakeWriter())

    def endpoints(self) -> tuple[Endpoint, ...]:
        return self.known

    def wait(self, timeout_s: float) -> None:
        assert timeout_s <= 0.1

    def close(self) -> None:
        self.closed = True

    def say(self, topic: str, data: bytes) -> None:
        self.readers[topic].waiting.append(data)
