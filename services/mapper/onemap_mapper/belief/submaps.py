"""The submaps of one map: they record its frames and follow the corrections of a pose graph.

The map is the sum of what is fixed and of all submaps. Features are confidence-weighted means, so
a submap's share is fused at the corrected pose and taken out at the old one. Evidence of occupancy
is clamped and no sum: the cells that a move touches are computed again, from what is fixed and
from all submaps in the order of time.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import cos, radians, sin

import numpy as np
import torch

from onemap_mapper.belief.cells import FeatureShare
from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.belief.tiles import TileLayer
from onemap_mapper.belief.version import FrameHistory
from onemap_mapper.frame.update import FrameUpdate
from onemap_mapper.occupancy.evidence import I8, accumulated_evidence
from onemap_mapper.transfers import to_host
from onemap_shared.geometry import F64, I64, Bool, inverse, wrap_angle, yaw_of
from onemap_shared.grid import GridSpec
from onemap_shared.messages import PoseGraph


@dataclass(frozen=True, slots=True)
class PlanarCorrection:
    """The rigid motion p -> R(yaw) p + t of the map's plane, in radians and metres."""

    yaw_rad: float = 0.0
    x_m: float = 0.0
    y_m: float = 0.0

    @classmethod
    def about(cls, centre_m: F64, *, to_m: F64, yaw_rad: float) -> PlanarCorrection:
        """The motion that takes centre_m (2,) to to_m (2,) and turns by ``yaw_rad``."""
        x_m, y_m = to_m - centre_m @ _rotation(yaw_rad).T
        return cls(yaw_rad, float(x_m), float(y_m))

    def apply(self, points_m: F64) -> F64:
        """Where points (n, 2) lie after the correction."""
        moved: F64 = points_m @ _rotation(self.yaw_rad).T + (self.x_m, self.y_m)
        return moved

    def undo(self, points_m: F64) -> F64:
        """Where points (n, 2) lay before the correction."""
        original: F64 = (points_m - (self.x_m, self.y_m)) @ _rotation(self.yaw_rad)
        return original


NO_CORRECTION = PlanarCorrection()


def correction_at(graph: PoseGraph, stamp_ns: int, centre_m: F64) -> PlanarCorrection:
    """The correction of what was seen at a time from centre_m (2,), as published.

    Between two keyframes the correction, not the pose, is interpolated: it changes slowly.
    Before the first and after the last keyframe theirs holds; poses that were published after the
    graph's stamp are right.
    """
    stamps = graph.keyframe_stamps_ns
    if len(stamps) == 0 or stamp_ns > graph.stamp_ns:
        return NO_CORRECTION
    since_ns = np.clip(stamp_ns, stamps[0], stamps[-1]) - stamps[0]  # floats hold no stamps
    place = float(np.interp(since_ns, stamps - stamps[0], np.arange(len(stamps))))
    first, share = int(place), place % 1.0
    before = _keyframe_correction(graph, first, centre_m)
    after = _keyframe_correction(graph, min(first + 1, len(stamps) - 1), centre_m)
    yaw_rad = before[2] + share * wrap_angle(after[2] - before[2])
    to_m = before[:2] + share * (after[:2] - before[:2])
    return PlanarCorrection.about(centre_m, to_m=to_m, yaw_rad=float(yaw_rad))


def _keyframe_correction(graph: PoseGraph, index: int, centre_m: F64) -> F64:
    """x, y (metres) to which one keyframe's correction takes a point (2,), and its yaw."""
    T = graph.T_map_body[index] @ inverse(graph.T_map_body_published[index])
    moved = T[:2, :2] @ centre_m + T[:2, 3]
    return np.array([*moved, yaw_of(T)])


def _rotation(yaw_rad: float) -> F64:
    c, s = cos(yaw_rad), sin(yaw_rad)
    return np.array([[c, -s], [s, c]])


@dataclass(frozen=True, slots=True)
class OccupancyShare:
    """Evidence of some frames, on the host.

    cells (n, 2) int64 distinct world cells; evidence (n, levels + 1) int8 within its bounds; clear
    (n,) bool: floor was seen.
    """

    cells: I64
    evidence: I8
    clear: Bool

    @property
    def nbytes(self) -> int:
        return self.cells.nbytes + self.evidence.nbytes + self.clear.nbytes


