"""What a service sees of the bus: a small Protocol, its errors and its counters.

``bus.ZenohBus`` implements it over Zenoh, ``memory_bus.MemoryBus`` inside one
process with the same semantics: a subscription keeps the newest messages only,
nobody there is ``NoReply``, silence is ``QueryTimeout``.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, TypeVar

from onemap_shared.keys import Procedure, Topic

M = TypeVar("M")
Q = TypeVar("Q")
R = TypeVar("R")
M_contra = TypeVar("M_contra", contravariant=True)
M_co = TypeVar("M_co", covariant=True)

CALL_TIMEOUT_S = 2.0  # every answer of the product takes under 0.5 s; 2 s means something is wrong


class CallError(Exception):
    """A question got no answer; the subclasses say why."""


class NoReply(CallError):
    """Nobody serves this procedure now: not started, killed, or the router is gone."""


class QueryTimeout(CallError):
    """Somebody serves it but did not answer in time."""


class RemoteError(CallError):
    """The service refused: ``code`` for programs, the message for people."""

    def __init__(self, code: str, message: str) -> None:
        super().__init__(message)
        self.code = code


class Refusal(Exception):
    """Raised by a handler to refuse a request; arrives at the caller as ``RemoteError``."""

    def __init__(self, code: str, message: str) -> None:
        super().__init__(message)
        self.code = code


@dataclass(frozen=True, slots=True)
class Counters:
    """What became of a subscription's messages so far.

    received: decoded; missed: gaps in the sequence numbers; skipped: replaced by a newer one
    before they were taken; refused: not decodable, the last reason in ``last_problem``.
    """

    received: int = 0
    missed: int = 0
    skipped: int = 0
    refused: int = 0
    last_problem: str = ""


class Publisher(Protocol[M_contra]):
    """Where a service puts the messages of one topic."""

    def put(self, message: M_contra) -> None: ...


class Subscription(Protocol[M_co]):
    """The newest messages of one topic."""

    def take(self, timeout_s: float) -> M_co | None:
        """The oldest kept message not yet taken; None if none came within ``timeout_s``."""

    @property
    def counters(self) -> Counters: ...


class Bus(Protocol):
    """Topics to publish and follow, procedures to serve and call."""

    def publish(self, topic: Topic[M]) -> Publisher[M]: ...

    def subscribe(self, topic: Topic[M], capacity: int = 1) -> Subscription[M]:
        """Follow a topic, keeping the newest ``capacity`` messages."""

    def serve(self, procedure: Procedure[Q, R], handler: Callable[[Q], R]) -> None:
        """Answer a procedure; the handler runs in a thread of its own, one call at a time.

        A handler refuses by raising ``Refusal`` (its code travels) or ``ValueError``
        (code ``invalid``); any other exception is logged and answered as ``internal``.
        """

    def call(self, procedure: Procedure[Q, R], request: Q, timeout_s: float = CALL_TIMEOUT_S) -> R:
        """Ask; raises ``NoReply``, ``QueryTimeout`` or ``RemoteError``."""

    def alive(self) -> frozenset[str]:
        """Names of the services whose process is connected now."""

    def close(self) -> None: ...


@dataclass(frozen=True, slots=True)
class Health:
    """What a service says of itself once a second."""

    ready: bool
    problem: str = ""
    metrics: dict[str, float] | None = None


class Worker(Protocol):
    """A service as the runner sees it."""

    def step(self, timeout_s: float) -> None:
        """Wait at most ``timeout_s`` for work, do one piece of it. Called in a loop."""

    def health(self) -> Health: ...

    def close(self) -> None: ...


class Mailbox:
    """The newest ``capacity`` items, handed from transport threads to one consumer."""

    def __init__(self, capacity: int) -> None:
        self._items: deque[object] = deque(maxlen=capacity)
        self._arrived = threading.Condition()
        self.skipped = 0

    def put(self, item: object) -> None:
        """Add an item, dropping the oldest if full; never blocks for long."""
        with self._arrived:
            if len(self._items) == self._items.maxlen:
                self.skipped += 1
            self._items.append(item)
            self._arrived.notify()

    def take(self, timeout_s: float) -> object | None:
        """The oldest item, or None after ``timeout_s``."""
        with self._arrived:
            if not self._items:
                self._arrived.wait(timeout_s)
            return self._items.popleft() if self._items else None
