"""The bus over Zenoh: only this module imports it.

Every service is a client of one router; discovery by multicast or gossip is
off. Velocity commands use a session of their own, so that no image delays
them. Callbacks put a reference into an inbox and return; each procedure's
handler runs in threads of its own.
"""
# Talks: Zenoh.
# Talks: Zenoh's liveliness tokens.

from __future__ import annotations

import json
import logging
import math
import re
from collections.abc import Callable
from pathlib import Path
from queue import SimpleQueue
from typing import Any, Generic, TypeVar

import zenoh

from onemap_shared import transport
from onemap_shared.access_control import access_control
from onemap_shared.clock import Event, SystemClock
from onemap_shared.config import BusConfig, ConfigError, LinkParams
from onemap_shared.frame_sender import FrameSender
from onemap_shared.keys import (
    ALL_LIVELINESS,
    Delivery,
    Procedure,
    Topic,
    liveliness,
    member_of,
    router_probe,
)
from onemap_shared.services import role_of
from onemap_shared.tls_files import refuse_unreadable
from onemap_shared.wire import Packet, encode, schema

CLOCK = SystemClock()  # Zenoh knows no other
M = TypeVar("M")
Q = TypeVar("Q")
R = TypeVar("R")
LOG = logging.getLogger("onemap.bus")

LEASE_MS = 2000  # a dead link is noticed after this; Zenoh's own default is 10 s
DROP_PATIENCE_US = 400_000  # a 1.2 MB frame needs 0.1 s on 100 Mbit/s; the default loses it whole
STOP_CHECK_S = 1.0  # a wait without end sleeps on when another thread receives the signal
RETRY_MS = (200, 2000)  # first and longest pause between attempts to reach the router
MAX_MESSAGE_BYTES = 72 * 2**20  # above wire.MAX_BODY_BYTES: wire refuses first, with a reason

# Without consolidation, which keeps one reply of several: a refusal may hide an answer.
TO_ALL: dict[str, Any] = {
    "target": zenoh.QueryTarget.ALL,
    "consolidation": zenoh.ConsolidationMode.NONE,
}
PATIENCE = "patience_s"  # parameter of a query: how long its caller waits for the reply
PRIORITIES = {
    Delivery.FRAME: zenoh.Priority.DATA_LOW,
    Delivery.STATE: zenoh.Priority.DATA,
    Delivery.COMMAND: zenoh.Priority.REAL_TIME,
}


def zenoh_config(
    mode: str, *, connect: tuple[str, ...] = (), listen: tuple[str, ...] = ()
) -> zenoh.Config:
    """Settings of a session ("client") or a router ("router"); nothing is found by multicast."""
    settings: dict[str, Any] = {
        "mode": mode,
        "connect/endpoints": list(connect),
        "listen/endpoints": list(listen),
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": False,
        "connect/timeout_ms": 0,
        "connect/retry": {
            "period_init_ms": RETRY_MS[0],
            "period_max_ms": RETRY_MS[1],
            "period_increase_factor": 2,
        },
        "transport/link/tx/lease": LEASE_MS,
        "transport/link/tx/queue/congestion_control/drop/max_wait_before_drop_fragments": (
            DROP_PATIENCE_US
        ),
        "transport/link/rx/max_message_size": MAX_MESSAGE_BYTES,
        # TCP on loopback carries 1 GB/s; shared memory would leave segments behind a SIGKILL.
        "transport/shared_memory/enabled": False,
    }
    config: zenoh.Config = zenoh.Config()
    for key, value in settings.items():
        config.insert_json5(key, json.dumps(value))
    return config


QUIET_S = 1.0  # without a router before the log says so: what starts beside it needs a moment


def open_bus(
    config: BusConfig,
    service: str,
    instance: str,
    stop: Event,
    *,
    announce: bool = True,
    waiting: Callable[[str], None] = lambda _: None,
) -> ZenohBus | None:
    """Connect to the router, retrying until it answers; None if ``stop`` was set before.

    Without ``announce`` no other process sees this one until ``claim`` succeeds. ``waiting`` is
    called before each attempt, with what is waited for. Raises UnreadableFile for a certificate
    or key that this user cannot read.
    """
    refuse_unreadable(config.connect)
    pause_s, warned, began_s = RETRY_MS[0] / 1000, False, CLOCK.monotonic_s()
    while not stop.is_set():
        waiting(f"waiting for a router at {', '.join(config.connect)}")
        try:
            bus = ZenohBus(config, service, instance)
            if announce:
                bus.announce()
            return bus
        except zenoh.ZError as problem:
            if not warned and CLOCK.monotonic_s() - began_s >= QUIET_S:
                reason = str(problem).split(" at /")[0]
                LOG.warning("waiting for a router at %s: %s", ", ".join(config.connect), reason)
                warned = True
        stop.wait(pause_s)
        pause_s = min(2 * pause_s, RETRY_MS[1] / 1000)
    return None


