"""Finds on their way to the mapper, kept until it has acknowledged them."""
# Talks: calls the mapper.

from __future__ import annotations

import logging
import threading
from collections import deque
from collections.abc import Iterable

from onemap_shared import keys
from onemap_shared.messages import ObjectFind
from onemap_shared.transport import Bus, CallError, RemoteError

LOG = logging.getLogger("onemap.planner")

MAX_UNSENT = 20  # finds of one search; the oldest is dropped
CALL_TIMEOUT_S = 1.0  # the mapper writes a file of some MB before it answers


class FindOutbox:
    """Finds that the mapper has not acknowledged, oldest first. Any thread may use it."""

    def __init__(self, bus: Bus) -> None:
        self._bus = bus
        self._lock = threading.Lock()
        self._unsent: deque[ObjectFind] = deque(maxlen=MAX_UNSENT)
        self._refused: ObjectFind | None = None  # the last, so that it is logged once

    def add(self, finds: Iterable[ObjectFind]) -> None:
        """Take finds to send."""
        with self._lock:
            self._unsent.extend(finds)

    def clear(self) -> None:
        """Drop all finds: the map that they were found on is gone."""
        with self._lock:
            self._unsent.clear()

    def send(self) -> None:
        """Send what there is; ends at the first find that the mapper does not acknowledge.

        A find that the mapper refuses as invalid is dropped: it would be refused again.
        """
        while (find := self._oldest()) is not None:
            try:
                self._bus.call(keys.MAP_REMEMBER, find, CALL_TIMEOUT_S)
            except RemoteError as problem:
                if find is not self._refused:
                    LOG.error("the map does not keep %s: %s", find.name, problem)
                self._refused = find
                if problem.code != "invalid":
                    return
            except CallError:
                return  # the mapper is away; tried again in the next period
            self._remove(find)

    def _oldest(self) -> ObjectFind | None:
        with self._lock:
            return self._unsent[0] if self._unsent else None

    def _remove(self, find: ObjectFind) -> None:
        with self._lock:
            if self._unsent and self._unsent[0] is find:
                self._unsent.popleft()