@dataclass(frozen=True, slots=True)
class Submap:
    """The contribution of the frames from a keyframe up to the next.

    stamp_ns and centre_m (2,): time and camera position of the keyframe, as published;
    features and occupancy: as seen; correction: with which they are in the map now.
    """

    stamp_ns: int
    centre_m: F64
    features: FeatureShare
    occupancy: OccupancyShare
    correction: PlanarCorrection = NO_CORRECTION

    @property
    def nbytes(self) -> int:
        return self.features.nbytes + self.occupancy.nbytes

    def without_searched(self) -> Submap:
        """The submap after sigma_E was reset."""
        zero = torch.zeros_like(self.features.searched)
        return replace(self, features=replace(self.features, searched=zero))

    def moved_features(self, cell_size_m: float) -> FeatureShare:
        """What of the features is in the map now."""
        cells, source = moved_cells(self.features.cells, self.correction, cell_size_m)
        return replace(self.features.only(source), cells=cells)

    def moved_occupancy(self, cell_size_m: float) -> OccupancyShare:
        """What of the occupancy is in the map now."""
        seen = self.occupancy
        cells, source = moved_cells(seen.cells, self.correction, cell_size_m)
        return OccupancyShare(cells, seen.evidence[source], seen.clear[source])

    def displacement_m(self, correction: PlanarCorrection, cell_size_m: float) -> float:
        """How far any corner of the submap would move from where the map has it."""
        cells = self.occupancy.cells if len(self.occupancy.cells) else self.features.cells
        if len(cells) == 0:
            return 0.0
        (low_x, low_y), (high_x, high_y) = cells.min(axis=0), cells.max(axis=0) + 1
        corners = np.array([(low_x, low_y), (low_x, high_y), (high_x, low_y), (high_x, high_y)])
        corners = corners * cell_size_m
        steps = correction.apply(corners) - self.correction.apply(corners)
        return float(np.linalg.norm(steps, axis=1).max())


def submap_of(content: BeliefMap, stamp_ns: int, centre_m: F64, dtype: torch.dtype) -> Submap:
    """The submap with the content of a map of its frames; features are kept in ``dtype``."""
    share = content.store.share(dtype)
    return Submap(stamp_ns, centre_m, share, occupancy_of(content))


def occupancy_of(content: BeliefMap) -> OccupancyShare:
    """A copy of all evidence that a map holds."""
    rows = content.occupancy.known_rows
    evidence, clear = (
        to_host(content.occupancy.evidence.values[rows]),
        to_host(content.occupancy.clear.values[rows]),
    )
    return OccupancyShare(content.tiles.cells(to_host(rows)), evidence, clear)


def moved_cells(cells: I64, correction: PlanarCorrection, cell_size_m: float) -> tuple[I64, I64]:
    """World cells (m, 2) that distinct cells (n, 2) fill after a correction; and which of those
    (m,) each one's content is from.

    Every cell takes the content of the one in which its centre lay, so there are no holes.
    """
    if correction == NO_CORRECTION or len(cells) == 0:
        return cells, np.arange(len(cells))
    low, high = cells.min(axis=0), cells.max(axis=0)
    shape = high - low + 1
    index = np.full(tuple(shape), -1, np.int64)
    index[tuple((cells - low).T)] = np.arange(len(cells))
    before = GridSpec(cell_size_m, (int(low[0]), int(low[1])), (int(shape[0]), int(shape[1])))
    corners = before.centres(np.array([(i, j) for i in (-1, shape[0]) for j in (-1, shape[1])]))
    moved = correction.apply(corners)
    (low_x, low_y), (high_x, high_y) = moved.min(axis=0), moved.max(axis=0)
    after = GridSpec.covering(cell_size_m, (low_x, low_y), (high_x, high_y))
    wanted = np.argwhere(np.ones(after.shape, bool))
    place = before.cells(correction.undo(after.centres(wanted)))
    inside = before.contains(place)
    source = index[tuple(place[inside].T)]
    filled: I64 = (wanted[inside] + np.asarray(after.origin_cell))[source >= 0]
    return filled, source[source >= 0]


