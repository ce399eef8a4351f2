"""How much a frame counts, from where every cell was seen best, and when last.

Keyframes: were every frame counted for what was explored and searched, a place would be explored
four times as fast at 8 Hz as at 2 Hz, from the same views, and by a robot that merely stands there.
Features are fused from every frame all the same: their noise averages out.

A view is a place of the camera; frames from nearly the same place are one. Cells that were not seen
since the log began, as those of a map of an old file, have no view.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass

import numpy as np

from onemap_mapper.belief.tiles import TileLayer
from onemap_shared.geometry import F32, F64, I32, I64
from onemap_shared.jit import compiled

# How far the camera has to move or turn before another frame counts for explored and searched: a
# cell, and a sixteenth of its view. Less shows nothing new.
KEYFRAME_M, KEYFRAME_DEG = 0.1, 5.0
STEPS_PER_VIEW = 2.0  # keyframe steps, 0.2 m or 10 degrees, count as one frame: the way at 4 Hz
MAX_VIEWS = 3.0  # that one frame counts for: after 0.6 m or 30 degrees it shows other cells


@dataclass(frozen=True, slots=True)
class Views:
    """How many views a frame counts for, >= 0: for searched by its robot, and for explored."""

    searched: float
    explored: float
    robot: int = 0


ONE_VIEW, NO_VIEW = Views(1.0, 1.0), Views(0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Keyframes:
    """T_map_camera (4, 4) of the last keyframe since the search began and of the map."""

    searched: F64 | None = None
    explored: F64 | None = None

    def views(self, T_map_camera: F64) -> Views:
        """What a frame from this pose counts for."""
        searched = views_since(self.searched, T_map_camera)
        return Views(searched, views_since(self.explored, T_map_camera))

    def with_frame(self, T_map_camera: F64, views: Views) -> Keyframes:
        """The last keyframes after a frame that counted for so many views."""
        return Keyframes(
            T_map_camera if views.searched > 0 else self.searched,
            T_map_camera if views.explored > 0 else self.explored,
        )

    def of_new_search(self) -> Keyframes:
        """What is in view when a search begins was not searched yet, but explored."""
        return Keyframes(None, self.explored)


def views_since(last: F64 | None, T_map_camera: F64) -> float:
    """How many views a frame counts for; 0 if it is no keyframe, 1 for the first one.

    last: T_map_camera (4, 4) of the last keyframe. It counts in proportion to the way and the
    rotation since then, so that the sum depends on where the camera was and not on the rate.
    """
    if last is None:
        return 1.0
    moved_m = float(np.linalg.norm(T_map_camera[:3, 3] - last[:3, 3]))
    cosine = 0.5 * (float(np.trace(last[:3, :3].T @ T_map_camera[:3, :3])) - 1.0)
    turned_deg = float(np.degrees(np.arccos(min(max(cosine, -1.0), 1.0))))
    steps = max(moved_m / KEYFRAME_M, turned_deg / KEYFRAME_DEG)
    return min(steps / STEPS_PER_VIEW, MAX_VIEWS) if steps >= 1.0 else 0.0


NO_VIEW_YET = -1
FIRST_PRUNING = 4096  # views of a quarter of an hour of driving


@compiled
def record_view(
    log: tuple[I32, F32, I64], rows: I64, confidence: F32, view: int, stamp_ns: int
) -> None:
    """Write a frame of a view to rows (n,) of a log: best views, their confidences, last seen."""
    best, highest, last_seen_ns = log
    for k in range(len(rows)):
        row = rows[k]
        if confidence[k] > highest[row]:
            best[row], highest[row] = view, confidence[k]
        last_seen_ns[row] = stamp_ns


@dataclass(frozen=True, slots=True)
class SeenFrom:
    """What a log says of some cells (n,), detached from it.

    poses (k, 3) float64: x, y, yaw of the camera in each view; best (n,) int32: index of the best
    one, -1 = none; confidence (n,) float32: in that view; last_seen_ns (n,) int64: 0 = never.
    """

    poses: F64
    best: I32
    confidence: F32
    last_seen_ns: I64

    @property
    def nbytes(self) -> int:
        cells = self.best.nbytes + self.confidence.nbytes + self.last_seen_ns.nbytes
        return self.poses.nbytes + cells

    def of(self, index: I64) -> SeenFrom:
        """What it says of some of its cells, by index (m,)."""
        best, confidence = self.best[index], self.confidence[index]
        return SeenFrom(self.poses, best, confidence, self.last_seen_ns[index])


class ViewLog:
    """The views of one map; rows are those of its ``TileIndex``."""

    def __init__(self) -> None:
        self._newest: dict[int, tuple[int, F64]] = {}  # a robot's view: its index, T_map_camera
        self._poses: F64 = np.zeros((0, 3))
        self._best = TileLayer(np.int32, NO_VIEW_YET)
        self._confidence = TileLayer(np.float32, 0)
        self._last_seen_ns = TileLayer(np.int64, 0)
        self._prune_at = FIRST_PRUNING

    def copy(self) -> ViewLog:
        """A log that does not change with this one."""
        made = copy(self)
        made._newest = self._newest.copy()
        made._best, made._confidence = self._best.copy(), self._confidence.copy()
        made._last_seen_ns = self._last_seen_ns.copy()
        return made

    @property
    def nbytes(self) -> int:
        layers = (self._best, self._confidence, self._last_seen_ns)
        return self._poses.nbytes + sum(layer.nbytes for layer in layers)

    def grow(self, tiles: int) -> None:
        """Make room for this many tiles."""
        for layer in (self._best, self._confidence, self._last_seen_ns):
            layer.grow(tiles)

    def record(
        self, rows: I64, confidence: F32, *, T_map_camera: F64, stamp_ns: int, robot: int = 0
    ) -> None:
        """A robot's frame that gave distinct cells, by rows (n,), this confidence (n,)."""
        newest = self._newest.get(robot)
        if newest is None or views_since(newest[1], T_map_camera) > 0:
            newest = self._newest[robot] = self._begin_view(T_map_camera)
        log = self._best.values, self._confidence.values, self._last_seen_ns.values
        record_view(log, rows, confidence, newest[0], stamp_ns)

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

    def taken(self, rows: I64) -> SeenFrom:
        """A copy of what is known of distinct cells, by rows (n,), with the views that it names."""
        used, number = np.unique(self._best.values[rows], return_inverse=True)
        none = int((used == NO_VIEW_YET).any())  # the first of them, if there is any
        return SeenFrom(
            self._poses[used[none:]],
            (number - none).astype(np.int32),
            self._confidence.values[rows],
            self._last_seen_ns.values[rows],
        )

    def put_in(self, rows: I64, seen: SeenFrom) -> None:
        """Add what another log says of distinct cells, by rows (n,); the better view is kept."""
        before = self._confidence.values[rows]
        better = (seen.best != NO_VIEW_YET) & (seen.confidence > before)
        views = np.where(better, seen.best + len(self._poses), self._best.values[rows])
        self._best.values[rows] = views
        self._confidence.values[rows] = np.where(better, seen.confidence, before)
        newest = np.maximum(self._last_seen_ns.values[rows], seen.last_seen_ns)
        self._last_seen_ns.values[rows] = newest
        self._poses = np.concatenate([self._poses, seen.poses])
        self._newest = {}  # the next frame begins a view

    def _begin_view(self, T_map_camera: F64) -> tuple[int, F64]:
        if len(self._poses) >= self._prune_at:
            self._prune()
        (x, y), (ahead_x, ahead_y) = T_map_camera[:2, 3], T_map_camera[:2, 2]
        pose = (x, y, np.arctan2(ahead_y, ahead_x))
        self._poses = np.concatenate([self._poses, [pose]])
        return len(self._poses) - 1, T_map_camera

    def _prune(self) -> None:
        values = self._best.values
        used = np.unique(values[values != NO_VIEW_YET])
        number = np.full(len(self._poses) + 1, NO_VIEW_YET, np.int32)
        number[used] = np.arange(len(used))
        values[:] = number[values]
        self._poses, self._newest = self._poses[used], {}
        self._prune_at = max(FIRST_PRUNING, 2 * len(used))
