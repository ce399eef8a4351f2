"""The bus as services use it: a Protocol, its errors and its counters.

``bus.ZenohBus`` implements it over Zenoh. A subscription keeps the newest messages only; a call
without a server raises ``NoReply``, without an answer ``QueryTimeout``.
"""
# Talks: inboxes between the bus's threads and a service.

from __future__ import annotations

import json
import logging
import math
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Generic, Protocol, TypeVar

from onemap_shared.clock import Clock, Event
from onemap_shared.keys import Delivery, Procedure, Topic
from onemap_shared.wire import Packet, WireError, decode, encode

LOG = logging.getLogger("onemap.bus")

M = TypeVar("M")
Q = TypeVar("Q")
R = TypeVar("R")
M_contra = TypeVar("M_contra", contravariant=True)
M_co = TypeVar("M_co", covariant=True)

CALL_TIMEOUT_S = 2.0  # every answer of the product takes under 0.5 s; 2 s means something is wrong


class CallError(Exception):
    """A call failed; the subclasses say why."""


class NoReply(CallError):
    """No process serves this procedure: not started, killed, or the router is gone."""


class QueryTimeout(CallError):
    """A server exists but did not answer in time."""


class _Refusal(Exception):
    """``code`` and ``details``, which is JSON, for programs; the message for people."""

    def __init__(self, code: str, message: str, details: Mapping[str, Any] | None = None) -> None:
        super().__init__(message)
        self.code = code
        self.details = dict(details or {})


class RemoteError(_Refusal, CallError):
    """The service refused."""


def remote_error(body: bytes) -> RemoteError:
    """The error of an error reply: JSON with code, message and details."""
    try:
        error = json.loads(body)
        code, message, details = str(error["code"]), str(error["message"]), error.get("details")
        return RemoteError(code, message, details if isinstance(details, dict) else None)
    except (ValueError, KeyError, TypeError):
        return RemoteError("internal", body[:200].decode(errors="replace"))


class InvalidReply(RemoteError):
    """The answer cannot be read: a service of another release, or a damaged one."""


class RequestRejected(_Refusal):
    """Raised by a handler to refuse a request; arrives at the caller as ``RemoteError``."""


@dataclass(frozen=True, slots=True)
class Counters:
    """Counts a subscription's messages by what happened to them.

    received: decoded; missed: gaps in the sequence numbers, the skipped ones included;
    skipped: replaced by a newer one before they were taken; refused: not decodable, the
    last reason in ``last_problem``; disordered: of the received, those with a sequence number that
    is not higher than the one before: more than one publisher, or one that began anew.
    """

    received: int = 0
    missed: int = 0
    skipped: int = 0
    refused: int = 0
    last_problem: str = ""
    disordered: int = 0


class Publisher(Protocol[M_contra]):
    """Publishes the messages of one topic."""

    def put(self, message: M_contra) -> None: ...


class Subscription(Protocol[M_co]):
    """The newest messages of one topic."""

    def take(self, timeout_s: float) -> M_co | None:
        """The oldest kept message not yet taken; None if none came within ``timeout_s``."""

    @property
    def counters(self) -> Counters: ...


class Server(Protocol):
    """What answers procedures."""

    @property
    def clock(self) -> Clock:
        """Time and threads of its process."""

    def serve(self, procedure: Procedure[Q, R], handler: Callable[[Q], R]) -> None: ...


class Bus(Protocol):
    """Topics to publish and follow, procedures to serve and call."""

    @property
    def clock(self) -> Clock:
        """Time and threads of its process."""

    @property
    def instance(self) -> str:
        """Which process of its service this is, as in its liveliness token."""

    @property
    def namespace(self) -> str:
        """What its keys begin with; empty: nothing."""

    def publish(self, topic: Topic[M]) -> Publisher[M]: ...

    def subscribe(
        self, topic: Topic[M], capacity: int = 1, arrived: Event | None = None
    ) -> Subscription[M]:
        """Follow a topic, keeping the newest ``capacity`` messages.

        arrived: set with every message, so that a thread may wait for several topics at once.
        """

    def serve(self, procedure: Procedure[Q, R], handler: Callable[[Q], R]) -> None:
        """Answer a procedure; the handler runs in threads of its own, ``parallel`` calls at once.

        A request that waited for its turn longer than its caller waits for the reply is refused.
        A handler refuses by raising ``RequestRejected`` (its code travels) or ``ValueError``
        (code ``invalid``); any other exception is logged and answered as ``internal``.
        """

    def call(self, procedure: Procedure[Q, R], request: Q, timeout_s: float = CALL_TIMEOUT_S) -> R:
        """Ask; raises ``NoReply``, ``QueryTimeout`` or ``RemoteError``, also ``InvalidReply``."""

    def alive(self) -> frozenset[str]:
        """Names of the services whose process is connected now."""

    def members(self) -> frozenset[tuple[str, str]]:
        """Service and instance of every process that is connected now."""

    def connected(self) -> bool:
        """Whether this process is connected to a router now."""

    def sibling(self, namespace: str) -> Bus:
        """The same router under the keys of another namespace, unseen there; close it as well."""

    def claim(self) -> tuple[str, ...]:
        """Show this process under these keys, unless others have its role; empty, or these.

        Raises ConnectionError without a router.
        """

    def metrics(self) -> dict[str, float]:
        """Of what it sends, by names that begin with ``link_``; for the heartbeat."""

    def close(self) -> None: ...


