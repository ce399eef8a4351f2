"""Distances over the cells of a grid."""

from __future__ import annotations

from math import ceil, inf

import cv2
import numpy as np

from onemap_shared.geometry import F64, I64, Bool
from onemap_shared.grid import GridSpec


def distances_m(mask: Bool, cell_size_m: float, within_m: float = inf) -> F64:
    """(nx, ny): metres to the centre of the nearest true cell; infinity without any, and where that
    may be farther than ``within_m``, beyond which nobody asks."""
    y, x, height, width = cv2.boundingRect(mask.astype(np.uint8))
    if not width:
        return np.full(mask.shape, np.inf)
    reach = ceil(min(within_m / cell_size_m, max(mask.shape)))
    box = np.s_[max(x - reach, 0) : x + width + reach, max(y - reach, 0) : y + height + reach]
    free = (~mask[box]).astype(np.uint8)
    away = cv2.distanceTransform(free, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    # Squares are whole numbers: rounded, the distances are exact.
    metres: F64 = np.sqrt(np.rint(away * away), dtype=np.float64)
    metres *= cell_size_m
    if metres.shape == mask.shape:
        return metres
    away_m = np.full(mask.shape, np.inf)
    away_m[box] = metres
    return away_m


def distances_to_edge_m(mask: Bool, cell_size_m: float) -> F64:
    """(nx, ny): metres to the edge of the nearest true cell, infinity without any."""
    away_m = distances_m(mask, cell_size_m)
    away_m -= cell_size_m / 2
    return away_m


def distance_cells(grid: GridSpec, cell: I64) -> F64:
    """(nx, ny): distance in cells from the centre of ``cell`` (2,)."""
    x, y = np.ogrid[: grid.shape[0], : grid.shape[1]]
    distance: F64 = np.hypot(x - cell[0], y - cell[1])
    return distance
