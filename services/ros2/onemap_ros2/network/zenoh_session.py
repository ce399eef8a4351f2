"""A Zenoh session on a robot's router, with what both forms of ROS 2's keys share.

A client of the robot's own router, so no DDS and no ROS 2 is needed. It is a session of its own:
OneMap's bus never carries these keys.
"""
# Talks: the robot's own Zenoh session.

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import zenoh
import zenoh.ext

from onemap_ros2.network.interface import SUBSCRIBER, Endpoint, NetworkError, ServiceRequest
from onemap_shared.bus import CLOCK, zenoh_config
from onemap_shared.clock import Event

STATIC_HISTORY = 100  # latched messages of each publisher, as tf2's own listener asks for
MAX_REQUESTS = 10  # of a service that wait to be answered; the oldest is dropped
HEARTBEAT_S = 0.5  # as rmw_zenoh's publishers of transient local topics send it


def callback(*handlers: Callable[..., None]) -> Any:
    """A handler that Zenoh calls in its own thread: for each sample, and at the end."""
    return zenoh.handlers.Callback(*handlers, indirect=False)


class RobotSession:
    """The session, the tokens of the robot's graph, and an event that any arrival sets."""

    def __init__(
        self, connect: tuple[str, ...], advice: str, parse: Callable[[str], Endpoint | None]
    ) -> None:
        settings = zenoh_config("client", connect=connect)
        settings.insert_json5("timestamping/enabled", "true")  # histories of latched topics need it
        try:
            self.session = zenoh.open(settings)
        except zenoh.ZError as problem:
            raise NetworkError(
                f"no ROS 2 router answers at {', '.join(connect)}: {advice}, or correct "
                "ros2.connect"
            ) from problem
        self.id = str(self.session.info.zid())
        self._parse = parse
        self._arrived = CLOCK.event()
        self._kept: list[Any] = []  # what is dropped ends
        self._graph: dict[str, Endpoint] = {}
        self._own: set[str] = set()

    def follow_graph(self, key: str) -> None:
        """Follow the tokens on these keys."""
        handler = callback(self._on_token)
        self.keep(self.session.liveliness().declare_subscriber(key, handler, history=True))

    def announce(self, token: str) -> None:
        """Show a token of our own, which is not among the robot's endpoints."""
        self._own.add(token)
        self.keep(self.session.liveliness().declare_token(token))

    def keep(self, declared: Any) -> None:
        """Keep what was declared until the session closes."""
        self._kept.append(declared)

    def inbox(self, depth: int) -> SampleInbox:
        """Room for the newest ``depth`` samples."""
        return SampleInbox(depth, self._arrived)

    def subscribe(self, key: str, inbox: SampleInbox, *, latched: bool) -> None:
        """Collect samples; latched: also those of before, of each publisher that has a cache."""
        handler = callback(inbox.on_sample)
        if not latched:
            self.keep(self.session.declare_subscriber(key, handler))
            return
        subscriber = zenoh.ext.declare_advanced_subscriber(
            self.session,
            key,
            handler,
            history=zenoh.ext.HistoryConfig(
                detect_late_publishers=True, max_samples=STATIC_HISTORY
            ),
            recovery=zenoh.ext.RecoveryConfig(periodic_queries=None, heartbeat=True),
            subscriber_detection=True,
        )
        self.keep(subscriber)

    def publisher(self, key: str, *, latched: bool) -> Any:
        """A publisher; latched: with a cache of one message."""
        options: dict[str, Any] = {
            "congestion_control": zenoh.CongestionControl.DROP,
            "reliability": zenoh.Reliability.RELIABLE,
        }
        if latched:
            made: Any = zenoh.ext.declare_advanced_publisher(
                self.session,
                key,
                cache=zenoh.ext.CacheConfig(max_samples=1),
                publisher_detection=True,
                sample_miss_detection=zenoh.ext.MissDetectionConfig(
                    heartbeat=None, sporadic_heartbeat=HEARTBEAT_S
                ),
                **options,
            )
        else:
            made = self.session.declare_publisher(key, express=True, **options)
        self.keep(made)
        return made

    def has_subscribers(self, topic: str) -> bool:
        """Whether a node subscribes to the topic."""
        return any(e.kind == SUBSCRIBER and e.topic == topic for e in self.endpoints())

    def on_endpoint(self, found: Endpoint) -> None:
        """Called in a thread of Zenoh when an endpoint of the robot appears."""

    def ask(self, key: str, request: bytes, timeout_s: float, **options: Any) -> QueryCall:
        """Send a query to all that serve the key."""
        call = QueryCall(self._arrived)
        self.session.get(
            key,
            callback(call.on_reply, call.on_end),
            target=zenoh.QueryTarget.ALL,
            consolidation=zenoh.ConsolidationMode.NONE,
            timeout=timeout_s,
            payload=request,
            **options,
        )
        return call

    def answer(self, key: str, note: Callable[[bytes | None], bytes | None]) -> QueryInbox:
        """Collect the queries on a key; ``note``: the attachment of a reply, of the query's."""
        inbox = QueryInbox(key, note, self._arrived)
        handler = callback(inbox.on_query)
        self.keep(self.session.declare_queryable(key, handler, complete=True))
        return inbox

    def endpoints(self) -> tuple[Endpoint, ...]:
        """All endpoints but our own."""
        return tuple(e for token, e in self._graph.copy().items() if token not in self._own)

    def wait(self, timeout_s: float) -> None:
        """Until something arrives, at most ``timeout_s``."""
        self._arrived.wait(timeout_s)
        self._arrived.clear()

    def close(self) -> None:
        """Leave the network; nothing is received afterwards."""
        self.session.close()  # type: ignore[no-untyped-call]

    def _on_token(self, sample: zenoh.Sample) -> None:
        token = str(sample.key_expr)
        if sample.kind == zenoh.SampleKind.DELETE:
            self._graph.pop(token, None)
            return
        endpoint = self._parse(token)
        if endpoint is not None:
            self._graph[token] = endpoint
            self.on_endpoint(endpoint)


