"""Occupancy from depth: free, occupied and unknown cells.

Each cell is a column of voxels over the heights of the robot's body. A point is evidence for its
voxel; a ray that passes through a voxel and ends behind it is evidence against it. So a ray over a
coffee table does not clear the table, and the floor seen under a table does not either. One more
voxel lies below the floor: a drop fills it, floor that is seen empties it. A cell is free once its
floor was seen and no voxel of its column is occupied; a ray that passes just above a cell does not
show that there is floor.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from onemap_mapper.belief.tiles import TileLayer
from onemap_mapper.params import MapParams
from onemap_shared.geometry import F64, I32, I64, U8, Bool
from onemap_shared.grid import GridSpec
from onemap_shared.jit import compiled
from onemap_shared.messages import Occupancy

I8 = NDArray[np.int8]

# Evidence is a log-odds in steps of about 0.4, an int8 per voxel.
HIT = 4  # MIN_HITS points or more: an unobserved voxel becomes occupied at once
SINGLE_HIT = 2  # one point: a far leg or table edge, or noise, so two frames are needed
LOW_HIT = 2  # too high for floor, too low for an obstacle: the edge of a tray, or a tilted floor
DROP_HIT = 2  # a drop needs two frames: an error of the pitch lowers all floor of one frame
MISS = 1  # four frames erase what was hit in one frame, twelve what was hit in many
MAX_EVIDENCE = 12  # bounded, so that a removed obstacle disappears within twelve frames
MIN_EVIDENCE = -4  # and a new one appears within two
OCCUPIED_THRESHOLD = 3
SETTLED_EVIDENCE = 10  # three frames of an unobserved cell, four of a free one: no passer-by
MIN_HITS = 2
# Levels with a HIT of one frame from which on a cell looks occupied until it is seen through,
# whatever its evidence: somebody who walks is in other cells in each frame.
UPRIGHT_LEVELS = 3
UNKNOWN, FREE, OCCUPIED = (np.uint8(each) for each in Occupancy)


class OccupancyUpdate(NamedTuple):
    """The evidence of one frame, per cell.

    cells (n, 2) int64 world cells; evidence (n, levels + 1) int8 to add, the last for the voxel
    below the floor; clear (n,) bool: the floor was seen; blind (n,) bool: the cell lies between
    the camera and the nearest floor in view.
    """

    cells: I64
    evidence: I8
    clear: Bool
    blind: Bool


def cells_within(centre_m: F64, radius_m: float, cell_size_m: float) -> I64:
    """World cells (n, 2) whose centre lies within ``radius_m`` of a point (x, y, ...)."""
    x, y = float(centre_m[0]), float(centre_m[1])
    box = GridSpec.covering(cell_size_m, (x - radius_m, y - radius_m), (x + radius_m, y + radius_m))
    cells = np.argwhere(np.ones(box.shape, bool))
    inside = np.linalg.norm(box.centres(cells) - (x, y), axis=1) <= radius_m
    chosen: I64 = cells[inside] + np.asarray(box.origin_cell)
    return chosen


Layers = tuple[I8, Bool, Bool, U8]  # evidence (rows, levels + 1), clear, assumed, states (rows,)


@compiled
def _add_to_column(evidence: I8, added: I8) -> tuple[bool, int, bool]:
    """Add to the evidence (levels + 1,) of a cell, within MIN_EVIDENCE and MAX_EVIDENCE.

    A camera does not see the floor at its feet: when somebody who stood there has gone, its rays
    pass through the upper voxels only. So in a column that no point lies in, voxels with evidence
    that no ray met lose as much as those with evidence above them that were seen through. A chair
    before which the camera looks over the seat loses none, because nothing stood above it. The last
    voxel, below the floor, is no part of that.

    Returns whether it looks occupied, the highest after, and whether an obstacle went that no ray
    went through: the lower part of somebody who has gone, or of a chest that they stood beside.
    """
    below_floor = len(evidence) - 1
    hit, upright = False, 0
    for level in range(below_floor):
        hit |= added[level] > 0
        upright += added[level] >= HIT
    highest, lost, gone = MIN_EVIDENCE, 0, False
    for level in range(below_floor, -1, -1):
        before, more = np.int64(evidence[level]), np.int64(added[level])
        if level < below_floor and before > 0:
            if more < 0:
                lost = min(lost, more)
            elif more == 0 and not hit:
                more = lost
                gone |= before >= OCCUPIED_THRESHOLD > before + more
        total = min(max(before + more, MIN_EVIDENCE), MAX_EVIDENCE)
        evidence[level] = total
        highest = max(highest, total)
    return highest >= OCCUPIED_THRESHOLD or upright >= UPRIGHT_LEVELS, highest, gone


@compiled
def add_evidence(
    layers: Layers, settled: U8, rows: I64, added: I8, cleared: Bool
) -> tuple[Bool, Bool]:
    """Add a frame's evidence.

    settled (rows,): of the states, what lasted. A cell is free as soon as its state is; what stands
    in it is taken for lasting once its evidence has grown to ``SETTLED_EVIDENCE``: somebody who
    walks by leaves sooner. Of the frame: distinct rows (n,), what is added (n, levels + 1) and
    cleared (n,). Returns (n,) twice: which rows look different now, and in which something stands
    that did not, or the other way round.
    """
    evidence, clear, assumed, occupancy = layers
    different, changed = np.empty(len(rows), np.bool_), np.empty(len(rows), np.bool_)
    for k in range(len(rows)):
        row = rows[k]
        had_drop = evidence[row, -1] >= OCCUPIED_THRESHOLD
        occupied, highest, gone = _add_to_column(evidence[row], added[k])
        drops = (evidence[row, -1] >= OCCUPIED_THRESHOLD) != had_drop
        newly_clear = cleared[k] & (not clear[row])
        clear[row] |= cleared[k]
        now_assumed = (assumed[row] | (gone & clear[row])) & (not cleared[k])
        state = FREE if clear[row] else UNKNOWN
        state = OCCUPIED if occupied else state
        different[k] = (state != occupancy[row]) | (now_assumed != assumed[row]) | newly_clear
        different[k] |= drops
        assumed[row], occupancy[row] = now_assumed, state
        before = settled[row]
        after = FREE if state == FREE else before
        after = OCCUPIED if highest >= SETTLED_EVIDENCE else after
        settled[row] = after
        changed[k] = (before != UNKNOWN) & (after != before)
    return different, changed


@compiled
def assume_floor(layers: Layers, rows: I64) -> Bool:
    """Take floor for free that no camera saw, rows (n,); returns which look different now (n,).

    A row may come twice.
    """
    evidence, clear, assumed, occupancy = layers
    different = np.empty(len(rows), np.bool_)
    for k in range(len(rows)):
        row = rows[k]
        highest = np.int64(MIN_EVIDENCE)
        for level in range(evidence.shape[1]):
            highest = max(highest, np.int64(evidence[row, level]))
        state = OCCUPIED if highest >= OCCUPIED_THRESHOLD else FREE
        now_assumed = assumed[row] | (not clear[row])
        different[k] = (state != occupancy[row]) | (now_assumed != assumed[row])
        assumed[row], clear[row], occupancy[row] = now_assumed, True, state
    return different


Counts = tuple[I32, I32, I32, I32]  # (nx, ny) each: low points, drops, floor, blind


@compiled
def evidence_of(
    voxels: tuple[I32, Bool], counts: Counts, near: Bool, origin: tuple[int, int]
) -> tuple[I64, NDArray[np.int8], Bool, Bool]:
    """Cells (n, 2), evidence (n, levels + 1), clear and blind (n,) of ``OccupancyUpdate``.

    voxels: points in each voxel (nx, ny, levels), and whether a ray crosses it; origin: world cell
    of voxel [0, 0]. Floor that is seen beside a drop does not show that none is missing, nor does
    floor that is not near (nx, ny), where the camera may miss a drop.
    """
    (hits, crossed), (low, drops, seen, blind) = voxels, counts
    nx, ny, levels = hits.shape
    cells = np.empty((nx * ny, 2), np.int64)
    evidence = np.empty((nx * ny, levels + 1), np.int8)
    clear, hidden = np.empty(nx * ny, np.bool_), np.empty(nx * ny, np.bool_)
    filled = 0
    for i in range(nx):
        for j in range(ny):
            floor = seen[i, j] > 0
            touched = floor | (blind[i, j] > 0)
            row = evidence[filled]
            for level in range(levels):
                value = -MISS if crossed[i, j, level] else np.int64(0)
                value = SINGLE_HIT if hits[i, j, level] > 0 else value
                value = HIT if hits[i, j, level] >= MIN_HITS else value
                if level == 0 and low[i, j] >= MIN_HITS and value < LOW_HIT:
                    value = LOW_HIT
                row[level] = value
                touched |= value != 0
            beside_drop = False
            for x in range(max(i - 1, 0), min(i + 2, nx)):
                for y in range(max(j - 1, 0), min(j + 2, ny)):
                    beside_drop |= drops[x, y] >= MIN_HITS
            value = -MISS if floor and near[i, j] and not beside_drop else np.int64(0)
            value = DROP_HIT if drops[i, j] >= MIN_HITS else value
            row[levels] = value
            if touched | (value != 0):
                cells[filled, 0], cells[filled, 1] = i + origin[0], j + origin[1]
                clear[filled], hidden[filled] = floor, blind[i, j] > 0
                filled += 1
    return cells[:filled], evidence[:filled], clear[:filled], hidden[:filled]


class OccupancyLayers:
    """Layers of one map, by rows of its tiles; what changes them names the rows.

    evidence (rows, levels + 1) int8 and clear (rows,) bool as in ``OccupancyUpdate``; assumed
    (rows,) bool: clear, though no camera saw the floor, or not since something stood there that
    no ray went through; states (rows,) uint8, values of
    ``Occupancy``, and of them in settled (rows,) what lasted.
    """

    def __init__(self, params: MapParams) -> None:
        self.evidence = TileLayer(np.int8, 0, (params.levels + 1,))
        self.clear = TileLayer(np.bool_, 0)
        self.assumed = TileLayer(np.bool_, 0)
        self.states = TileLayer(np.uint8, Occupancy.UNKNOWN)
        self.settled = TileLayer(np.uint8, Occupancy.UNKNOWN)

    @property
    def layers(self) -> tuple[TileLayer, ...]:
        return (self.evidence, self.clear, self.assumed, self.states, self.settled)

    def drops(self, rows: I64 | slice = slice(None)) -> Bool:
        """Mask (n,) by rows: there is no floor."""
        missing: Bool = self.evidence.values[rows, -1] >= OCCUPIED_THRESHOLD
        return missing

    @property
    def known_rows(self) -> I64:
        """Ascending rows (n,) with any evidence, or with floor."""
        return np.flatnonzero(self.clear.values | self.evidence.values.any(axis=1))

    def add(self, rows: I64, frame: OccupancyUpdate) -> tuple[Bool, Bool]:
        """Add a frame's evidence to cells, by their distinct rows (n,).

        Returns (n,) bool twice: which cells look different now, and in which something stands that
        did not, or the other way round.
        """
        settled = self.settled.values
        return add_evidence(self._arrays(), settled, rows, frame.evidence, frame.clear)

    def assume(self, rows: I64) -> Bool:
        """Take floor for free, by rows (n,); returns which cells look different now (n,) bool."""
        return assume_floor(self._arrays(), rows)

    def _arrays(self) -> Layers:
        return self.evidence.values, self.clear.values, self.assumed.values, self.states.values
