"""Writes the map in use to a file, while frames are fused into it.

The features, nearly all of a map, go to the file part by part. So writing takes the memory of one
part, whatever the size of the map, and fusing waits for one part only. Copies of whole maps made
the process keep hundreds of megabytes: what was freed of them stayed with the allocator.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from onemap_mapper.belief.features import CellFeatures
from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.objects import NO_OBJECTS, ObjectMemory
from onemap_mapper.query.regions import Extent, extent_band
from onemap_mapper.query.similarity import NOTHING_KNOWN
from onemap_mapper.storage import map_file
from onemap_mapper.storage.snapshot import MapSnapshot, feature_dtype, outline, take
from onemap_mapper.transfers import to_host
from onemap_shared.geometry import I64


@dataclass(frozen=True, slots=True)
class FeatureCopy:
    """Features (count, D) of all slots of ``belief`` at a revision, in its precision.

    Rows that were half written when they were copied are stale at any later revision.
    """

    belief: BeliefMap | None = None
    revision: int = NOTHING_KNOWN[0]
    features: NDArray = field(default_factory=lambda: np.zeros((0, 0), np.float32))

    def stale(self, belief: BeliefMap) -> I64:
        """Ascending slots (n,) of a map, as it is now, whose features are not in the copy."""
        store = belief.store
        if self.belief is not belief or self.features.shape[1] != store.dimension:
            return np.arange(store.count)
        return store.changed_since(self.revision, len(self.features))

    def updated(
        self, table: CellFeatures, stale: I64, belief: BeliefMap, *, revision: int, dimension: int
    ) -> FeatureCopy:
        """The copy with the features of the stale slots, from a table of that revision of the map.

        Nothing else of the map is read: it may change meanwhile. The array may be the same one.
        """
        features, dtype = self.features, feature_dtype(belief)
        if features.shape != (table.count, dimension) or features.dtype != dtype:
            features = np.zeros((table.count, dimension), dtype)
            if self.features.shape[1] == dimension:
                kept = min(len(self.features), table.count)
                features[:kept] = self.features[:kept]
        for rows, part in table.chunks(stale):
            features[stale[rows]] = to_host(part)
        return FeatureCopy(belief, revision, features)


COPIED_CELLS = 4096  # with the lock held, as ``map_scores`` does
PART = 512  # cells that are copied at a time: 1.5 MB of 768 float32 channels, under 1 ms
ATTEMPTS = 3


class CellsMoved(Exception):
    """The cells of a map changed their slots while it was written, as when submaps move."""


@dataclass(frozen=True, slots=True)
class LiveMap:
    """The map of a mapper. ``current`` gives it; it changes only while ``lock`` is held."""

    lock: AbstractContextManager[object]
    current: Callable[[], BeliefMap]

    def write(
        self,
        path: Path,
        *,
        objects: ObjectMemory = NO_OBJECTS,
        accept: Callable[[int], None] = lambda _nbytes: None,
    ) -> int:
        """Write the file atomically; returns its size in bytes, 0 and no file of an empty map.

        A cell's feature and confidences are of one moment; two cells may be some frames apart.
        If cells change their slots meanwhile, or another map takes the place, it begins again,
        the last time from a copy of the whole. ``accept`` is given about how many bytes it will
        be, and may raise. Raises OSError, MapFileError.
        """
        for _ in range(ATTEMPTS):
            with self.lock:
                belief = self.current()
                content = replace(outline(belief), objects=objects)
            if not content.header.dimension:
                return 0
            accept(content.nbytes)
            try:
                return map_file.write(content, path, self._feature_parts(belief, content))
            except CellsMoved:
                continue
        with self.lock:
            content = take(self.current(), objects)
        return map_file.write(content, path) if content.header.dimension else 0

    def whole(self) -> tuple[MapSnapshot, int]:
        """A copy of one whole revision, and its number; frames are fused meanwhile.

        Features are copied without the lock, while frames write to them. With the lock, all else
        is, and again the features of the cells that have changed meanwhile: few, so that a frame
        waits little. If they are many, as when submaps move, it begins again with those, the last
        time with the lock. Also another map in its place begins it again.
        """
        copy = FeatureCopy()
        for _ in range(ATTEMPTS):
            with self.lock:
                belief = self.current()
                revision, dimension = belief.revision, belief.dimension
                stale = copy.stale(belief)
                few = len(stale) <= COPIED_CELLS
                table = belief.store.copied(stale) if few else belief.store.table()
                content = outline(belief) if few else None
            copy = copy.updated(table, stale, belief, revision=revision, dimension=dimension)
            if content is not None:
                return replace(content, features=copy.features), revision
        with self.lock:
            return take(self.current()), self.current().revision

    def height_m(self, extent_m: Extent) -> tuple[float, ...]:
        """Lowest and highest height, metres, of what lies there; empty: nothing is known of it."""
        with self.lock:
            return extent_band(self.current().shared_version(), extent_m)

    def _feature_parts(self, belief: BeliefMap, content: MapSnapshot) -> Iterator[NDArray]:
        """All features in parts, each valid until the next is asked for.

        Sets the confidences of ``content`` to those of the same moment. There is one buffer for
        all parts, because torch's allocations, which are aligned, leave gaps behind.
        Raises ``CellsMoved`` if the features are not those of the content's cells.
        """
        store, count = belief.store, len(content.cells)
        buffer = np.empty((min(PART, count), belief.dimension), content.features.dtype)
        for first in range(0, count, PART):
            part = slice(first, min(first + PART, count))
            with self.lock:
                if store.count < part.stop:
                    raise CellsMoved
                for rows, features in store.chunks(np.arange(part.start, part.stop)):
                    buffer[rows] = to_host(features)
                confidences = to_host(store.confidences(part))
            copies = (content.confidence, content.searched, content.explored)
            for copy, values in zip(copies, confidences[: len(copies)], strict=True):
                if copy is not None:
                    copy[part] = values
            yield buffer[: part.stop - part.start]
        with self.lock:
            same = np.array_equal(store.cells[:count], content.cells)
            if belief is not self.current() or not same:
                raise CellsMoved
