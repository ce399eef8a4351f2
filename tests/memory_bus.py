"""The bus inside one process, with the semantics of the real one.

Messages are encoded and decoded, so what would be refused on the wire is
refused here; a subscription keeps the newest only; a call without a server raises
``NoReply``; each procedure has threads of its own, and refuses what waited too long for them.
"""
# Talks: the bus inside one process.

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable
from concurrent.futures import TimeoutError as FutureTimeout
from fnmatch import fnmatchcase
from typing import Any, Generic, TypeVar

from onemap_shared.clock import Clock, Event, Future, SystemClock
from onemap_shared.keys import Procedure, Topic
from onemap_shared.services import role_of
from onemap_shared.transport import (
    CALL_TIMEOUT_S,
    Inbox,
    NoReply,
    Publisher,
    QueryTimeout,
    RemoteError,
    Subscription,
    answer,
    read_reply,
)
from onemap_shared.wire import Packet, encode

M = TypeVar("M")
Q = TypeVar("Q")
R = TypeVar("R")


class MemoryRouter:
    """Connects the buses of one process, as a Zenoh router connects sessions."""

    def __init__(self, clock: Clock | None = None) -> None:
        self.clock = clock or SystemClock()
        self.lock = self.clock.lock()
        self.inboxes: dict[str, list[Inbox[Any]]] = defaultdict(list)
        self.latched: dict[str, Packet] = {}
        self.servers: dict[str, list[tuple[MemoryBus, _Server]]] = defaultdict(list)
        self.services: dict[MemoryBus, str] = {}
        self.namespace = ""
        self.namespaces: dict[str, MemoryRouter] = {}  # of siblings

    def bus(self, service: str = "") -> MemoryBus:
        """A new bus; ``service`` counts as alive until it is closed."""
        bus = MemoryBus(self, service)
        if service:
            self.services[bus] = service
        return bus

    def space(self, namespace: str) -> MemoryRouter:
        """The keys of another namespace, which are no keys of this one."""
        found = self.namespaces.setdefault(namespace, MemoryRouter(self.clock))
        found.namespace = namespace
        return found

    def inject(self, key: str, packet: Packet) -> None:
        """Deliver raw bytes, as a broken or foreign publisher would."""
        with self.lock:
            listeners = [
                box for k, boxes in self.inboxes.items() if fnmatchcase(key, k) for box in boxes
            ]
        for inbox in listeners:
            inbox.put(packet)


class MemoryBus:
    """One participant. Implements ``transport.Bus``."""

    def __init__(self, router: MemoryRouter, service: str = "") -> None:
        self._router, self._service = router, service
        self.clock = router.clock
        self.instance = self.clock.random.randbytes(6).hex()

    @property
    def namespace(self) -> str:
        return self._router.namespace

    def publish(self, topic: Topic[M]) -> Publisher[M]:
        return _MemoryPublisher(self._router, topic)

    def subscribe(
        self, topic: Topic[M], capacity: int = 1, arrived: Event | None = None
    ) -> Subscription[M]:
        inbox = Inbox(topic.message, capacity, self.clock, arrived)
        with self._router.lock:
            self._router.inboxes[topic.key].append(inbox)
            if topic.latched and topic.key in self._router.latched:
                inbox.put(self._router.latched[topic.key])
        return inbox

    def serve(self, procedure: Procedure[Q, R], handler: Callable[[Q], R]) -> None:
        self._router.servers[procedure.key].append((self, _Server(procedure, handler, self.clock)))

    def call(self, procedure: Procedure[Q, R], request: Q, timeout_s: float = CALL_TIMEOUT_S) -> R:
        entries = self._router.servers.get(procedure.key, [])
        asked = entries if procedure.to_all else entries[-1:]
        futures = [server.ask(encode(request), timeout_s) for _, server in asked]
        refusal: RemoteError | None = None
        for future in futures:
            try:
                return read_reply(procedure, future.result(timeout_s))
            except FutureTimeout:
                raise QueryTimeout(f"no answer on {procedure.key} within {timeout_s} s") from None
            except RemoteError as problem:
                refusal = problem
        raise refusal or NoReply(f"no process serves {procedure.key}")

    def alive(self) -> frozenset[str]:
        return frozenset(self._router.services.values())

    def members(self) -> frozenset[tuple[str, str]]:
        services = self._router.services.copy()
        return frozenset((service, bus.instance) for bus, service in services.items())

    def connected(self) -> bool:
        return True

    def sibling(self, namespace: str) -> MemoryBus:
        sibling = MemoryBus(self._router.space(namespace), self._service)
        sibling.instance = self.instance
        return sibling

    def claim(self) -> tuple[str, ...]:
        others = tuple(
            f"{service} {bus.instance}"
            for bus, service in self._router.services.items()
            if bus is not self and role_of(service) == role_of(self._service)
        )
        if not others:
            self._router.services[self] = self._service
        return others

    def metrics(self) -> dict[str, float]:
        """See ``transport.Bus``; there is no link inside one process."""
        return {}

    def close(self) -> None:
        """Leave at once, as a killed process would: its handlers answer no more."""
        self._router.services.pop(self, None)
        servers = self._router.servers
        for key, entries in list(servers.items()):
            servers[key] = [entry for entry in entries if entry[0] is not self]
            for bus, server in entries:
                if bus is self:
                    server.close()


class _Server:
    """Answers one procedure in threads of its own."""

    def __init__(
        self, procedure: Procedure[Any, Any], handler: Callable[[Any], Any], clock: Clock
    ) -> None:
        self._procedure, self._handler, self._clock = procedure, handler, clock
        self._pool = clock.pool(procedure.parallel, procedure.key)

    def ask(self, packet: Packet, patience_s: float) -> Future[Packet]:
        """The reply to come."""
        return self._pool.submit(self._answer, packet, patience_s, self._clock.monotonic_s())

    def _answer(self, packet: Packet, patience_s: float, arrived_s: float) -> Packet:
        waited_s = self._clock.monotonic_s() - arrived_s
        return answer(
            self._procedure, self._handler, packet, waited_s=waited_s, patience_s=patience_s
        )

    def close(self) -> None:
        """Answer no more."""
        self._pool.shutdown(wait=False, cancel_futures=True)


class _MemoryPublisher(Generic[M]):
    def __init__(self, router: MemoryRouter, topic: Topic[M]) -> None:
        self._router = router
        self._topic = topic

    def put(self, message: M) -> None:
        packet = encode(message)
        if self._topic.latched:
            self._router.latched[self._topic.key] = packet
        self._router.inject(self._topic.key, packet)
