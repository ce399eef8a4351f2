"""A router and its sessions in virtual time, with the semantics of ``ZenohBus``.

Messages are encoded and decoded; a subscription keeps the newest only; what was latched reaches who
subscribes later; a call without a server raises ``NoReply``. Each session has its links to the
router. What a process has sent arrives though it ends.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from functools import partial
from itertools import product
from typing import Any, Generic, TypeVar

from onemap_shared.clock import Event
from onemap_shared.config import LinkParams
from onemap_shared.frame_sender import FrameSender
from onemap_shared.keys import Delivery, Procedure, Topic
from onemap_shared.services import role_of
from onemap_shared.transport import (
    CALL_TIMEOUT_S,
    Inbox,
    InvalidReply,
    NoReply,
    Publisher,
    QueryTimeout,
    RemoteError,
    Subscription,
    answer,
    read_reply,
)
from onemap_shared.wire import Packet, encode
from onemap_tools.virtual.link import Lane, Link
from onemap_tools.virtual.primitives import VirtualClock
from onemap_tools.virtual.scheduler import Process, VirtualWorld

M = TypeVar("M")
Q = TypeVar("Q")
R = TypeVar("R")

LEASE_S = 2.0  # after which router and session notice that the link between them is dead
RETRY_S = (0.2, 2.0)  # between attempts to reach the router, as Zenoh's are set
NO_PACE = LinkParams()
SMALL = 64  # bytes of what carries no message


class VirtualRouter:
    """Connects sessions. ``up``: while it is not, no session reaches another."""

    def __init__(self, world: VirtualWorld) -> None:
        self.world, self.up = world, True
        self.sessions: list[VirtualBus] = []
        self.observers: list[Callable[[str, Packet], object]] = []  # of all that is published
        # By key, what becomes of a packet: none, another one or several.
        self.changes: dict[str, Callable[[Packet], list[Packet]]] = {}

    def join(
        self, process: Process, service: str, *, namespace: str = "", announce: bool = True
    ) -> VirtualBus:
        """A session of a process, which must be able to reach the router now."""
        instance = process.random.randbytes(6).hex()
        bus = VirtualBus(self, process, service, instance, namespace)
        bus.connect()
        if announce:
            bus.announce()
        return bus

    def stop(self) -> None:
        """The router ends: its connections are closed at once."""
        self.up = False
        for session in list(self.sessions):
            session.disconnect()

    def start(self) -> None:
        """Another router on the same port: sessions find it when they try again."""
        self.up = True

    def cut(self, process: Process, *, cut: bool) -> None:
        """Cut the process's links, or mend them."""
        for session in self.sessions_of(process):
            session.set_cut(cut=cut)

    def stall(self, process: Process, *, stalled: bool, suspended: bool = False) -> None:
        """Stall a process, or let it go on; its connections end with the lease.

        suspended: with its computer, whose monotonic clock stands still meanwhile.
        """
        self.world.stall(process, stalled=stalled)
        if suspended and not stalled:
            process.suspended_ns += self.world.now_ns - process.belongings["stalled_ns"]
        if stalled:
            began_ns = self.world.now_ns
            process.belongings["stalled_ns"] = began_ns
            self.world.at(LEASE_S, partial(self._lease_ends, process, began_ns))

    def _lease_ends(self, process: Process, began_ns: int) -> None:
        if process.stalled and process.belongings["stalled_ns"] == began_ns:
            for session in self.sessions_of(process):
                session.disconnect()

    def sessions_of(self, process: Process) -> list[VirtualBus]:
        """Sessions that a process has opened and not closed, connected or not."""
        return [bus for bus in process_sessions(process) if not bus.closed]

    def tokens(self, namespace: str) -> frozenset[tuple[str, str]]:
        """Service and instance of every process that is shown under these keys."""
        return frozenset(
            (bus.service, bus.instance)
            for bus in self.sessions
            if bus.announced and bus.namespace == namespace
        )

    def publish(self, key: str, packet: Packet, delivery: Delivery) -> None:
        """Pass a packet on to who subscribes to its key, as ``changes`` makes it."""
        change = self.changes.get(key)
        for each in [packet] if change is None else change(packet):
            self._pass_on(key, each, delivery)

    def _pass_on(self, key: str, packet: Packet, delivery: Delivery) -> None:
        self.world.note(key.encode() + packet.header + packet.body)
        for observe in self.observers:
            observe(key, packet)
        nbytes = len(packet.header) + len(packet.body)
        for session in list(self.sessions):
            for pattern, take in session.followed:
                if pattern == key or ("*" in pattern and fnmatchcase(key, pattern)):
                    session.receive(nbytes, partial(take, packet), delivery, drops=True)

    def tell_members(self, namespace: str) -> None:
        """Tell all sessions of a namespace who is shown under its keys."""
        tokens = self.tokens(namespace)
        for session in self.sessions:
            if session.namespace == namespace:
                session.receive(SMALL, partial(session.take_members, tokens))


