"""Requests views of the map, and keeps them, so that only what changed has to be sent."""
# Talks: calls the mapper.

from __future__ import annotations

from onemap_planner.world.assembled_view import AssembledView, ChangesDoNotFit, after
from onemap_planner.world.map_view import PlanningView
from onemap_shared import keys
from onemap_shared.messages import NO_VIEW, SearchViewRequest, ViewChangesRequest, ViewKey
from onemap_shared.transport import Bus, NoReply, RemoteError

KEPT_VIEWS = 4  # of the present object and of waiting ones, which are asked for in turn


class ViewRequests:
    """Views by what was asked for; of one thread."""

    def __init__(self, bus: Bus, timeout_s: float) -> None:
        self._bus, self._timeout_s = bus, timeout_s
        self.whole = self.changed = 0  # views that came as a whole, and as what changed
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
        made = after(kept, changes)
        self.whole += changes.base == NO_VIEW
        self.changed += changes.base != NO_VIEW
        return made
