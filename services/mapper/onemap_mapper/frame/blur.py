"""Location uncertainty: a distant observation may belong to a neighbouring cell.

Eq. depthvariance: the blur of cell i grows with its distance d_i from the
camera, sigma_i = depth_factor * d_i / cell_size cells. Near the camera the
kernel is narrower than a cell, so the matrix is sparse.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import torch

from onemap_mapper.frame.projection import NO_ROWS, SparseRows
from onemap_mapper.params import MapParams
from onemap_shared.geometry import F32, F64, I32, I64, Bool
from onemap_shared.jit import compiled

# Smaller weights are left out: the results change by less than a thousandth of the largest value,
# and cells of negligible weight do not count as observed.
MIN_WEIGHT = 1e-4
CUTOFF_SIGMAS = math.sqrt(-2 * math.log(MIN_WEIGHT))  # where the Gaussian falls to that weight
MIN_SIGMA_CELLS = 0.15  # narrower: a neighbour's weight is below 1e-9


class BlurShape(NamedTuple):
    """How many cells to each side the window goes; edge of a cell in metres, standard deviation in
    cells per metre of distance."""

    half_width: int
    cell_size_m: np.float32
    sigma_per_m: np.float32


@compiled
def blur_rows(cells: I64, camera_xy_m: F32, shape: BlurShape) -> tuple[I64, I64, I64, F32]:
    """(cells, starts, sources, values) of ``BlurKernel`` from observed cells (n, 2), n > 0."""
    half_width, size_m, sigma_per_m = shape
    least_sigma, least_weight = np.float32(MIN_SIGMA_CELLS), np.float32(MIN_WEIGHT)
    row_of, low_x, low_y, near, reach_cells = _window(cells, camera_xy_m, shape)
    most = len(cells) * (2 * reach_cells + 1) ** 2
    targets = np.empty((most, 2), np.int64)
    starts = np.empty(most, np.int64)
    sources = np.empty(most, np.int64)
    values = np.empty(most, np.float32)
    side = np.empty(half_width + 1, np.float32)
    rows = filled = np.int64(0)
    for place in range(near.size):
        x, y = place // near.shape[1], place % near.shape[1]
        if not near[x, y]:
            continue
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
def _window(cells: I64, camera_xy_m: F32, shape: BlurShape) -> tuple[I32, int, int, Bool, int]:
    """Over the observed cells and their surroundings: rows or -1, its corner, what is in reach.

    And the reach: how many cells to each side a weight of at least ``MIN_WEIGHT`` may lie.
    """
    half_width, size_m, sigma_per_m = shape
    low_x = high_x = cells[0, 0]
    low_y = high_y = cells[0, 1]
    for row in range(1, len(cells)):
        low_x, high_x = min(low_x, cells[row, 0]), max(high_x, cells[row, 0])
        low_y, high_y = min(low_y, cells[row, 1]), max(high_y, cells[row, 1])
    x, y = camera_xy_m[0] / size_m, camera_xy_m[1] / size_m
    corner = max(x - low_x, high_x - x) ** 2 + max(y - low_y, high_y - y) ** 2
    farthest_m = size_m * (np.sqrt(corner) + 1.5 * half_width)
    reach = min(half_width, int(np.ceil(CUTOFF_SIGMAS * sigma_per_m * farthest_m)))
    low_x, low_y = low_x - reach, low_y - reach
    row_of = np.full((high_x - low_x + reach + 1, high_y - low_y + reach + 1), -1, np.int32)
    near = np.zeros(row_of.shape, np.bool_)
    for row in range(len(cells)):
        x, y = cells[row, 0] - low_x, cells[row, 1] - low_y
        row_of[x, y] = row
        for i in range(x - reach, x + reach + 1):
            for j in range(y - reach, y + reach + 1):
                near[i, j] = True
    return row_of, low_x, low_y, near, reach


@dataclass(frozen=True, slots=True)
class BlurKernel:
    """Sparse B of F-bar = B F_M, one row per cell within reach of an observed one.

    cells (n, 2) int64 world cells; rows: of B over the observed cells, values w_ij / S_i, S_i being
    the sum of the whole window.
    """

    cells: I64
    rows: SparseRows

    def confidence(self, observed: F32) -> F32:
        """B times the confidence of the observed cells."""
        blurred: F32 = self.rows.times(torch.from_numpy(observed)[:, None])[:, 0].numpy()
        return blurred


def blur_kernel(cells: I64, *, camera_xy_m: F64, params: MapParams) -> BlurKernel:
    """The kernel over the observed cells (n, 2) of a camera at ``camera_xy_m`` (2,)."""
    if len(cells) == 0:
        return BlurKernel(cells, NO_ROWS)
    sigma_per_m = params.depth_factor / params.cell_size_m  # in cells, Eq. depthvariance
    shape = BlurShape(
        params.blur_half_width_cells, np.float32(params.cell_size_m), np.float32(sigma_per_m)
    )
    targets, starts, sources, values = blur_rows(cells, camera_xy_m.astype(np.float32), shape)
    return BlurKernel(targets, SparseRows(starts, sources, values))