@dataclass(frozen=True, slots=True)
class Health:
    """Health of a service, published once a second."""

    ready: bool
    problem: str = ""
    metrics: dict[str, float] | None = None


class Worker(Protocol):
    """A service as the runner sees it."""

    def step(self, timeout_s: float) -> None:
        """Wait at most ``timeout_s`` for work, do one piece of it. Called in a loop."""

    def health(self) -> Health: ...

    def close(self) -> None: ...


class Inbox(Generic[M]):
    """The newest ``capacity`` packets of one topic, handed from transport threads to one consumer.

    Packets are decoded when they are taken, in the consumer's thread, so that a skipped
    frame costs nothing; a bad one is counted and passed over.
    """

    def __init__(
        self, message: type[M], capacity: int, clock: Clock, arrived: Event | None = None
    ) -> None:
        self._message, self._clock = message, clock
        self._announced = arrived
        self._packets: deque[Packet | Callable[[], Packet]] = deque()
        self._capacity = capacity
        self._arrived = clock.condition()
        self._counters = Counters()
        self._last_sequence: int | None = None

    def put(self, packet: Packet | Callable[[], Packet]) -> None:
        """Add a packet, or a function that copies it out of the transport, dropping the oldest."""
        with self._arrived:
            if len(self._packets) == self._capacity:
                self._packets.popleft()
                self._count(skipped=1)
            self._packets.append(packet)
            self._arrived.notify()
        if self._announced is not None:
            self._announced.set()

    def take(self, timeout_s: float) -> M | None:
        deadline = self._clock.monotonic_s() + timeout_s
        while True:
            with self._arrived:
                if not self._packets:
                    self._arrived.wait(max(deadline - self._clock.monotonic_s(), 0.0))
                if not self._packets:
                    return None
                packet = self._packets.popleft()
            message = self._decode(packet() if callable(packet) else packet)
            if message is not None:
                return message

    def _decode(self, packet: Packet) -> M | None:
        try:
            message = decode(self._message, packet)
        except WireError as problem:
            with self._arrived:
                self._count(refused=1, last_problem=str(problem))
            return None
        sequence = getattr(message, "sequence", None)
        missed = disordered = 0
        if sequence is not None:
            if self._last_sequence is not None:
                missed = max(sequence - self._last_sequence - 1, 0)
                disordered = int(sequence <= self._last_sequence)
            self._last_sequence = sequence
        with self._arrived:
            self._count(received=1, missed=missed, disordered=disordered)
        return message

    def _count(self, *, last_problem: str = "", **more: int) -> None:
        now = self._counters
        self._counters = replace(
            now,
            last_problem=last_problem or now.last_problem,
            **{name: getattr(now, name) + count for name, count in more.items()},
        )

    @property
    def counters(self) -> Counters:
        """Counts of the packets so far."""
        return self._counters


def _refuse_stale(procedure: Procedure[Q, R], waited_s: float, patience_s: float) -> None:
    """Raise ``RemoteError`` for a request that waited too long for its turn."""
    if procedure.delivery is Delivery.COMMAND:
        return
    limit_s = min(patience_s, math.inf if (late := procedure.stale_after_s) is None else late)
    if waited_s > limit_s:
        raise RemoteError(
            "busy",
            f"{procedure.key} was busy: the request waited {waited_s:.1f} s, more than "
            f"{limit_s:g} s, and was not carried out; try again",
        )


def read_reply(procedure: Procedure[Q, R], packet: Packet) -> R:
    """The reply of a procedure; raises ``InvalidReply``."""
    try:
        return decode(procedure.reply, packet)
    except WireError as problem:
        why = f"its answer on {procedure.key} cannot be read: {problem}; is it of another release?"
        raise InvalidReply("invalid_reply", why) from problem


def answer(
    procedure: Procedure[Q, R],
    handler: Callable[[Q], R],
    packet: Packet,
    *,
    waited_s: float,
    patience_s: float,
) -> Packet:
    """Run a handler on an encoded request; raises ``RemoteError`` with what to tell the caller.

    waited_s: for its turn; patience_s: for which its caller waits, infinite if it does not say.
    """
    _refuse_stale(procedure, waited_s, patience_s)
    try:
        return encode(handler(procedure.aged(decode(procedure.request, packet), waited_s)))
    except RequestRejected as problem:
        raise RemoteError(problem.code, str(problem), problem.details) from problem
    except ValueError as problem:
        raise RemoteError("invalid", str(problem)) from problem
    except Exception as problem:
        LOG.exception("%s failed", procedure.key)
        raise RemoteError("internal", f"{type(problem).__name__}: {problem}") from problem
