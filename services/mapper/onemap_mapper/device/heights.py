"""``heights.cell_heights`` on a device."""

from __future__ import annotations

import torch
from torch import Tensor

from onemap_mapper.device.cloud import DeviceCloud, cells_of, divided
from onemap_mapper.heights import LEVELS, LOWEST_M, THICKNESS_M
from onemap_mapper.params import ProjectionParams
from onemap_mapper.transfers import to_host


def device_heights(
    cloud: DeviceCloud, variance: Tensor, cells: Tensor, params: ProjectionParams
) -> Tensor:
    """Shares (n, LEVELS) float32 of the confidence of a frame's pixels in cells (n, 2).

    The host learns the bounds of the cells.
    """
    sums = torch.zeros((len(cells) + 1, LEVELS), device=cells.device)  # the last one: no cell
    if len(cells) == 0:
        return sums[:-1]
    used = (cloud.depth_m > 0) & (cloud.depth_m <= params.max_feature_range_m)
    used &= (cloud.z_m <= params.max_feature_height_m) & (variance < torch.inf)
    points, confidence = cloud.points(used), variance[used].reciprocal()
    above = divided(points[:, 2].double() - LOWEST_M, THICKNESS_M).floor().long() + 1
    row = _rows(cells_of(points, params.cell_size_m), cells)
    flat = row * LEVELS + above.clamp(0, LEVELS - 1)
    sums.view(-1).index_add_(0, flat, confidence)
    total = sums[:-1].sum(dim=1, keepdim=True)
    return torch.where(total > 0, sums[:-1] / total, 0.0)


def _rows(places: Tensor, cells: Tensor) -> Tensor:
    """Indices (n,) among distinct cells (m, 2) of places (n, 2), m for those that are none."""
    low, high = to_host(torch.stack([cells.amin(dim=0), cells.amax(dim=0)])).tolist()
    nx, ny = (top - bottom + 1 for bottom, top in zip(low, high, strict=True))
    row_of = torch.full((nx * ny + 1,), len(cells), device=cells.device)
    row_of[(cells[:, 0] - low[0]) * ny + cells[:, 1] - low[1]] = torch.arange(
        len(cells), device=cells.device
    )
    x, y = places[:, 0] - low[0], places[:, 1] - low[1]
    inside = (x >= 0) & (x < nx) & (y >= 0) & (y < ny)
    return row_of[torch.where(inside, x * ny + y, nx * ny)]
