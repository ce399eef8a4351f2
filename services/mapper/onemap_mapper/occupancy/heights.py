"""At which heights the content of a cell lies, and from it where in height a match lies.

A cell is a column from the floor to the highest pixel with a feature, and one feature is kept for
all of it. Beside it lie the shares of its confidence by level of height. They are fused, moved,
saved and cleared as further channels of the feature, so that they always belong to it.

What a text matches lies at the heights that are more frequent in the matching cells than beside
them: under a table top that all cells of the table share, or on it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy import ndimage

from onemap_mapper.frame.cloud import PointCloud
from onemap_mapper.params import MapParams
from onemap_shared.geometry import F32, F64, I64, U8, Bool
from onemap_shared.jit import compiled

LEVELS = 12  # 48 bytes per cell: 1.6 % of a cell of 768 float32 channels
LOWEST_M = 0.1  # up to here is the floor, with the errors of its depth and of the pose
THICKNESS_M = 0.2  # of the levels above it; the last one has all that is higher
EDGES_M: F64 = np.append(0.0, LOWEST_M + THICKNESS_M * np.arange(LEVELS))
RING_CELLS = 3  # around a region, with which it is compared: 0.3 m, beyond the blur
MIN_EXCESS = 0.15  # a region that differs less from its surroundings has their heights
# Of a cell's confidence at its top and above: less are pixels on the edge of something behind it.
MIN_TOP_SHARE = 0.05
MIN_SHARE = 0.7  # of what counts lies in the answer; the rest are stray pixels and blur


class HeightLimits(NamedTuple):
    """Edge of a cell, farthest depth, greatest height, metres."""

    cell_size_m: float
    farthest_m: np.float32
    highest_m: np.float32


@compiled
def height_sums(
    planes: tuple[F32, F32, F32, F32], variance: F32, cells: I64, limits: HeightLimits
) -> F32:
    """Sums (n, LEVELS) float32 in cells (n, 2), n > 0, of the confidence of pixels.

    planes: depth, x, y, z (H, W); the confidence is 1 / variance (H, W).
    """
    depths, xs, ys, zs = planes
    low_x = high_x = np.int32(cells[0, 0])
    low_y = high_y = np.int32(cells[0, 1])
    for row in range(1, len(cells)):
        x_cell, y_cell = np.int32(cells[row, 0]), np.int32(cells[row, 1])
        low_x, high_x = min(low_x, x_cell), max(high_x, x_cell)
        low_y, high_y = min(low_y, y_cell), max(high_y, y_cell)
    shape = np.int64(high_x) - low_x + 1, np.int64(high_y) - low_y + 1
    row_of = np.full(shape, -1, np.int32)
    for row in range(len(cells)):
        row_of[cells[row, 0] - low_x, cells[row, 1] - low_y] = row
    sums = np.zeros((len(cells), LEVELS), np.float32)
    width = depths.shape[1]
    x, y, level = np.empty(width, np.int32), np.empty(width, np.int32), np.empty(width, np.int32)
    for i in range(len(depths)):
        for j in range(width):  # a loop of its own, made with vectors
            depth, z = depths[i, j], zs[i, j]
            used = (depth > 0) & (depth <= limits.farthest_m) & (z <= limits.highest_m)
            used &= variance[i, j] < np.inf
            column = np.int32(np.floor(np.float64(xs[i, j]) / limits.cell_size_m)) - low_x
            x[j] = column if used else np.int32(-1)
            y[j] = np.int32(np.floor(np.float64(ys[i, j]) / limits.cell_size_m)) - low_y
            above = np.int32(np.floor((np.float64(z) - LOWEST_M) / THICKNESS_M)) + np.int32(1)
            level[j] = min(max(above, np.int32(0)), np.int32(LEVELS - 1))
        for j in range(width):
            if x[j] < 0 or y[j] < 0 or x[j] >= row_of.shape[0] or y[j] >= row_of.shape[1]:
                continue
            row = row_of[x[j], y[j]]
            if row >= 0:
                sums[row, level[j]] += np.float32(1) / variance[i, j]
    return sums


def cell_heights(cloud: PointCloud, variance: F32, cells: I64, params: MapParams) -> F32:
    """Shares (n, LEVELS) float32 of the confidence of a frame's pixels in distinct cells (n, 2).

    variance: of the cloud's pixels, infinity = do not use. A row sums to 1, or is zero where no
    pixel falls into the cell.
    """
    if len(cells) == 0:
        return np.zeros((0, LEVELS), np.float32)
    far_high = map(np.float32, (params.max_feature_range_m, params.max_feature_height_m))
    limits = HeightLimits(params.cell_size_m, *far_high)
    sums = height_sums(cloud.planes, variance, cells, limits)
    total = sums.sum(axis=1, keepdims=True)
    shares: F32 = np.divide(sums, total, out=np.zeros_like(sums), where=total > 0)
    return shares


def surroundings(regions: Bool, cells: I64) -> I64:
    """Cells (n, 2) of a grid around the cells (k, 2) of one region, in none of the ``regions``.

    regions (nx, ny): the cells of all regions.
    """
    low = np.maximum(cells.min(axis=0) - RING_CELLS, 0)
    high = np.minimum(cells.max(axis=0) + RING_CELLS + 1, regions.shape)
    own = np.zeros(tuple(high - low), bool)
    own[tuple((cells - low).T)] = True
    near = ndimage.binary_dilation(own, np.ones((3, 3), bool), iterations=RING_CELLS)
    near &= ~regions[low[0] : high[0], low[1] : high[1]]
    ring: I64 = np.argwhere(near) + low
    return ring


def height_band(inside: F32, weights: F32, around: F32) -> F32:
    """Lowest and highest height (2,) in metres of a match; NaN: nothing is known of its heights.

    inside (k, LEVELS): shares of its cells, which match by weights (k,) >= 0; around (m, LEVELS):
    shares of the cells beside it.
    """
    own = _mean_shares(inside, weights)
    if own.sum() == 0:
        return np.full(2, np.nan, np.float32)
    excess = np.maximum(own - _mean_shares(around, np.ones(len(around), np.float32)), 0.0)
    low, high = _run(excess if excess.sum() >= MIN_EXCESS else own)
    return EDGES_M[[low, high]].astype(np.float32)


def tops_dm(shares: F32) -> U8:
    """How high the content of cells reaches, (n,) uint8 in decimetres, of shares (n, LEVELS).

    The middle of the level, so to a decimetre, but 22 also for what is higher; 0: not known.
    """
    above = shares[:, ::-1].cumsum(axis=1, dtype=np.float64)[:, ::-1]
    total = above[:, 0]
    top = (above >= MIN_TOP_SHARE * total[:, None]).sum(axis=1) - 1
    middle_dm = np.rint(EDGES_M[:-1] * 10 + THICKNESS_M * 5)
    middle_dm[0] = 1
    return np.where(total > 0, middle_dm[top], 0).astype(np.uint8)


def _mean_shares(shares: F32, weights: F32) -> F64:
    """The weighted mean (LEVELS,) of shares (k, LEVELS), each first made to sum to 1."""
    total = shares.sum(axis=1, dtype=np.float64)
    known = total > 0
    weight = np.where(known, weights, 0.0)
    if weight.sum() == 0:
        return np.zeros(LEVELS)
    mean: F64 = weight[known] / total[known] @ shares[known] / weight.sum()
    return mean


def _run(values: F64) -> tuple[int, int]:
    """First level and end of the levels around the largest that have ``MIN_SHARE`` of all."""
    low = int(values.argmax())
    high = low + 1
    while values[low:high].sum() < MIN_SHARE * values.sum():
        below = values[low - 1] if low > 0 else -1.0
        above = values[high] if high < LEVELS else -1.0
        low, high = (low - 1, high) if below > above else (low, high + 1)
    return low, high
