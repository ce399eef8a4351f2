"""A submap: what the frames around one keyframe contributed to the map.

It keeps its cells as they were seen, at the published poses, and is always moved from there: the
errors of several corrections do not add up. A moved cell is that of the submap in which its centre
falls, so a place is off by at most half a cell's diagonal.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import torch

from onemap_mapper.belief_map import BeliefMap
from onemap_mapper.cell_store import FeatureShare
from onemap_mapper.occupancy import I8
from onemap_mapper.submaps.correction import NO_CORRECTION, PlanarCorrection
from onemap_mapper.transfers import to_host
from onemap_shared.geometry import F64, I64, Bool
from onemap_shared.grid import GridSpec


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
        """Bytes of the arrays."""
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
        """Bytes of the arrays."""
        return self.features.nbytes + self.occupancy.nbytes

    def corrected(self, correction: PlanarCorrection) -> Submap:
        """The submap of which the map holds the contribution at another correction."""
        return replace(self, correction=correction)

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
    if correction.is_identity or len(cells) == 0:
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
