"""Writes what travels on the bus into a bag."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from typing import Any

from onemap_shared import keys
from onemap_shared.keys import Procedure, Topic
from onemap_shared.messages import (
    AnsweredQuery,
    FeatureField,
    MapDigestRequest,
    MapRevision,
    SearchStatus,
    SearchViewRequest,
    TextRequest,
)
from onemap_shared.transport import Bus, CallError, Subscription
from onemap_tools.bag.bag_file import BagWriter
from onemap_tools.bag.recorded_topics import DIGESTS, EMBEDDINGS, IMAGES, OTHERS, VIEWS, key_of

COUNTED = (keys.ROBOT_RGBD, keys.ROBOT_ODOMETRY)  # their sequences have no gaps of their own

Streams = Sequence[tuple[Topic[Any], Subscription[Any]]]


def subscribed(bus: Bus, *, images: bool) -> Streams:
    """What is recorded, from now on."""
    topics = (*IMAGES, *OTHERS) if images else OTHERS
    return [(topic, bus.subscribe(topic, capacity)) for topic, capacity in topics]


class BagRecorder:
    """Call ``update`` several times a second, ``digest`` and ``snapshot`` now and then.

    problems: why services did not answer, by key; the last of each.
    """

    _fused_ns = _field_ns = 0  # newest stamp that a revision names, and that a field has

    def __init__(self, bus: Bus, streams: Streams, writer: BagWriter) -> None:
        self._bus = bus
        self._streams = streams
        self._writer = writer
        self._target = ""
        self._embedded: set[str] = set()
        self.recorded: Counter[str] = Counter()
        self.problems: dict[str, str] = {}

    def update(self, now_ns: int) -> None:
        """Write all messages since the last update; raises BagError."""
        for topic, subscription in self._streams:
            while (message := subscription.take(0.0)) is not None:
                self._write(key_of(topic, message), message, now_ns)
                self._note(message, now_ns)

    def _note(self, message: object, now_ns: int) -> None:
        if isinstance(message, SearchStatus):
            self._target = message.target
            self._embed(message.objects, now_ns)
        elif isinstance(message, AnsweredQuery):
            self._embed(message.texts, now_ns)
        elif isinstance(message, MapRevision):
            self._fused_ns = message.stamp_ns
        elif isinstance(message, FeatureField):
            self._field_ns = message.stamp_ns

    @property
    def whole(self) -> bool:
        """Whether the features of the newest recorded revision are recorded too."""
        return self._field_ns >= self._fused_ns

    def digest(self, now_ns: int) -> None:
        """Write the digest of the map, if the mapper answers."""
        self._ask(keys.MAP_DIGEST, MapDigestRequest(), DIGESTS, now_ns)

    def snapshot(self, now_ns: int) -> None:
        """Write the layers of the map, with the similarity to what is sought now."""
        self._ask(keys.MAP_SEARCH_VIEW, SearchViewRequest(self._target), VIEWS, now_ns)

    def _embed(self, texts: Iterable[str], now_ns: int) -> None:
        """Write the embeddings of texts that were not sought or asked for before."""
        new = tuple(text for text in dict.fromkeys(texts) if text not in self._embedded)
        if new:
            self._embedded |= set(new)
            self._ask(keys.EMBED_TEXT, TextRequest(new), EMBEDDINGS, now_ns)

    def _ask(
        self, procedure: Procedure[Any, Any], request: object, topic: Topic[Any], now_ns: int
    ) -> None:
        try:
            answer = self._bus.call(procedure, request)
        except CallError as problem:
            self.problems[topic.key] = str(problem)
            return
        self._write(topic.key, answer, now_ns)

    @property
    def missed(self) -> dict[str, int]:
        """Messages that were published and not recorded, by key; only where there are any."""
        counts = {}
        for topic, subscription in self._streams:
            counters = subscription.counters
            lost = counters.missed if topic in COUNTED else counters.skipped
            counts[topic.key] = lost + counters.refused
        return {key: count for key, count in counts.items() if count}

    def _write(self, key: str, message: object, now_ns: int) -> None:
        self._writer.write(key, message, now_ns)
        self.recorded[key] += 1
