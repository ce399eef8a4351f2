"""Views of a map as the planner assembles them from the mapper's changes, without a bus."""

from __future__ import annotations

from collections.abc import Sequence

from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.query.replies import ViewReplies
from onemap_mapper.query.scores import MapScores
from onemap_mapper.query.similarity import TextQuery
from onemap_planner.world.map_view import AssembledView, after
from onemap_shared.messages import NO_VIEW, SearchViewRequest, ViewChangesRequest


class LockstepViews:
    """Views of one map, by what was asked for."""

    def __init__(self, belief: BeliefMap) -> None:
        self._replies = ViewReplies(MapScores(belief), "lockstep")
        self._kept: dict[SearchViewRequest, AssembledView] = {}

    def view(self, request: SearchViewRequest, queries: Sequence[TextQuery]) -> AssembledView:
        """The newest view; queries: of the text and of its rivals, none in an empty map."""
        kept = self._kept.get(request)
        have = NO_VIEW if kept is None else kept.key
        question = ViewChangesRequest(request.text, request.rivals, have)
        made = after(kept, self._replies.reply(question, queries))
        self._kept[request] = made
        return made