def process_sessions(process: Process) -> list[VirtualBus]:
    """All sessions that a process has ever opened."""
    sessions: list[VirtualBus] = process.belongings.setdefault("sessions", [])
    return sessions


@dataclass(eq=False)
class _Query:
    """A call under way: what was answered, and how many answers may still come."""

    changed: Event
    open: int = 0
    sent: bool = False  # the router knows how many there are
    replies: deque[Packet | RemoteError] = field(default_factory=deque)

    def answered(self, reply: Packet | RemoteError | None) -> None:
        """One server has answered; None: it ended without."""
        self.open -= 1
        if reply is not None:
            self.replies.append(reply)
        self.changed.set()

    def asked(self, count: int) -> None:
        """So many were asked."""
        self.open, self.sent = self.open + count, True
        self.changed.set()


class VirtualBus:
    """One session of a process. Implements ``transport.Bus``."""

    def __init__(
        self,
        router: VirtualRouter,
        process: Process,
        service: str,
        instance: str,
        namespace: str,
        *,
        pace: LinkParams = NO_PACE,
    ) -> None:
        self.router, self.process, self.service = router, process, service
        self.instance, self.namespace, self._pace = instance, namespace, pace
        self.clock = VirtualClock(router.world, process)
        self.up, self.down = Link(), Link()
        self._lanes = {
            (way, delivery is Delivery.COMMAND): Lane(link)
            for way, link in (("up", self.up), ("down", self.down))
            for delivery in (Delivery.COMMAND, Delivery.STATE)
        }
        self.followed: list[tuple[str, Callable[[Packet], object]]] = []
        self.latched: dict[str, Packet] = {}
        self.servers: dict[str, _Server] = {}
        self.announced = self.closed = self._connected = False
        self._wants_token = False
        self._asked: list[tuple[VirtualBus, _Query]] = []  # queries that this session is to answer
        self._members: frozenset[tuple[str, str]] = frozenset()
        self._came = deque[Callable[[], object]]()
        self._any = self.clock.event()
        self._epoch = 0  # counts cuts
        process_sessions(process).append(self)
        process.on_death.append(self._leave)
        self.clock.thread("receive", self._receive_all)

    # The session and the router.

    def connect(self) -> None:
        """Reach the router; raises ConnectionError."""
        if not self.router.up or self.up.cut or self.down.cut:
            raise ConnectionError("the router does not answer")
        if not self._connected:
            self._connected = True
            self.router.sessions.append(self)
            self.receive(SMALL, partial(self.take_members, self.router.tokens(self.namespace)))
            if self._wants_token:
                self._show()

    def disconnect(self) -> None:
        """The connection is gone; a session that has not ended sees it, and tries again."""
        if self in self.router.sessions:
            self.router.sessions.remove(self)
        for caller, query in self._asked:
            caller.receive(SMALL, partial(query.answered, None))
        self._asked.clear()
        if self.announced:
            self.announced = False
            self.router.tell_members(self.namespace)
        for lane in self._lanes.values():
            lane.break_off()
        if not self.closed:
            self._connected = False
            self.router.world.at(0.0, partial(self._came_in, self._lost))
            self._try_again(RETRY_S[0])

    def _lost(self) -> None:
        self._members = frozenset()

    def _try_again(self, pause_s: float) -> None:
        def attempt() -> None:
            if self.closed or not self.process.alive or self._connected:
                return
            if self.process.stalled:
                self._try_again(pause_s)
                return
            try:
                self.connect()
            except ConnectionError:
                self._try_again(min(2 * pause_s, RETRY_S[1]))

        self.router.world.at(pause_s, attempt)

    def set_cut(self, *, cut: bool) -> None:
        """Cut both links or mend them; a cut of more than the lease ends the connection."""
        self.up.cut = self.down.cut = cut
        self._epoch += 1
        if cut:
            self.router.world.at(LEASE_S, partial(self._lease_ends, self._epoch))
            return
        for lane in self._lanes.values():
            lane.release()

    def change_link(self, **values: float) -> None:
        """Change both links; what waits leaves as fast as they are now."""
        for link, (name, value) in product((self.up, self.down), values.items()):
            setattr(link, name, value)
        for lane in self._lanes.values():
            lane.send_on(self.router.world)

    def _lease_ends(self, epoch: int) -> None:
        if epoch == self._epoch and self._connected:
            self.disconnect()

    def _leave(self) -> None:
        """End the session once what was sent has arrived, as the kernel sends it for the dead."""
        lanes = [lane for (way, _), lane in self._lanes.items() if way == "up"]
        left = set(range(len(lanes)))

        def arrived(index: int) -> None:
            left.discard(index)
            if not left:
                self._end()

        if not self._connected:
            self._end()
            return
        for index, lane in enumerate(lanes):
            lane.send(self.router.world, 0, partial(arrived, index))

    def _end(self) -> None:
        self.closed = True
        self.disconnect()
        self._connected = False

    def send(
        self,
        nbytes: int,
        arrive: Callable[[], object],
        delivery: Delivery = Delivery.STATE,
        *,
        drops: bool = False,
    ) -> None:
        """Send to the router, which then calls ``arrive``; drops: see ``Link``."""
        self.router.world.pass_by()
        if self._connected:
            lane = self._lanes["up", delivery is Delivery.COMMAND]
            lane.send(self.router.world, nbytes, arrive, drops=drops)

    def receive(
        self,
        nbytes: int,
        take: Callable[[], object],
        delivery: Delivery = Delivery.STATE,
        *,
        drops: bool = False,
    ) -> None:
        """Pass on from the router to this process, whose receiving thread calls ``take``."""
        lane = self._lanes["down", delivery is Delivery.COMMAND]
        lane.send(self.router.world, nbytes, partial(self._came_in, take), drops=drops)

    def _came_in(self, take: Callable[[], object]) -> None:
        if self.process.alive and not self.closed:
            self._came.append(take)
            self._any.set()

    def _receive_all(self) -> None:
        while not self.closed:
            self._any.wait()
            self._any.clear()
            while self._came:
                self._came.popleft()()

    # What ``transport.Bus`` asks for.

    def publish(self, topic: Topic[M]) -> Publisher[M]:
        publisher = _VirtualPublisher(self, topic)
        if topic.receipts is None or self._pace == NO_PACE:
            return publisher
        sender = FrameSender(topic, self._pace, publisher.send, self.clock)
        self.followed.append((self.full(topic.receipts.key), sender.receipt))
        return sender

    def shape(self, link: Link) -> None:
        """Make both directions as slow as this link."""
        for way in (self.up, self.down):
            way.delay_s, way.jitter_s = link.delay_s, link.jitter_s
            way.bytes_per_s = link.bytes_per_s

    def subscribe(
        self, topic: Topic[M], capacity: int = 1, arrived: Event | None = None
    ) -> Subscription[M]:
        inbox = Inbox(topic.message, capacity, self.clock, arrived)
        key = self.full(topic.key)

        def ask_latched() -> None:
            for other in self.router.sessions:
                if key in other.latched:
                    other.receive(SMALL, partial(reply_latched, other))

        def reply_latched(other: VirtualBus) -> None:
            packet = other.latched[key]
            nbytes = len(packet.header) + len(packet.body)
            other.send(nbytes, lambda: self.receive(nbytes, partial(inbox.put, packet)))

        self.followed.append((key, inbox.put))
        if topic.latched:
            self.send(SMALL, ask_latched, topic.delivery)
        return inbox

    def serve(self, procedure: Procedure[Q, R], handler: Callable[[Q], R]) -> None:
        self.servers[self.full(procedure.key)] = _Server(self, procedure, handler)

    def call(self, procedure: Procedure[Q, R], request: Q, timeout_s: float = CALL_TIMEOUT_S) -> R:
        packet, asked_s = encode(request), self.clock.monotonic_s()
        query = _Query(self.clock.event())
        self._ask(procedure, packet, query, timeout_s)
        refusal: RemoteError | None = None
        while True:
            while query.replies:
                reply = query.replies.popleft()
                try:
                    if isinstance(reply, RemoteError):
                        raise reply
                    return read_reply(procedure, reply)
                except InvalidReply as problem:
                    refusal = problem
                except RemoteError as problem:
                    refusal = problem
            left_s = timeout_s - (self.clock.monotonic_s() - asked_s)
            if (query.sent and query.open <= 0) or left_s <= 0:
                break
            query.changed.wait(left_s)
            query.changed.clear()
        if refusal is not None:
            raise refusal
        if self.clock.monotonic_s() - asked_s > 0.9 * timeout_s:
            raise QueryTimeout(f"no answer on {procedure.key} within {timeout_s} s")
        raise NoReply(f"no process serves {procedure.key}")

    def _ask(
        self, procedure: Procedure[Any, Any], packet: Packet, query: _Query, patience_s: float
    ) -> None:
        key, nbytes = self.full(procedure.key), len(packet.header) + len(packet.body)

        def at_router() -> None:
            self.router.world.note(key.encode() + packet.header + packet.body)
            servers = [other for other in self.router.sessions if key in other.servers]
            asked = servers if procedure.to_all else servers[-1:]
            query.open += len(asked)
            for other in asked:
                other._asked.append((self, query))
                take = partial(other.servers[key].ask, packet, patience_s, self, query)
                other.receive(nbytes, take, procedure.delivery)
            self.receive(SMALL, partial(query.asked, 0), procedure.delivery)

        if not self._connected:
            query.asked(0)
        self.send(nbytes, at_router, procedure.delivery)

    def reply(
        self,
        caller: VirtualBus,
        query: _Query,
        reply: Packet | RemoteError,
        delivery: Delivery,
    ) -> None:
        """Answer a query of another session."""
        nbytes = len(reply.header) + len(reply.body) if isinstance(reply, Packet) else SMALL

        def at_router() -> None:
            if (caller, query) in self._asked:
                self._asked.remove((caller, query))
                if isinstance(reply, Packet):
                    self.router.world.note(reply.header + reply.body)
                caller.receive(nbytes, partial(query.answered, reply), delivery)

        self.send(nbytes, at_router, delivery)

    def full(self, key: str) -> str:
        """The key with its namespace."""
        return f"{self.namespace}/{key}" if self.namespace else key

    def alive(self) -> frozenset[str]:
        return frozenset(service for service, _ in self._members)

    def members(self) -> frozenset[tuple[str, str]]:
        return self._members

    def take_members(self, members: frozenset[tuple[str, str]]) -> None:
        """The router says who is there."""
        self._members = members

    def connected(self) -> bool:
        return self._connected

    def sibling(self, namespace: str) -> VirtualBus:
        bus = VirtualBus(
            self.router, self.process, self.service, self.instance, namespace, pace=self._pace
        )
        bus.connect()
        return bus

    def announce(self) -> None:
        """Show this process to the others, as long as it is connected."""
        self._wants_token = True
        self._show()

    def _show(self) -> None:
        def at_router() -> None:
            self.announced = True
            self.router.tell_members(self.namespace)

        self.send(SMALL, at_router)

    def claim(self) -> tuple[str, ...]:
        others = self._others()
        if not others:
            self.announce()
            others = self._others()
        if others and self._wants_token:
            self._wants_token = False
            self.send(SMALL, self._withdraw)
        return others

    def _withdraw(self) -> None:
        self.announced = False
        self.router.tell_members(self.namespace)

    def _others(self) -> tuple[str, ...]:
        told, found = self.clock.event(), list[frozenset[tuple[str, str]]]()

        def heard(tokens: frozenset[tuple[str, str]]) -> None:
            found.append(tokens)
            told.set()

        self.send(
            SMALL,
            lambda: self.receive(SMALL, partial(heard, self.router.tokens(self.namespace))),
        )
        if not self._connected or not told.wait(CALL_TIMEOUT_S):
            raise ConnectionError("the router does not answer")
        own = (self.service, self.instance)
        role = role_of(self.service)
        others = (each for each in found[0] if each != own and role_of(each[0]) == role)
        return tuple(sorted(map(" ".join, others)))

    def metrics(self) -> dict[str, float]:
        return {}

    def close(self) -> None:
        for server in list(self.servers.values()):
            server.close()
        self.router.world.pass_by()
        self._leave()


