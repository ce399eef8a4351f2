"""Scores of texts at whole revisions of a map, and the cells that changed since a moment.

Most cells are scored without the map's lock, from memory that frames write to. Then, with the lock,
the revision is copied, and with it the features of the cells that have changed since. Those are
scored anew from the copy: what was read half written is among them.
"""
# Talks: lets the bus's threads score a map in turn.

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.belief.version import NO_SLOT, MapVersion, floor_bits, observed_bits
from onemap_mapper.query.similarity import (
    CellFeatures,
    CellScores,
    KeptScores,
    ScoreCache,
    TextQuery,
    against,
    guiding,
    rank_limits,
)
from onemap_shared.clock import Clock, SystemClock
from onemap_shared.geometry import F32, I32, I64, U8
from onemap_shared.grid import GridSpec
from onemap_shared.messages import Occupancy


@dataclass(frozen=True, slots=True)
class ChangedCells:
    """Cells that changed between two states of a map, as they are in the later one; on the host.

    since: number of the earlier change, None: all cells that anything is known of; number: of the
    later one; places (tiles, 2): where each tile of the map lies, world cell // 64. By cell, in
    ascending order of rows: rows (n,) of the map's tiles; slots (n,), NO_SLOT where nothing is
    observed; occupancy, values of ``Occupancy``; layers, bits of ``Layer``; colours (m, 3), Lab, of
    the observed ones.
    """

    revision: int
    sequence: int
    stamp_ns: int
    grid: GridSpec
    since: int | None
    number: int
    places: I64
    rows: I64
    slots: I32
    occupancy: U8
    layers: U8
    colours: F32


def changed_cells(belief: BeliefMap, since: int | None, robot: int = 0) -> ChangedCells:
    """What changed for a robot after the change ``since``; all if the map cannot tell, or for None.

    Takes the time of what changed, not of the map, unless it is everything.
    """
    if since is None or not belief.changes.covers(since):
        since, rows = None, _known_rows(belief)
    else:
        rows = belief.changes.rows_since(since)
    slots, driving = belief.slots.values[rows], belief.occupancy
    observed = slots != NO_SLOT
    layers = floor_bits(
        driving.assumed.values[rows], driving.clear.values[rows], driving.drops(rows)
    )
    confidences = belief.store.confidences(slots[observed])
    layers[observed] |= observed_bits(confidences, belief.params.explored_variance, robot)
    history = belief.history(robot)
    return ChangedCells(
        revision=belief.revision,
        sequence=history.sequence,
        stamp_ns=history.stamp_ns,
        grid=belief.grid,
        since=since,
        number=belief.changes.number,
        places=belief.tiles.places(),
        rows=rows,
        slots=slots,
        occupancy=driving.states.values[rows],
        layers=layers,
        colours=belief.store.colours[slots[observed]],
    )


def _known_rows(belief: BeliefMap) -> I64:
    known = belief.occupancy.states.values != Occupancy.UNKNOWN
    known |= belief.slots.values != NO_SLOT
    known |= belief.occupancy.assumed.values
    return np.flatnonzero(known)


T = TypeVar("T")

COPIED_CELLS = 4096  # with the lock held: 12 MB of 768 float32 channels; a frame changes 800
ATTEMPTS = 4  # of them, each scores what changed during the one before
NO_LIMITS: F32 = np.zeros(0, np.float32)


@dataclass(frozen=True, slots=True)
class ScoredVersion:
    """A revision of a map with the scores of the texts that were asked for, in their order.

    floor: score of the first text from which it is answered.
    """

    version: MapVersion
    texts: tuple[CellScores, ...] = ()
    floor: float = 0.0


@dataclass(frozen=True, slots=True)
class KnownScores:
    """What an asker holds: scores with these serials, at this change of the map."""

    serials: tuple[int, ...]
    number: int