def run_router(
    listen: tuple[str, ...],
    stop: Event,
    file: Path | None = None,
    routed: Callable[[], None] = lambda: None,
    *,
    namespace: str = "",
) -> None:
    """Run the router that all services connect to, until ``stop`` is set.

    ``file`` is a Zenoh JSON5 configuration, the one that a ``zenohd`` would read;
    ``listen`` then replaces its endpoints unless it is empty. ``routed`` is called about once a
    second, as long as the router still passes queries on. Where ``file`` controls access, a
    ``namespace`` replaces its rules by those for the keys below it. ConfigError: ``file`` is wrong.
    """
    if file is None:
        settings = zenoh_config("router", listen=listen)
    else:
        settings = _router_settings(file)
        if listen:
            settings.insert_json5("listen/endpoints", json.dumps(list(listen)))
        if namespace and json.loads(settings.get_json("access_control/enabled")):
            settings.insert_json5("access_control", json.dumps(access_control(namespace)))
            LOG.info("each role may use its keys below %s only", namespace)
    with zenoh.open(settings) as session:
        LOG.info("router listens on %s", settings.get_json("listen/endpoints"))
        probe = router_probe(str(session.info.zid()))
        session.declare_queryable(probe, zenoh.handlers.Callback(_acknowledge, indirect=False))
        while not stop.is_set():
            if _answers(session, probe):
                routed()
            stop.wait(STOP_CHECK_S)


def _router_settings(file: Path) -> zenoh.Config:
    """What a file says, before any port is opened; ConfigError with the line if it is wrong."""
    try:
        settings: zenoh.Config = zenoh.Config.from_file(str(file))
    except zenoh.ZError as problem:
        reason = str(problem).split(" at /")[0]
        named = re.search(r'msg: "(.*)", location: .*line: (\d+), column: (\d+)', reason)
        placed = re.search(r"--> (\d+):(\d+)\n.*= (.*)", reason, re.DOTALL)
        if named:
            reason = "line {1}, column {2}: {0}".format(*named.groups())
        elif placed:
            reason = "line {}, column {}: {}".format(*placed.groups())
        raise ConfigError(f"the router's configuration {file} is wrong: {reason}") from problem
    return settings


def _acknowledge(query: zenoh.Query) -> None:
    with query:
        query.reply(query.key_expr, b"")


def _answers(session: zenoh.Session, key: str) -> bool:
    return any(reply.ok is not None for reply in session.get(key, timeout=transport.CALL_TIMEOUT_S))