class _Server:
    """Answers one procedure in threads of its own."""

    def __init__(
        self, bus: VirtualBus, procedure: Procedure[Any, Any], handler: Callable[[Any], Any]
    ) -> None:
        self._bus, self._procedure, self._handler = bus, procedure, handler
        self._pool = bus.clock.pool(procedure.parallel, procedure.key)
        self._closed = False

    def ask(self, packet: Packet, patience_s: float, caller: VirtualBus, query: _Query) -> None:
        """A query arrived."""
        if not self._closed:
            arrived_s = self._bus.clock.monotonic_s()
            self._pool.submit(self._answer, packet, patience_s, arrived_s, caller, query)

    def _answer(
        self, packet: Packet, patience_s: float, arrived_s: float, caller: VirtualBus, query: _Query
    ) -> None:
        reply: Packet | RemoteError
        try:
            waited_s = self._bus.clock.monotonic_s() - arrived_s
            reply = answer(
                self._procedure, self._handler, packet, waited_s=waited_s, patience_s=patience_s
            )
        except RemoteError as problem:
            reply = problem
        self._bus.reply(caller, query, reply, self._procedure.delivery)

    def close(self) -> None:
        """Answer no more."""
        self._closed = True
        self._pool.shutdown(wait=False, cancel_futures=True)


class _VirtualPublisher(Generic[M]):
    def __init__(self, bus: VirtualBus, topic: Topic[M]) -> None:
        self._bus, self._topic, self._key = bus, topic, bus.full(topic.key)

    def put(self, message: M) -> None:
        self.send(encode(message))

    def send(self, packet: Packet) -> None:
        """Publish an encoded message."""
        if self._topic.latched:
            self._bus.latched[self._key] = packet
        publish = partial(self._bus.router.publish, self._key, packet, self._topic.delivery)
        nbytes = len(packet.header) + len(packet.body)
        self._bus.send(nbytes, publish, self._topic.delivery, drops=True)
