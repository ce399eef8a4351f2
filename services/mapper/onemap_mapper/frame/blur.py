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
from torch import Tensor

from onemap_mapper import jit
from onemap_mapper.frame.projection import sparse_matmul
from onemap_mapper.jit import compiled
from onemap_mapper.params import MapParams
from onemap_shared.geometry import F32, I32, I64, Bool

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

    cells (n, 2) int64 world cells; starts (n,) int64; sources (m,) int64 row of the observed cell;
    values (m,) float32 w_ij / S_i, S_i being the sum of the whole window.
    """

    cells: Tensor
    starts: Tensor
    sources: Tensor
    values: Tensor


def blur_kernel(
    cells: Tensor,
    *,
    camera_xy_m: tuple[float, float],
    params: MapParams,
) -> BlurKernel:
    """The kernel over the observed cells (n, 2) int64 of a camera at ``camera_xy_m``."""
    if jit.usable(wanted=params.compiled, device=cells.device) and len(cells):
        shape = BlurShape(
            params.blur_half_width_cells,
            np.float32(params.cell_size_m),
            np.float32(_sigma_per_m(params)),
        )
        rows = blur_rows(cells.numpy(), np.array(camera_xy_m, np.float32), shape)
        return BlurKernel(*map(torch.from_numpy, rows))
    camera = torch.tensor(camera_xy_m, device=cells.device, dtype=torch.float32)
    reach_cells = _reach_cells(cells, camera, params)
    reach = torch.arange(-reach_cells, reach_cells + 1, device=cells.device)
    steps = torch.cartesian_prod(reach, reach)
    targets = cells[:, None] + steps  # (n, k, 2)
    sigma = _sigma_per_m(params) * _distance_m(targets, camera, params.cell_size_m)
    precision = 0.5 / sigma.clamp_(min=MIN_SIGMA_CELLS).square()
    whole = torch.arange(1, params.blur_half_width_cells + 1, device=cells.device)
    side = _exp(-whole.square() * precision[..., None])
    window = (1.0 + 2.0 * side.sum(dim=-1)).square()  # S_i: the kernel is separable
    weight = _exp(-steps.square().sum(dim=-1) * precision) / window
    source, step = torch.nonzero(weight >= MIN_WEIGHT, as_tuple=True)
    return _by_target(targets[source, step], source, weight[source, step])


def _sigma_per_m(params: MapParams) -> float:
    """Standard deviation of the blur, in cells per metre of distance (Eq. depthvariance)."""
    return params.depth_factor / params.cell_size_m


def _reach_cells(cells: Tensor, camera_xy_m: Tensor, params: MapParams) -> int:
    """How many cells to each side a weight of at least ``MIN_WEIGHT`` may lie."""
    cell_size_m, half_width = params.cell_size_m, params.blur_half_width_cells
    farthest_m = 1.5 * half_width * cell_size_m  # beyond the observed cells, to a corner
    if len(cells):
        farthest_m += float(_distance_m(cells, camera_xy_m, cell_size_m).amax())
    return min(half_width, math.ceil(CUTOFF_SIGMAS * _sigma_per_m(params) * farthest_m))


def _distance_m(cells: Tensor, camera_xy_m: Tensor, cell_size_m: float) -> Tensor:
    """Metres from the camera to each cell's lower corner, as in the released code."""
    distance_m: Tensor = torch.linalg.vector_norm(cells * cell_size_m - camera_xy_m, dim=-1)
    return distance_m


def _exp(values: Tensor) -> Tensor:
    """The exponential of values <= 0; bounded, because underflow is many times slower."""
    return torch.exp(values.clamp(min=-50.0))


def _by_target(targets: Tensor, sources: Tensor, values: Tensor) -> BlurKernel:
    """Group entries (m,) by their target cell (m, 2)."""
    if len(targets) == 0:
        return BlurKernel(targets, sources, sources, values)
    low = targets.amin(dim=0)
    depth = int(targets[:, 1].amax() - low[1]) + 1
    flat, order = torch.sort((targets[:, 0] - low[0]) * depth + targets[:, 1] - low[1], stable=True)
    unique, counts = torch.unique_consecutive(flat, return_counts=True)
    cells = torch.stack([unique // depth + low[0], unique % depth + low[1]], dim=1)
    return BlurKernel(cells, counts.cumsum(0) - counts, sources[order], values[order])


def blurred(kernel: BlurKernel, table: Tensor) -> Tensor:
    """B times a table (observed cells, D) or (observed cells,) float32."""
    if table.ndim == 1:
        return sparse_matmul(table[:, None], kernel.sources, kernel.values, kernel.starts)[:, 0]
    return sparse_matmul(table, kernel.sources, kernel.values, kernel.starts)
