"""Writes the map in use to a file, while frames are fused into it.

The features, nearly all of a map, go to the file part by part. So writing takes the memory of one
part, whatever the size of the map, and fusing waits for one part only. Copies of whole maps made
the process keep hundreds of megabytes: what was freed of them stayed with the allocator.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.objects import NO_OBJECTS, ObjectMemory
from onemap_mapper.query.regions import Extent, extent_band
from onemap_mapper.storage import map_file
from onemap_mapper.storage.snapshot import MapSnapshot, outline, take
from onemap_mapper.transfers import to_host

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
        """A copy of one whole revision, and its number; frames wait for it."""
        with self.lock:
            belief = self.current()
            return take(belief), belief.revision

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