class ZenohBus:
    """One process on the bus. Implements ``transport.Bus``."""

    clock = CLOCK

    def __init__(self, config: BusConfig, service: str, instance: str) -> None:
        self.service, self.instance = service, instance
        self._config, self._link = config, config.link
        self._settings = zenoh_config("client", connect=config.connect)
        if config.namespace:
            self._settings.insert_json5("namespace", json.dumps(config.namespace))
        self._session = zenoh.open(self._settings)
        self._command_session: zenoh.Session | None = None
        self._opening = CLOCK.lock()
        self._servers: list[_Server] = []
        self._declared: list[Any] = []
        self._senders: list[FrameSender[Any]] = []
        self._members: dict[str, tuple[str, str]] = {}  # service and instance by token
        self._token: zenoh.LivelinessToken | None = None
        handler = zenoh.handlers.Callback(self._on_liveliness, indirect=False)
        self._liveliness = self._session.liveliness()
        self._declared.append(
            self._liveliness.declare_subscriber(ALL_LIVELINESS, handler, history=True)
        )

    @property
    def namespace(self) -> str:
        return self._config.namespace

    def _session_for(self, delivery: Delivery) -> zenoh.Session:
        if delivery is not Delivery.COMMAND:
            return self._session
        with self._opening:
            if self._command_session is None:
                self._command_session = zenoh.open(self._settings)
            return self._command_session

    def publish(self, topic: Topic[M]) -> transport.Publisher[M]:
        session = self._session_for(topic.delivery)
        publisher = session.declare_publisher(
            topic.key,
            encoding=zenoh.Encoding.APPLICATION_OCTET_STREAM.with_schema(schema(topic.message)),
            congestion_control=zenoh.CongestionControl.DROP,
            priority=PRIORITIES[topic.delivery],
            express=topic.delivery is Delivery.COMMAND,
        )
        self._declared.append(publisher)
        if topic.receipts is not None and self._link != LinkParams():
            return self._frame_sender(topic, publisher)
        latch = _Latch(session, topic.key) if topic.latched else None
        return _ZenohPublisher(publisher, latch)

    def _frame_sender(self, topic: Topic[M], publisher: zenoh.Publisher) -> FrameSender[M]:
        def send(packet: Packet) -> None:
            publisher.put(packet.body, attachment=packet.header)

        sender = FrameSender(topic, self._link, send, CLOCK)
        self._senders.append(sender)
        if topic.receipts is not None and self._link.window:

            def on_receipt(sample: zenoh.Sample) -> None:
                sender.receipt(_packet(sample.attachment, sample.payload))

            handler = zenoh.handlers.Callback(on_receipt, indirect=False)
            self._declared.append(self._session.declare_subscriber(topic.receipts.key, handler))
        return sender

    def subscribe(
        self, topic: Topic[M], capacity: int = 1, arrived: Event | None = None
    ) -> transport.Subscription[M]:
        inbox = transport.Inbox(topic.message, capacity, CLOCK, arrived)
        session = self._session_for(topic.delivery)

        def on_sample(sample: zenoh.Sample) -> None:
            inbox.put(lambda: _packet(sample.attachment, sample.payload))

        def on_reply(reply: zenoh.Reply) -> None:
            if reply.ok is not None:
                on_sample(reply.ok)

        handler = zenoh.handlers.Callback(on_sample, indirect=False)
        self._declared.append(session.declare_subscriber(topic.key, handler))
        if topic.latched:
            latest = zenoh.handlers.Callback(on_reply, indirect=False)
            session.get(topic.key, latest, timeout=transport.CALL_TIMEOUT_S)
        return inbox

    def serve(self, procedure: Procedure[Q, R], handler: Callable[[Q], R]) -> None:
        session = self._session_for(procedure.delivery)
        self._servers.append(_Server(session, procedure, handler))

    def call(
        self, procedure: Procedure[Q, R], request: Q, timeout_s: float = transport.CALL_TIMEOUT_S
    ) -> R:
        packet, asked_at = encode(request), CLOCK.monotonic_s()
        replies = self._session_for(procedure.delivery).get(
            f"{procedure.key}?{PATIENCE}={timeout_s:g}",
            payload=packet.body,
            attachment=packet.header,
            timeout=timeout_s,
            priority=PRIORITIES[procedure.delivery],
            express=procedure.delivery is Delivery.COMMAND,
            **(TO_ALL if procedure.to_all else {}),
        )
        refusal: transport.RemoteError | None = None
        for reply in replies:
            try:
                if reply.ok is not None:
                    return transport.read_reply(
                        procedure, _packet(reply.ok.attachment, reply.ok.payload)
                    )
                error = reply.err.payload.to_bytes() if reply.err is not None else b""
                refusal = transport.remote_error(error) if error != b"Timeout" else refusal
            except transport.InvalidReply as problem:
                refusal = problem
            if refusal is not None and not procedure.to_all:  # otherwise another one may accept
                break
        if refusal is not None:
            raise refusal
        # The router's own timer may end the query with an empty reply before ours does.
        if CLOCK.monotonic_s() - asked_at > 0.9 * timeout_s:
            raise transport.QueryTimeout(f"no answer on {procedure.key} within {timeout_s} s")
        raise transport.NoReply(f"no process serves {procedure.key}")

    def _on_liveliness(self, sample: zenoh.Sample) -> None:
        key = str(sample.key_expr)
        if sample.kind == zenoh.SampleKind.PUT:
            self._members[key] = member_of(key)
        else:
            self._members.pop(key, None)

    def alive(self) -> frozenset[str]:
        return frozenset(service for service, _ in self.members())

    def members(self) -> frozenset[tuple[str, str]]:
        return frozenset(self._members.copy().values())

    def announce(self) -> None:
        """Show this process to the others, as long as it is connected."""
        if self._token is None:
            self._token = self._liveliness.declare_token(liveliness(self.service, self.instance))

    def claim(self) -> tuple[str, ...]:
        """See ``transport.Bus``.

        Each announces itself and then asks, so that of two at the same time at least one finds the
        other and withdraws. If both do, both may try again.
        """
        others = self._others()
        if not others:
            self.announce()
            others = self._others()
        if others and self._token is not None:
            self._token.undeclare()  # type: ignore[no-untyped-call]
            self._token = None
        return others

    def _others(self) -> tuple[str, ...]:
        """The other processes that have the role of this one."""
        role = role_of(self.service)
        try:
            others = self.processes() - {(self.service, self.instance)}
        except zenoh.ZError as problem:
            raise ConnectionError(f"the router does not answer: {problem}") from problem
        return tuple(sorted(" ".join(each) for each in others if role_of(each[0]) == role))

    def processes(self) -> frozenset[tuple[str, str]]:
        """Service and instance of every process on the bus, as the router knows now.

        Ours is one, if it was announced. ``members`` learns of them one by one and may know none
        yet right after joining. Asks in a session of its own: one that subscribes to the tokens is
        answered from its own cache.
        """
        own, deadline_s = (
            (self.service, self.instance),
            CLOCK.monotonic_s() + transport.CALL_TIMEOUT_S,
        )
        with zenoh.open(self._settings) as session:
            while True:
                replies = session.liveliness().get(ALL_LIVELINESS, timeout=transport.CALL_TIMEOUT_S)
                found = frozenset(member_of(str(each.ok.key_expr)) for each in replies if each.ok)
                if self._token is None or own in found or CLOCK.monotonic_s() > deadline_s:
                    return found

    def connected(self) -> bool:
        return bool(self._session.info.routers_zid())

    def sibling(self, namespace: str) -> ZenohBus:
        config = self._config.model_copy(update={"namespace": namespace})
        return ZenohBus(config, self.service, self.instance)

    def metrics(self) -> dict[str, float]:
        return {name: value for each in self._senders for name, value in each.metrics().items()}

    def close(self) -> None:
        for sender in self._senders:
            sender.close()
        for server in self._servers:
            server.stop()
        for server in self._servers:
            server.join()
        self._session.close()  # type: ignore[no-untyped-call]
        if self._command_session is not None:
            self._command_session.close()  # type: ignore[no-untyped-call]