class SampleInbox:
    """Keeps the newest samples; its callback only stores a reference."""

    def __init__(self, depth: int, arrived: Event) -> None:
        self._samples: deque[zenoh.Sample] = deque(maxlen=depth)
        self._arrived = arrived

    def on_sample(self, sample: zenoh.Sample) -> None:
        """Keep a sample."""
        self._samples.append(sample)
        self._arrived.set()

    def take(self) -> list[bytes]:
        """See ``Reader``."""
        taken = []
        while self._samples:
            taken.append(self._samples.popleft().payload.to_bytes())
        return taken


class QueryCall:
    """Implements ``PendingCall``: the first answer counts."""

    def __init__(self, arrived: Event) -> None:
        self._arrived = arrived
        self.reply: bytes | None = None
        self.done = False

    def on_reply(self, reply: zenoh.Reply) -> None:
        """Take an answer."""
        if self.reply is None and reply.ok is not None:
            self.reply = reply.ok.payload.to_bytes()
            self.done = True
            self._arrived.set()

    def on_end(self) -> None:
        """No answer will come any more."""
        self.done = True
        self._arrived.set()


class QueryInbox:
    """Implements ``RequestReader``. A query that is dropped ends without an answer."""

    def __init__(
        self, key: str, note: Callable[[bytes | None], bytes | None], arrived: Event
    ) -> None:
        self._key, self._note, self._arrived = key, note, arrived
        self._queries: deque[zenoh.Query] = deque(maxlen=MAX_REQUESTS)

    def on_query(self, query: zenoh.Query) -> None:
        """Keep a query; its callback returns at once."""
        self._queries.append(query)
        self._arrived.set()

    def take(self) -> list[ServiceRequest]:
        """See ``RequestReader``; what ROS 2 could not match with its question is left out."""
        taken: list[ServiceRequest] = []
        while self._queries:
            query = self._queries.popleft()
            attached = query.attachment.to_bytes() if query.attachment is not None else None
            with suppress(ValueError):
                taken.append(_Query(query, self._key, self._note(attached)))
        return taken


class _Query:
    def __init__(self, query: zenoh.Query, key: str, note: bytes | None) -> None:
        self._query, self._key, self._note = query, key, note

    def reply(self, data: bytes) -> None:
        with self._query as query:
            query.reply(self._key, data, attachment=self._note)