@dataclass(frozen=True, slots=True)
class ScoredChanges:
    """Changed cells of a map with the scores of the texts that were asked for, in their order.

    serials: see ``ScoreCache.serials``; texts: with a value for each changed cell that is
    observed, in the order of the cells; rank_limits (254,) of the first text's cosines over the
    whole map, (0,) without a text.
    """

    cells: ChangedCells
    serials: tuple[int, ...]
    texts: tuple[CellScores, ...]
    rank_limits: F32


def _limits(found: Sequence[KeptScores], revision: int, negatives: int) -> F32:
    """Limits between the ranks of the first text, with its negatives against it."""
    if not negatives:
        return rank_limits(guiding(found[0]))
    own, *others = (
        CellScores(each.query, revision, each.scores, each.cosines)
        for each in found[: 1 + negatives]
    )
    return rank_limits(guiding(against(own, others)))


class MapScores:
    """Scores of one map. Thread-safe; the map changes only while ``lock`` is held."""

    def __init__(
        self,
        belief: BeliefMap,
        lock: AbstractContextManager[object] | None = None,
        clock: Clock | None = None,
    ) -> None:
        clock = clock or SystemClock()
        self._belief = belief
        self._lock = lock if lock is not None else clock.lock()
        self._turn = clock.lock()  # one asker at a time reads the map
        self._cache = ScoreCache()

    def of(self, queries: Sequence[TextQuery], robot: int = 0) -> ScoredVersion:
        """The newest revision for a robot, with the scores and cosines of the queries."""
        with self._turn:
            version, found = self._scored(queries, BeliefMap.version)
            copied = tuple(kept.copied() for kept in found)
            floor = self._floor(queries[0]) if queries else 0.0
            return ScoredVersion(version.of_robot(robot), copied, floor)

    def _floor(self, query: TextQuery) -> float:
        with self._lock:
            table, revision = self._belief.store.table(), self._belief.revision
        return self._cache.floor(query, table, revision)

    def changes(
        self,
        queries: Sequence[TextQuery],
        known: KnownScores,
        robot: int = 0,
        *,
        negatives: int = 0,
    ) -> ScoredChanges:
        """The cells that changed since a state of the same queries, with scores and cosines.

        All cells if the queries or their embeddings are others, or the map cannot tell.
        negatives: how many of the queries after the first compete with it, for the ranks.
        """

        def changed(belief: BeliefMap) -> ChangedCells:
            same = known.serials == self._cache.serials(queries)
            return changed_cells(belief, known.number if same else None, robot)

        with self._turn:
            cells, found = self._scored(queries, changed)
            slots, revision = cells.slots[cells.slots != NO_SLOT], cells.revision
            return ScoredChanges(
                cells,
                self._cache.serials(queries),
                tuple(
                    CellScores(kept.query, revision, kept.scores[slots], kept.cosines[slots])
                    for kept in found
                ),
                _limits(found, revision, negatives) if found else NO_LIMITS,
            )

    def _scored(
        self, queries: Sequence[TextQuery], part: Callable[[BeliefMap], T]
    ) -> tuple[T, list[KeptScores]]:
        """A part of the newest revision and, valid until the next call, the scores of all of it."""
        for _ in range(ATTEMPTS):
            taken, revision, table = self._begin(queries, part)
            found = self._cache.updated(queries, table, revision)
            if taken is not None:
                return taken, found
        with self._lock:  # the map changes faster than it is read
            belief = self._belief
            return part(belief), self._cache.updated(queries, belief.store, belief.revision)

    def _begin(
        self, queries: Sequence[TextQuery], part: Callable[[BeliefMap], T]
    ) -> tuple[T | None, int, CellFeatures]:
        """The features to read next and their revision, with a part of that if they are one too."""
        with self._lock:
            belief = self._belief
            stale = self._cache.stale(queries, belief.store)
            if len(stale) > COPIED_CELLS:
                return None, belief.revision, belief.store.table()
            return part(belief), belief.revision, belief.store.copied(stale)
