"""Distances over the cells of a grid."""

from __future__ import annotations

from math import ceil, inf

import cv2
import numpy as np

from onemap_shared.geometry import F32, F64, I64, Bool
from onemap_shared.grid import GridSpec
from onemap_shared.jit import compiled

# So far steps of 1, 1.4 and 2.1969, four times as fast, make squares that round to the exact ones.
CHAMFER_CELLS = 3


def distances_m(mask: Bool, cell_size_m: float, within_m: float = inf) -> F64:
    """(nx, ny): metres to the centre of the nearest true cell; infinity without any, and where that
    may be farther than ``within_m``, beyond which nobody asks."""
    y, x, height, width = cv2.boundingRect(mask.astype(np.uint8))
    if not width:
        return np.full(mask.shape, np.inf)
    reach = ceil(min(within_m / cell_size_m, max(mask.shape)))
    box = np.s_[max(x - reach, 0) : x + width + reach, max(y - reach, 0) : y + height + reach]
    free = (~mask[box]).astype(np.uint8)
    chamfer = reach <= CHAMFER_CELLS
    away = cv2.distanceTransform(free, cv2.DIST_L2, 5 if chamfer else cv2.DIST_MASK_PRECISE)
    metres = _metres(away.astype(np.float32, copy=False), cell_size_m)
    if metres.shape == mask.shape:
        return metres
    away_m = np.full(mask.shape, np.inf)
    away_m[box] = metres
    return away_m


@compiled
def _metres(away: F32, cell_size_m: float) -> F64:
    """Of distances in cells. Their squares are whole numbers: rounded, they are exact."""
    metres = np.empty(away.shape, np.float64)
    for x in range(away.shape[0]):
        for y in range(away.shape[1]):
            metres[x, y] = np.sqrt(np.float64(np.rint(away[x, y] * away[x, y]))) * cell_size_m
    return metres


def distances_to_edge_m(mask: Bool, cell_size_m: float, within_m: float = inf) -> F64:
    """(nx, ny): metres to the edge of the nearest true cell; infinity as ``distances_m``."""
    away_m = distances_m(mask, cell_size_m, within_m + cell_size_m / 2)
    away_m -= cell_size_m / 2
    return away_m


def distance_cells(grid: GridSpec, cell: I64) -> F64:
    """(nx, ny): distance in cells from the centre of ``cell`` (2,)."""
    x, y = np.ogrid[: grid.shape[0], : grid.shape[1]]
    distance: F64 = np.hypot(x - cell[0], y - cell[1])
    return distance
