"""Replies with what changed in a view of the map, for callers that hold an earlier state of it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from onemap_mapper.map_scores import KnownScores, MapScores, ScoredChanges
from onemap_mapper.similarity import TextQuery
from onemap_mapper.tiles import AREA
from onemap_shared.geometry import F32
from onemap_shared.messages import NO_VIEW, ViewChanges, ViewChangesRequest, ViewKey

LAYERS_ONLY = "layers"  # the query of a view without scores


class ViewReplies:
    """Answers one map's requests for changes. It keeps nothing of its callers.

    map_id: of this map in this process; no other one had it.
    """

    def __init__(self, scores: MapScores, map_id: str) -> None:
        self._scores, self._map_id = scores, map_id

    def reply(
        self, request: ViewChangesRequest, queries: Sequence[TextQuery], robot: int = 0
    ) -> ViewChanges:
        """The changes for a robot since the state that its request names, or everything.

        queries: the text, then those of its rivals that are known; none in an empty map.
        """
        scored = self._scores.changes(queries, self._known(request.have), robot)
        cells, query = scored.cells, _query_key(scored.serials)
        tiles, first = np.unique(cells.rows // AREA, return_index=True)
        changed = np.zeros((len(tiles), AREA), bool)
        owner = np.repeat(np.arange(len(tiles)), np.diff(np.append(first, len(cells.rows))))
        changed[owner, cells.rows % AREA] = True
        since = cells.since
        return ViewChanges(
            text=request.text,
            base=NO_VIEW if since is None else ViewKey(self._map_id, query, since),
            key=ViewKey(self._map_id, query, cells.number),
            revision=cells.revision,
            sequence=cells.sequence,
            stamp_ns=cells.stamp_ns,
            grid=cells.grid,
            tiles=cells.places[tiles].astype(np.int32),
            cells=np.packbits(changed, axis=1),
            occupancy=cells.occupancy,
            layers=cells.layers,
            values=_values(scored),
            rank_limits=scored.rank_limits,
            calibrated=scored.texts[0].query.calibrated if scored.texts else True,
        )

    def _known(self, have: ViewKey) -> KnownScores:
        """What a caller holds, as this map counts; nothing that fits if it is of another one."""
        serials = _serials(have.query) if have.map_id == self._map_id else None
        return KnownScores((-1,), -1) if serials is None else KnownScores(serials, have.number)


def _query_key(serials: tuple[int, ...]) -> str:
    return ".".join(map(str, serials)) if serials else LAYERS_ONLY


def _serials(query: str) -> tuple[int, ...] | None:
    """The serials of a query's key, None if it is no such key."""
    if query == LAYERS_ONLY:
        return ()
    parts = query.split(".")
    return tuple(map(int, parts)) if all(part.isdecimal() for part in parts) else None


def _values(scored: ScoredChanges) -> F32:
    """Score, cosine and the best rival's score (p, m) of the observed ones of the cells."""
    if not scored.texts:
        return np.zeros((0, 0), np.float32)
    own, *rivals = scored.texts
    rows = [own.scores, own.cosines]
    if rivals:
        rows.append(np.max([rival.scores for rival in rivals], axis=0))
    return np.stack(rows)
