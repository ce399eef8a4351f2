"""The update of a frame as its equations read, in torch: what the mapper's fast paths avoid.

The features are interpolated to an image with as many channels as a feature has, every pixel is
added to its cell, and the blur goes over a dense window. This is the arithmetic of the paper with
the library's own operations; it is not the authors' code, and makes no occupancy.
"""

from __future__ import annotations

import torch
from torch import Tensor
from torch.nn.functional import interpolate, unfold

from onemap_mapper.params import MapParams
from onemap_shared.camera import unproject_to_map
from onemap_shared.geometry import I64
from onemap_shared.grid import world_cells
from onemap_shared.messages import FeatureField

LEAST_SIGMA = 1e-3  # in cells; nearer to the camera the blur is narrower than a cell


def dense_update(field: FeatureField, depth_m: Tensor, params: MapParams) -> tuple[Tensor, Tensor]:
    """Blurred features (nx, ny, D) and confidences (nx, ny) over the box of a frame's cells.

    depth_m (H, W) float32.
    """
    cells, used = _cells(field, depth_m, params)
    low = torch.from_numpy(cells[used.numpy()].min(axis=0))
    high = torch.from_numpy(cells[used.numpy()].max(axis=0))
    nx, ny = (high - low + 1).tolist()
    inside = torch.from_numpy(cells)[used] - low
    flat = inside[:, 0] * ny + inside[:, 1]
    weight = (1.0 / torch.from_numpy(field.variance.copy()))[used]
    features = torch.from_numpy(field.features.copy()).float().permute(2, 0, 1)[None]
    image = interpolate(features, depth_m.shape, mode="bilinear", align_corners=False)[0]
    pixels = image.permute(1, 2, 0)[used] * weight[:, None]
    sums = torch.zeros((nx * ny, pixels.shape[1])).index_add_(0, flat, pixels)
    total = torch.zeros(nx * ny).index_add_(0, flat, weight)
    count = torch.zeros(nx * ny).index_add_(0, flat, torch.ones_like(weight))
    mean = (sums / total.clamp(min=1e-12)[:, None]).view(nx, ny, -1)
    return _blurred(mean, (total / count.clamp(min=1)).view(nx, ny), low, field, params)


def _cells(field: FeatureField, depth_m: Tensor, params: MapParams) -> tuple[I64, Tensor]:
    """World cells (H, W, 2) of the pixels, and which of them carry a feature (H, W)."""
    points = unproject_to_map(depth_m.numpy(), field.intrinsics, field.T_map_camera)
    variance = torch.from_numpy(field.variance.copy())
    used = (depth_m > 0) & (depth_m <= params.max_feature_range_m) & variance.isfinite()
    used &= torch.from_numpy(points[..., 2] <= params.max_feature_height_m)
    return world_cells(points, params.cell_size_m), used


def _blurred(
    mean: Tensor, confidence: Tensor, low: Tensor, field: FeatureField, params: MapParams
) -> tuple[Tensor, Tensor]:
    """Each cell's mean over its window of cells, weighted as its distance from the camera says."""
    half = params.blur_half_width_cells
    if half == 0:
        return mean, confidence
    nx, ny, channels = mean.shape
    reach = torch.arange(-half, half + 1)
    squares = (reach[:, None] ** 2 + reach**2).flatten()
    ix = (torch.arange(nx) + low[0])[:, None].expand(nx, ny)
    iy = (torch.arange(ny) + low[1]).expand(nx, ny)
    camera_m = torch.from_numpy(field.T_map_camera[:2, 3].copy()).float()
    distance_m = torch.hypot(
        ix * params.cell_size_m - camera_m[0], iy * params.cell_size_m - camera_m[1]
    )
    sigma = (params.depth_factor * distance_m / params.cell_size_m).clamp(min=LEAST_SIGMA)
    kernel = torch.exp(-squares / (2 * sigma.view(-1, 1) ** 2))
    kernel /= kernel.sum(dim=1, keepdim=True)
    layers = torch.cat([confidence[None], mean.permute(2, 0, 1)])
    windows = (unfold(layer[None, None], 2 * half + 1, padding=half)[0].T for layer in layers)
    summed = [(window * kernel).sum(dim=1) for window in windows]
    blurred = torch.stack(summed[1:], dim=1).view(nx, ny, channels)
    return blurred, summed[0].view(nx, ny)
