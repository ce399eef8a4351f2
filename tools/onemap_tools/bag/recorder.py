"""Writes what travels on the bus into a bag."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any

from onemap_shared import keys
from onemap_shared.keys import Topic
from onemap_shared.messages import MapDigestRequest
from onemap_shared.transport import Bus, CallError, Subscription
from onemap_tools.bag.bag_file import BagWriter
from onemap_tools.bag.recorded_topics import DIGESTS, IMAGES, OTHERS, key_of

COUNTED = (keys.ROBOT_RGBD, keys.ROBOT_ODOMETRY)  # their sequences have no gaps of their own

Streams = Sequence[tuple[Topic[Any], Subscription[Any]]]


def subscribed(bus: Bus, *, images: bool) -> Streams:
    """What is recorded, from now on."""
    topics = (*IMAGES, *OTHERS) if images else OTHERS
    return [(topic, bus.subscribe(topic, capacity)) for topic, capacity in topics]


class BagRecorder:
    """Call ``update`` several times a second and ``digest`` now and then."""

    def __init__(self, bus: Bus, streams: Streams, writer: BagWriter) -> None:
        self._bus = bus
        self._streams = streams
        self._writer = writer
        self.recorded: Counter[str] = Counter()
        self.digest_problem = ""

    def update(self, now_ns: int) -> None:
        """Write all messages since the last update; raises BagError."""
        for topic, subscription in self._streams:
            while (message := subscription.take(0.0)) is not None:
                self._write(key_of(topic, message), message, now_ns)

    def digest(self, now_ns: int) -> None:
        """Write the digest of the map, if the mapper answers."""
        try:
            answer = self._bus.call(keys.MAP_DIGEST, MapDigestRequest())
        except CallError as problem:
            self.digest_problem = str(problem)
            return
        self._write(DIGESTS.key, answer, now_ns)

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
