"""Caches the latest message of every topic in one snapshot that any thread may read."""
# Talks: follows the bus.

from __future__ import annotations

import logging
from collections.abc import Mapping
from functools import partial
from typing import Any

from onemap_gateway.bus.live_state import BusMessage, LiveState
from onemap_shared import keys
from onemap_shared.keys import Topic
from onemap_shared.transport import Bus, Counters, Subscription

LOG = logging.getLogger("onemap.gateway")

TAKE_TIMEOUT_S = 0.25  # longest wait for a message, and so the delay of a shutdown
LIVELINESS_PERIOD_S = 0.25  # between two readings of the liveliness tokens
BUFFERED_MESSAGES = 16  # for streams of which no message may be lost

# Topic and buffer size of every subscription.
STREAMS: Mapping[str, tuple[Topic[Any], int]] = {
    "rgbd": (keys.ROBOT_RGBD, 1),
    "odometry": (keys.ROBOT_ODOMETRY, 1),
    "command": (keys.ROBOT_CMD_VEL, BUFFERED_MESSAGES),
    "detections": (keys.DETECTIONS, 1),
    "revision": (keys.MAP_REVISION, 1),
    "search": (keys.SEARCH_STATE, BUFFERED_MESSAGES),
    "path": (keys.SEARCH_PATH, 1),
    "heartbeat": (keys.ALL_HEARTBEATS, BUFFERED_MESSAGES),
}


class StateCache:
    """Subscribes to every stream that clients may watch, one thread per stream.

    An exception in a thread ends the process, by the runner's excepthook.
    """

    def __init__(self, bus: Bus) -> None:
        self._bus, self.clock = bus, bus.clock
        self._state = LiveState(since_s=self.clock.monotonic_s())
        self._lock = self.clock.lock()  # replacing the state is read, compute, write
        self._closing = self.clock.event()
        self._subscriptions: dict[str, Subscription[BusMessage]] = {
            name: bus.subscribe(topic, capacity) for name, (topic, capacity) in STREAMS.items()
        }
        self._threads = [
            self.clock.thread(f"follow-{item[0]}", partial(self._follow, *item))
            for item in self._subscriptions.items()
        ]
        self._threads.append(self.clock.thread("liveliness", self._watch_liveliness))

    @property
    def state(self) -> LiveState:
        """The newest snapshot."""
        return self._state

    @property
    def closing(self) -> bool:
        """Whether the gateway shuts down: open streams have to end."""
        return self._closing.is_set()

    def now_s(self) -> float:
        """The time on the clock of the snapshot's arrival times."""
        return self.clock.monotonic_s()

    def counters(self) -> Mapping[str, Counters]:
        """Message counters per stream."""
        return {name: subscription.counters for name, subscription in self._subscriptions.items()}

    def state_with_fresh_liveliness(self) -> LiveState:
        """The newest snapshot with the liveliness tokens of this moment, not of the last poll."""
        return self._state.with_members(
            self._bus.members(), self.clock.monotonic_s(), connected=self._bus.connected()
        )

    def begin_close(self) -> None:
        """Ask streams and threads to end, without waiting for them."""
        self._closing.set()

    def close(self) -> None:
        """End the threads and wait for them."""
        self.begin_close()
        for thread in self._threads:
            thread.join(2 * TAKE_TIMEOUT_S)

    def _follow(self, name: str, subscription: Subscription[BusMessage]) -> None:
        refused = 0
        while not self._closing.is_set():
            message = subscription.take(TAKE_TIMEOUT_S)
            if message is not None:
                with self._lock:
                    self._state = self._state.with_message(message, self.clock.monotonic_s())
            counters = subscription.counters
            if counters.refused > refused:
                refused = counters.refused
                # a text of its own for each stream: the log is limited by text
                LOG.warning(f"{name}: message refused: %s", counters.last_problem)

    def _watch_liveliness(self) -> None:
        while True:
            members, connected = self._bus.members(), self._bus.connected()
            with self._lock:
                now_s = self.clock.monotonic_s()
                self._state = self._state.with_members(members, now_s, connected=connected)
            if self._closing.wait(LIVELINESS_PERIOD_S):
                return