def _packet(attachment: zenoh.ZBytes | None, payload: zenoh.ZBytes) -> Packet:
    return Packet(attachment.to_bytes() if attachment is not None else b"", payload.to_bytes())


class _Latch:
    """The newest packet of a topic, for late joiners."""

    def __init__(self, session: zenoh.Session, key: str) -> None:
        self._key = key
        self.packet: Packet | None = None
        handler = zenoh.handlers.Callback(self._on_query, indirect=False)
        self._queryable = session.declare_queryable(key, handler, complete=True)

    def _on_query(self, query: zenoh.Query) -> None:
        with query:
            if self.packet is not None:
                query.reply(self._key, self.packet.body, attachment=self.packet.header)


class _ZenohPublisher(Generic[M]):
    def __init__(self, publisher: zenoh.Publisher, latch: _Latch | None) -> None:
        self._publisher, self._latch = publisher, latch

    def put(self, message: M) -> None:
        packet = encode(message)
        if self._latch is not None:
            self._latch.packet = packet
        self._publisher.put(packet.body, attachment=packet.header)


def patience_of(query: zenoh.Query) -> float:
    """The seconds for which the caller of a query waits; infinite if it does not say."""
    try:
        return float(query.parameters.get(PATIENCE) or "inf")
    except ValueError:  # of another program
        return math.inf


class _Server(Generic[Q, R]):
    """Answers one procedure in threads of its own; every query gets an answer."""

    def __init__(
        self, session: zenoh.Session, procedure: Procedure[Q, R], handler: Callable[[Q], R]
    ) -> None:
        self._procedure, self._handler = procedure, handler
        self._queries: SimpleQueue[tuple[zenoh.Query, float] | None] = SimpleQueue()
        self._closed = CLOCK.event()
        callback = zenoh.handlers.Callback(self._arrived, indirect=False)
        self._queryable = session.declare_queryable(procedure.key, callback, complete=True)
        self._threads = [CLOCK.thread(procedure.key, self._run) for _ in range(procedure.parallel)]

    def _run(self) -> None:
        # Without a time-out: a mapper has 52 of these threads for each of its robots.
        while (asked := self._queries.get()) is not None and not self._closed.is_set():
            query, arrived_s = asked
            with query:
                self._answer(query, CLOCK.monotonic_s() - arrived_s)

    def _arrived(self, query: zenoh.Query) -> None:
        self._queries.put((query, CLOCK.monotonic_s()))

    def _answer(self, query: zenoh.Query, waited_s: float) -> None:
        payload = query.payload
        request = Packet(b"", b"") if payload is None else _packet(query.attachment, payload)
        try:
            packet = transport.answer(
                self._procedure,
                self._handler,
                request,
                waited_s=waited_s,
                patience_s=patience_of(query),
            )
        except transport.RemoteError as error:
            body = json.dumps({"code": error.code, "message": str(error), "details": error.details})
            query.reply_err(body, encoding=zenoh.Encoding.APPLICATION_JSON)
        else:
            query.reply(self._procedure.key, packet.body, attachment=packet.header)

    def stop(self) -> None:
        self._closed.set()
        for _ in self._threads:
            self._queries.put(None)

    def join(self) -> None:
        deadline_s = CLOCK.monotonic_s() + 1.0
        for thread in self._threads:
            thread.join(timeout=max(deadline_s - CLOCK.monotonic_s(), 0.0))
