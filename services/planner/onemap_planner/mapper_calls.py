"""Calls to the mapper: views of the map, and finds for it to keep."""
# Talks: calls the mapper.

from __future__ import annotations

import logging
import threading
from collections import deque
from collections.abc import Iterable

from onemap_planner.world.map_view import AssembledView, ChangesDoNotFit, PlanningView, after
from onemap_shared import keys
from onemap_shared.messages import (
    NO_VIEW,
    ObjectFind,
    SearchViewRequest,
    ViewChangesRequest,
    ViewKey,
)
from onemap_shared.transport import Bus, CallError, NoReply, RemoteError

KEPT_VIEWS = 4  # of the present object and of waiting ones, which are asked for in turn


class ViewRequests:
    """Views by what was asked for; of one thread."""

    def __init__(self, bus: Bus, timeout_s: float) -> None:
        self._bus, self._timeout_s = bus, timeout_s
        self.whole = self.changed = 0  # views that came as a whole, and as what changed
        self.map_id = ""  # of the newest view's map; empty before the first, and if no mapper says
        self._kept: dict[SearchViewRequest, AssembledView] = {}  # the newest last

    def view(self, request: SearchViewRequest) -> PlanningView:
        """The newest view. Raises ``CallError``.

        A lost reply costs nothing: the next request names the same view as the last one. A mapper
        of an earlier release, which serves no changes, sends the whole view.
        """
        try:
            return self._updated(request)
        except NoReply:
            view = self._bus.call(keys.MAP_SEARCH_VIEW, request, self._timeout_s)
            self.whole += 1
            return view

    def _updated(self, request: SearchViewRequest) -> AssembledView:
        kept = self._kept.get(request)
        try:
            made = self._asked(request, kept)
        except ChangesDoNotFit:
            made = self._asked_anew(request)
        self._kept.pop(request, None)
        self._kept[request] = made
        while len(self._kept) > KEPT_VIEWS:
            del self._kept[next(iter(self._kept))]
        return made

    def forget(self) -> None:
        """Free the memory of all views, 14 bytes for each known cell."""
        self._kept.clear()

    def _asked_anew(self, request: SearchViewRequest) -> AssembledView:
        try:
            return self._asked(request, None)
        except ChangesDoNotFit as problem:
            raise RemoteError("internal", f"{problem}, though the whole was asked for") from problem

    def _asked(self, request: SearchViewRequest, kept: AssembledView | None) -> AssembledView:
        have: ViewKey = NO_VIEW if kept is None else kept.key
        question = ViewChangesRequest(request.text, request.rivals, have)
        changes = self._bus.call(keys.MAP_VIEW_CHANGES, question, self._timeout_s)
        self.map_id = changes.key.map_id
        made = after(kept, changes)
        self.whole += changes.base == NO_VIEW
        self.changed += changes.base != NO_VIEW
        return made


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