@dataclass(frozen=True, kw_only=True)
class SubmapParams:
    """When a submap ends, and how many can still be moved."""

    # Way after which the next begins, metres. A submap is rigid: at an odometry error of 2 % its
    # ends are 2 cm off, less than half a cell. Shorter ones need more memory for the same rooms.
    distance_m: float = 1.0
    turn_deg: float = 45.0  # that the camera turns from the first frame: half a camera's view
    # Some 500 m of way. The oldest become fixed first: their poses were corrected most often, and
    # SLAM holds on to where it began.
    count: int = 500
    # Beyond it the oldest become fixed too. A submap of an apartment takes 0.3 MB with 64 channels
    # and 2.4 MB with 768, in float16.
    memory_mb: int = 256


MIN_MOVE_CELLS = 0.2  # a smaller correction moves few cells, by one, and is not worth the time
STORED = torch.float16  # of features: half the memory; the map then holds the rounded share too


@dataclass(slots=True)
class _Active:
    """The submap that frames are being added to, as a map of its own."""

    content: BeliefMap
    stamp_ns: int
    T_map_camera: F64


@dataclass(frozen=True, slots=True)
class _Placed:
    """A submap with its evidence as it lies in the map, by rows (n,) of the map's tiles."""

    submap: Submap
    rows: I64
    evidence: I8
    clear: Bool


