"""Scores of texts at whole revisions of a map, computed while frames are fused into it.

Most cells are scored without the map's lock, from memory that frames write to. Then, with the
lock, the revision is copied, and with it the features of the cells that have changed since. Those
are scored anew from the copy: what was read half written is among them.
"""

from __future__ import annotations

import threading
from collections.abc import Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace

from onemap_mapper.belief_map import BeliefMap
from onemap_mapper.feature_table import CellFeatures
from onemap_mapper.map_version import MapVersion
from onemap_mapper.similarity import CellScores, ScoreCache, TextQuery

COPIED_CELLS = 4096  # with the lock held: 12 MB of 768 float32 channels; a frame changes 800
ATTEMPTS = 4  # of them, each scores what changed during the one before


@dataclass(frozen=True, slots=True)
class ScoredVersion:
    """A revision of a map with the scores of the texts that were asked for, in their order."""

    version: MapVersion
    texts: tuple[CellScores, ...] = ()


class MapScores:
    """Scores of one map. Thread-safe; the map changes only while ``lock`` is held."""

    def __init__(
        self, belief: BeliefMap, lock: AbstractContextManager[object] | None = None
    ) -> None:
        self._belief = belief
        self._lock = lock if lock is not None else threading.Lock()
        self._turn = threading.Lock()  # one asker at a time reads the map
        self._cache = ScoreCache()

    def of(self, queries: Sequence[TextQuery], robot: int = 0) -> ScoredVersion:
        """The newest revision for a robot, with the scores and cosines of the queries."""
        scored = self._scored(queries)
        return replace(scored, version=scored.version.of_robot(robot))

    def _scored(self, queries: Sequence[TextQuery]) -> ScoredVersion:
        with self._turn:
            for _ in range(ATTEMPTS):
                version, revision, table = self._begin(queries)
                found = self._cache.scores_of_all(queries, table, revision)
                if version is not None:
                    return ScoredVersion(version, tuple(found))
            with self._lock:  # the map changes faster than it is read, as when submaps move
                belief = self._belief
                found = self._cache.scores_of_all(queries, belief.store, belief.revision)
                return ScoredVersion(belief.version(), tuple(found))

    def _begin(self, queries: Sequence[TextQuery]) -> tuple[MapVersion | None, int, CellFeatures]:
        """The features to read next and their revision, with a copy of that if they are one too."""
        with self._lock:
            belief = self._belief
            stale = self._cache.stale(queries, belief.store)
            if len(stale) > COPIED_CELLS:
                return None, belief.revision, belief.store.table()
            return belief.version(), belief.revision, belief.store.copied(stale)
