"""From where every cell of a map was seen best, and when last.

A view is a place of the camera; frames from nearly the same place are one. Cells that were not
seen since the log began, as those of a loaded map, have no view.
"""

from __future__ import annotations

import numpy as np

from onemap_mapper.keyframes import views_since
from onemap_mapper.params import MapParams
from onemap_mapper.tiles import TileLayer
from onemap_shared.geometry import F32, F64, I64

NO_VIEW_YET = -1
FIRST_PRUNING = 4096  # views of a quarter of an hour of driving


class ViewLog:
    """The views of one map; rows are those of its ``TileIndex``."""

    def __init__(self) -> None:
        self._T_map_camera: F64 | None = None  # of the newest view
        self._poses: F64 = np.zeros((0, 3))
        self._best = TileLayer(np.int32, NO_VIEW_YET)
        self._confidence = TileLayer(np.float32, 0)
        self._last_seen_ns = TileLayer(np.int64, 0)
        self._prune_at = FIRST_PRUNING

    @property
    def nbytes(self) -> int:
        """Bytes held: 16 for each cell of a tile, 24 for each view."""
        layers = (self._best, self._confidence, self._last_seen_ns)
        return self._poses.nbytes + sum(layer.nbytes for layer in layers)

    def grow(self, tiles: int) -> None:
        """Make room for this many tiles."""
        for layer in (self._best, self._confidence, self._last_seen_ns):
            layer.grow(tiles)

    def record(
        self, rows: I64, confidence: F32, *, T_map_camera: F64, stamp_ns: int, params: MapParams
    ) -> None:
        """A frame that gave distinct cells, by rows (n,), this confidence (n,)."""
        if self._T_map_camera is None or views_since(self._T_map_camera, T_map_camera, params) > 0:
            self._begin_view(T_map_camera)
        better = confidence > self._confidence.values[rows]
        self._best.values[rows[better]] = len(self._poses) - 1
        self._confidence.values[rows[better]] = confidence[better]
        self._last_seen_ns.values[rows] = stamp_ns

    def last_seen_ns(self, rows: I64) -> int:
        """When any of the cells was last seen; 0: none of them since the log began."""
        return int(self._last_seen_ns.values[rows].max(initial=0))

    def best_view(self, rows: I64) -> F32:
        """x, y, yaw (3,) of the camera in the view that is the best one of most of the cells.

        Metres and radians in the map frame, cells weighted by their confidence; NaN: no view.
        """
        best, confidence = self._best.values[rows], self._confidence.values[rows]
        seen = best != NO_VIEW_YET
        if not seen.any():
            return np.full(3, np.nan, np.float32)
        pose: F32 = self._poses[np.bincount(best[seen], confidence[seen]).argmax()].astype(
            np.float32
        )
        return pose

    def _begin_view(self, T_map_camera: F64) -> None:
        if len(self._poses) >= self._prune_at:
            self._prune()
        (x, y), (ahead_x, ahead_y) = T_map_camera[:2, 3], T_map_camera[:2, 2]
        pose = (x, y, np.arctan2(ahead_y, ahead_x))
        self._poses = np.concatenate([self._poses, [pose]])
        self._T_map_camera = T_map_camera

    def _prune(self) -> None:
        """Forget the views that are the best one of no cell."""
        values = self._best.values
        used = np.unique(values[values != NO_VIEW_YET])
        number = np.full(len(self._poses) + 1, NO_VIEW_YET, np.int32)
        number[used] = np.arange(len(used))
        values[:] = number[values]
        self._poses = self._poses[used]
        self._prune_at = max(FIRST_PRUNING, 2 * len(used))