class SubmapStore:
    """The movable parts of a map, oldest first; bounded in number and memory.

    What the map holds at the start is fixed; of what follows no view fades, as with
    ``max_prior_confidence``, because faded views could not be taken out again. Not thread-safe:
    the caller holds the map's lock. Submaps, and what is fixed of the occupancy, are on the host:
    they are read when a correction comes, not with each frame.
    """

    def __init__(self, belief: BeliefMap, params: SubmapParams | None = None) -> None:
        self._belief, self._params = belief, params or SubmapParams()
        belief.keep_every_view()
        self._closed: list[_Placed] = []
        self._active: _Active | None = None
        self._graph: PoseGraph | None = None
        self._checked = 0  # closed submaps that lie where the graph says
        self._fixed_evidence = TileLayer(torch.int8, 0, (belief.params.levels + 1,))
        self._fixed_clear = TileLayer(torch.bool, 0)
        self._grow()
        self._fixed_evidence.values[:] = belief.occupancy.evidence.values.cpu()
        self._fixed_clear.values[:] = belief.occupancy.clear.values.cpu()
        self.fixed = 0  # submaps that can no longer be moved

    @property
    def count(self) -> int:
        """Submaps that can be moved, with the one that is being made."""
        return len(self._closed) + (self._active is not None)

    @property
    def nbytes(self) -> int:
        return sum(each.submap.nbytes + each.evidence.nbytes for each in self._closed)

    def add(self, update: FrameUpdate) -> None:
        """Record a frame that was just fused into the map."""
        if self._active is None or self._ends_with(update):
            self.close()
            content = BeliefMap(self._belief.params)
            content.keep_every_view()
            start_m = self._belief.history().start_m
            first = start_m is not None and np.array_equal(start_m, update.camera_m)
            if not first:  # the first frame frees where it stands
                content.histories[0] = FrameHistory(start_m=start_m)
            self._active = _Active(content, update.stamp_ns, update.T_map_camera)
        self._active.content.fuse(update, self._belief.newest_views)

    def close(self) -> None:
        """End the current submap, so that the next frame begins another; fix what is too much."""
        if self._active is None:
            return
        active, self._active = self._active, None
        centre_m = active.T_map_camera[:2, 3].copy()
        exact = submap_of(active.content, active.stamp_ns, centre_m, torch.float32)
        stored = submap_of(active.content, active.stamp_ns, centre_m, STORED)
        self._belief.put_in(stored.features)
        self._belief.take_out(exact.features)
        self._closed.append(self._placed(stored))
        limit = self._params.memory_mb * 10**6
        while len(self._closed) > self._params.count or (
            self.nbytes > limit and len(self._closed) > 1
        ):
            self._fix_oldest()

    def follow(self, graph: PoseGraph) -> None:
        """Correct the map by this graph from now on; ``move_next`` does it."""
        self._graph, self._checked = graph, 0

    def move_next(self) -> bool:
        """Move the first submap that does not lie where the graph says; False if all do.

        Raises ``MapTooLarge`` before any change if it would leave the largest map.
        """
        if self._graph is None:
            return False
        if self._active is not None and self._active.stamp_ns <= self._graph.stamp_ns:
            self.close()
        size_m = self._belief.params.cell_size_m
        while self._checked < len(self._closed):
            index, submap = self._checked, self._closed[self._checked].submap
            self._checked += 1
            target = correction_at(self._graph, submap.stamp_ns, submap.centre_m)
            if submap.displacement_m(target, size_m) > MIN_MOVE_CELLS * size_m:
                self._move(index, target)
                return True
        return False

    def reset_searched(self) -> None:
        """Reset sigma_E of all submaps, as the map's was."""
        self._closed = [
            replace(each, submap=each.submap.without_searched()) for each in self._closed
        ]
        if self._active is not None:
            self._active.content.reset_searched()

    def _ends_with(self, update: FrameUpdate) -> bool:
        """Whether a frame belongs to the next submap: far from the keyframe, or corrected."""
        assert self._active is not None
        T = self._active.T_map_camera
        moved_m = float(np.linalg.norm(update.camera_m - T[:3, 3]))
        cosine = float(update.T_map_camera[:3, 2] @ T[:3, 2])  # of the optical axes
        turned = cosine < np.cos(radians(self._params.turn_deg))
        return moved_m > self._params.distance_m or turned or self._jumps(update.stamp_ns)

    def _jumps(self, stamp_ns: int) -> bool:
        """Whether the poses were corrected between the current submap and this time."""
        if self._graph is None or self._active is None:
            return False
        limit_ns = self._graph.stamp_ns
        return (self._active.stamp_ns <= limit_ns) != (stamp_ns <= limit_ns)

    def _move(self, index: int, target: PlanarCorrection) -> None:
        """Put a share in at the target first, then take it out: no cell is empty in between."""
        size_m = self._belief.params.cell_size_m
        old = self._closed[index]
        new = replace(old.submap, correction=target)
        self._belief.grow(new.moved_occupancy(size_m).cells)
        self._belief.put_in(new.moved_features(size_m))
        self._belief.take_out(old.submap.moved_features(size_m))
        self._closed[index] = self._placed(new)
        self._recompute(np.union1d(old.rows, self._closed[index].rows))

    def _placed(self, submap: Submap) -> _Placed:
        share = submap.moved_occupancy(self._belief.params.cell_size_m)
        rows = self._belief.tiles.rows(share.cells)
        return _Placed(submap, rows, share.evidence, share.clear)

    def _recompute(self, rows: I64) -> None:
        """Set the map's occupancy of distinct rows (n,) from all that contributes to them."""
        self._grow()
        evidence, clear = self._fixed_evidence.values[rows], self._fixed_clear.values[rows]
        place = np.full(len(self._fixed_clear.values), -1, np.int32)
        place[rows] = np.arange(len(rows))
        for part_rows, added, cleared in self._parts():
            where = place[part_rows]
            chosen = where >= 0
            where = where[chosen]
            more = torch.from_numpy(added[chosen])
            evidence[where] = accumulated_evidence(evidence[where], more)
            clear[where] |= torch.from_numpy(cleared[chosen])
        self._belief.set_occupancy(rows, evidence, clear)

    def _parts(self) -> list[tuple[I64, I8, Bool]]:
        parts = [(each.rows, each.evidence, each.clear) for each in self._closed]
        if self._active is not None:
            share = occupancy_of(self._active.content)
            parts.append((self._belief.tiles.rows(share.cells), share.evidence, share.clear))
        return parts

    def _fix_oldest(self) -> None:
        oldest = self._closed.pop(0)
        self._checked = max(0, self._checked - 1)
        self._grow()
        values = self._fixed_evidence.values
        evidence, clear = torch.from_numpy(oldest.evidence), torch.from_numpy(oldest.clear)
        values[oldest.rows] = accumulated_evidence(values[oldest.rows], evidence)
        self._fixed_clear.values[oldest.rows] |= clear
        self.fixed += 1

    def _grow(self) -> None:
        for layer in (self._fixed_evidence, self._fixed_clear):
            layer.grow(self._belief.tiles.count)
