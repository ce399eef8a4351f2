"""The submaps of one map: they record its frames and follow the corrections of a pose graph.

The map is the sum of what is fixed and of all submaps. Features are confidence-weighted means, so
a submap's share is fused at the corrected pose and taken out at the old one. Evidence of occupancy
is clamped and no sum: the cells that a move touches are computed again, from what is fixed and
from all submaps in the order of time.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import radians

import numpy as np
import torch

from onemap_mapper.belief_map import BeliefMap
from onemap_mapper.frame_history import FrameHistory
from onemap_mapper.frame_update import FrameUpdate
from onemap_mapper.occupancy import I8, accumulated_evidence
from onemap_mapper.params import SubmapParams
from onemap_mapper.submaps.correction import PlanarCorrection, correction_at
from onemap_mapper.submaps.submap import OccupancyShare, Submap, occupancy_of, submap_of
from onemap_mapper.tiles import TileLayer
from onemap_shared.geometry import F64, I64, Bool
from onemap_shared.messages import PoseGraph

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

    def __init__(self, belief: BeliefMap, params: SubmapParams) -> None:
        self._belief, self._params = belief, params
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
        """Bytes of the closed submaps."""
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
        limit = self._params.submap_memory_mb * 10**6
        while len(self._closed) > self._params.max_submaps or (
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
            _Placed(each.submap.without_searched(), each.rows, each.evidence, each.clear)
            for each in self._closed
        ]
        if self._active is not None:
            self._active.content.reset_searched()

    def _ends_with(self, update: FrameUpdate) -> bool:
        """Whether a frame belongs to the next submap: far from the keyframe, or corrected."""
        assert self._active is not None
        T = self._active.T_map_camera
        moved_m = float(np.linalg.norm(update.camera_m - T[:3, 3]))
        cosine = float(update.T_map_camera[:3, 2] @ T[:3, 2])  # of the optical axes
        turned = cosine < np.cos(radians(self._params.submap_turn_deg))
        return moved_m > self._params.submap_distance_m or turned or self._jumps(update.stamp_ns)

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
        new = old.submap.corrected(target)
        self._belief.grow(new.moved_occupancy(size_m).cells)
        self._belief.put_in(new.moved_features(size_m))
        self._belief.take_out(old.submap.moved_features(size_m))
        self._closed[index] = self._placed(new)
        self._recompute(np.union1d(old.rows, self._closed[index].rows))

    def _placed(self, submap: Submap) -> _Placed:
        share = submap.moved_occupancy(self._belief.params.cell_size_m)
        return self._at_rows(submap, share)

    def _at_rows(self, submap: Submap, share: OccupancyShare) -> _Placed:
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
        """Rows, evidence and clear of every submap, oldest first."""
        parts = [(each.rows, each.evidence, each.clear) for each in self._closed]
        if self._active is not None:
            share = occupancy_of(self._active.content)
            parts.append((self._belief.tiles.rows(share.cells), share.evidence, share.clear))
        return parts

    def _fix_oldest(self) -> None:
        """Make the oldest submap a part of what is fixed, where it lies now."""
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
