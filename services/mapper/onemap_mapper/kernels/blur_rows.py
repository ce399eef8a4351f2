"""The rows of the blur: per target cell the observed cells within reach and their weights."""

from __future__ import annotations

import numpy as np

from onemap_mapper.kernels.jit import compiled
from onemap_shared.geometry import F32, I64


@compiled
def blur_rows(
    cells: I64, camera_xy_m: F32, reach_cells: int, half_width: int, limits: F32
) -> tuple[I64, I64, I64, F32]:  # pragma: no cover
    """(cells, starts, sources, values) of ``BlurKernel``, as ``blur.blur_kernel`` defines them.

    cells (n, 2) observed, n > 0; camera_xy_m (2,) float32; limits float32: (edge of a cell m,
    sigma in cells per metre, smallest sigma in cells, smallest weight kept).
    """
    size_m, sigma_per_m, least_sigma, least_weight = limits
    row_of, low_x, low_y, near = _window(cells, reach_cells)
    most = len(cells) * (2 * reach_cells + 1) ** 2
    targets = np.empty((most, 2), np.int64)
    starts = np.empty(most, np.int64)
    sources = np.empty(most, np.int64)
    values = np.empty(most, np.float32)
    side = np.empty(half_width + 1, np.float32)
    rows = filled = np.int64(0)
    for place in np.flatnonzero(near):
        x, y = place // near.shape[1], place % near.shape[1]
        dx = np.float32(x + low_x) * size_m - camera_xy_m[0]
        dy = np.float32(y + low_y) * size_m - camera_xy_m[1]
        sigma = max(np.float32(sigma_per_m * np.sqrt(dx * dx + dy * dy)), least_sigma)
        precision = np.float32(0.5) / (sigma * sigma)
        window = np.float32(0.5)
        for k in range(half_width + 1):
            side[k] = np.exp(max(np.float32(-k * k) * precision, np.float32(-50)))
            window += side[k] if k else np.float32(0)
        window = np.float32(4) * window * window
        starts[rows] = filled
        for i in range(max(x - reach_cells, 0), min(x + reach_cells + 1, row_of.shape[0])):
            for j in range(max(y - reach_cells, 0), min(y + reach_cells + 1, row_of.shape[1])):
                weight = side[abs(i - x)] * side[abs(j - y)] / window
                if row_of[i, j] >= 0 and weight >= least_weight:
                    sources[filled] = row_of[i, j]
                    values[filled] = weight
                    filled += 1
        if filled > starts[rows]:
            targets[rows, 0] = x + low_x
            targets[rows, 1] = y + low_y
            rows += 1
    return targets[:rows], starts[:rows], sources[:filled], values[:filled]


@compiled
def _window(cells: I64, reach: int) -> tuple[I64, int, int, I64]:  # pragma: no cover
    """Over the observed cells and their surroundings: rows or -1, its corner, what is in reach."""
    low_x = cells[:, 0].min() - reach
    low_y = cells[:, 1].min() - reach
    shape = (cells[:, 0].max() - low_x + reach + 1, cells[:, 1].max() - low_y + reach + 1)
    row_of = np.full(shape, -1, np.int32)
    near = np.zeros(shape, np.bool_)
    for row in range(len(cells)):
        x, y = cells[row, 0] - low_x, cells[row, 1] - low_y
        row_of[x, y] = row
        near[x - reach : x + reach + 1, y - reach : y + reach + 1] = True
    return row_of, low_x, low_y, near
