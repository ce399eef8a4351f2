"""Lengths of the ways between many points, measured on a coarse grid."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from onemap_planner.motion.path import cost_to_go_from
from onemap_shared.geometry import F64, I64, Bool
from onemap_shared.grid import GridSpec

COARSE_M = 0.3  # cells of the coarse grid: a tenth of the time; no wall is crossed, since the
# cells beside it, 0.25 m on both sides, are no floor for the robot
BEYOND_FACTOR = 1.5  # metres of way for a metre in the air where no way is known yet
IMPASSABLE = -1.0  # as in the costmap


def way_lengths(grid: GridSpec, reachable: Bool, from_xy: F64, to_xy: F64) -> F64:
    """Metres (F, T) of way from points (F, 2) to points (T, 2), metres.

    On reachable floor (nx, ny), on a coarse grid; from its last cell to a point that lies beyond,
    ``BEYOND_FACTOR`` times the distance. Infinite without reachable floor.
    """
    factor = max(round(COARSE_M / grid.cell_size_m), 1)
    size_m = factor * grid.cell_size_m
    coarse = _any_of_blocks(reachable, factor)
    if not coarse.any():
        return np.full((len(from_xy), len(to_xy)), np.inf)
    limit = np.array(coarse.shape) - 1
    start = np.clip(grid.cells(from_xy) // factor, 0, limit)
    end = np.clip(grid.cells(to_xy) // factor, 0, limit)
    away, nearest = ndimage.distance_transform_edt(~coarse, return_indices=True)
    beyond_m = BEYOND_FACTOR * size_m * away
    last: I64 = nearest[:, end[:, 0], end[:, 1]]
    cost = np.where(coarse, 1.0, IMPASSABLE)
    lengths = np.zeros((len(from_xy), len(to_xy)))
    for row, (x, y) in enumerate(start):
        first = (int(nearest[0, x, y]), int(nearest[1, x, y]))
        ways = cost_to_go_from(cost, first, cell_size_m=size_m).cost_m[last[0], last[1]]
        lengths[row] = beyond_m[x, y] + ways + beyond_m[end[:, 0], end[:, 1]]
    return lengths


def _any_of_blocks(mask: Bool, factor: int) -> Bool:
    """Whether any cell of each block of ``factor`` x ``factor`` cells is set."""
    nx, ny = (-(-side // factor) for side in mask.shape)
    padded = np.zeros((nx * factor, ny * factor), bool)
    padded[: mask.shape[0], : mask.shape[1]] = mask
    blocks: Bool = np.any(padded.reshape(nx, factor, ny, factor), axis=(1, 3))
    return blocks
