"""What is known of where a robot can drive, changed in place by one frame, row by row."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from onemap_mapper.kernels.jit import compiled
from onemap_shared.geometry import I64, U8, Bool

I8 = NDArray[np.int8]
Layers = tuple[I8, Bool, Bool, U8]  # evidence (rows, levels + 1), clear, assumed, states (rows,)
Limits = tuple[int, int, int, int]  # of evidence: least, greatest, of occupied, of what lasts
States = tuple[int, int, int]  # values of Occupancy: unknown, free, occupied


@compiled
def _add_to_column(evidence: I8, added: I8, limits: Limits) -> tuple[int, bool]:  # pragma: no cover
    """Add to the evidence (levels + 1,) of a cell, as ``accumulated_evidence``.

    Returns the highest after, and ``unseen_gone``. The last voxel, below the floor, is no part of
    what may lose its top.
    """
    least, greatest, occupied_from, _ = limits
    below_floor = len(evidence) - 1
    hit = False
    for level in range(below_floor):
        hit |= added[level] > 0
    highest, lost, gone = least, 0, False
    for level in range(below_floor, -1, -1):
        before, more = np.int64(evidence[level]), np.int64(added[level])
        if level < below_floor and before > 0:
            if more < 0:
                lost = min(lost, more)
            elif more == 0 and not hit:
                more = lost
                gone |= before >= occupied_from > before + more
        total = min(max(before + more, least), greatest)
        evidence[level] = total
        highest = max(highest, total)
    return highest, gone


@compiled
def add_evidence(
    layers: Layers, settled: U8, frame: tuple[I64, I8, Bool], limits: Limits, states: States
) -> tuple[Bool, Bool]:  # pragma: no cover
    """Add a frame's evidence, as ``OccupancyLayers.add`` does in torch.

    settled (rows,): of the states, what lasted; frame: distinct rows (n,), evidence (n, levels + 1)
    and clear (n,). Returns (n,) twice: which rows look different now, and in which something stands
    that did not, or the other way round.
    """
    evidence, clear, assumed, occupancy = layers
    rows, added, cleared = frame
    _, _, occupied_from, settled_from = limits
    unknown, free, occupied = np.uint8(states[0]), np.uint8(states[1]), np.uint8(states[2])
    different, changed = np.empty(len(rows), np.bool_), np.empty(len(rows), np.bool_)
    for k in range(len(rows)):
        row = rows[k]
        highest, gone = _add_to_column(evidence[row], added[k], limits)
        newly_clear = cleared[k] & (not clear[row])
        clear[row] |= cleared[k]
        now_assumed = (assumed[row] | (gone & clear[row])) & (not cleared[k])
        state = free if clear[row] else unknown
        state = occupied if highest >= occupied_from else state
        different[k] = (state != occupancy[row]) | (now_assumed != assumed[row]) | newly_clear
        assumed[row], occupancy[row] = now_assumed, state
        before = settled[row]
        after = free if state == free else before
        after = occupied if highest >= settled_from else after
        settled[row] = after
        changed[k] = (before != unknown) & (after != before)
    return different, changed


@compiled
def assume_floor(
    layers: Layers, rows: I64, limits: Limits, states: States
) -> Bool:  # pragma: no cover
    """Take floor for free that no camera saw, rows (n,); returns which look different now (n,).

    As ``OccupancyLayers.assume`` does in torch; a row may come twice.
    """
    evidence, clear, assumed, occupancy = layers
    different = np.empty(len(rows), np.bool_)
    for k in range(len(rows)):
        row = rows[k]
        highest = limits[0]
        for level in range(evidence.shape[1]):
            highest = max(highest, np.int64(evidence[row, level]))
        state = np.uint8(states[2] if highest >= limits[2] else states[1])
        now_assumed = assumed[row] | (not clear[row])
        different[k] = (state != occupancy[row]) | (now_assumed != assumed[row])
        assumed[row], clear[row], occupancy[row] = now_assumed, True, state
    return different
