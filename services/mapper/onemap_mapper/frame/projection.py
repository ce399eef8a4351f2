"""Features and confidences of pixels, projected to cells without the upsampled feature image.

Interpolating patch features to pixels, weighting the pixels and summing them per cell are all
linear in the patch features. So only scalar weights are scattered, into a sparse cells x patches
matrix W, and F_M = W F is one product.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import torch
from torch import Tensor
from torch.nn.functional import embedding_bag

from onemap_mapper.frame import pixel_weights
from onemap_mapper.frame.cloud import PointCloud, divided
from onemap_mapper.params import MapParams
from onemap_mapper.transfers import to_host
from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import F32, F64, I64
from onemap_shared.grid import GridSpec, GridTooLarge, world_cells

MAX_FRAME_CELLS = 2**17  # observed by one frame: 90 degrees to 40 m; the blur takes 3 kB for each
MAX_ENTRIES = 2**26  # cells times patches, with 9 bytes for each while W is made


@dataclass(frozen=True, slots=True)
class CellWeights:
    """The matrix W of one frame in compressed rows, one row per observed cell.

    cells (n, 2) int64 world cells; confidence (n,) float32 c_M, the mean inverse variance;
    starts (n,) int64 first entry of each row; patches (m,) int64 column (row-major patch);
    values (m,) float32 >= 0, each row summing to 1.
    """

    cells: Tensor
    confidence: Tensor
    starts: Tensor
    patches: Tensor
    values: Tensor


def project(
    cloud: PointCloud,
    variance: Tensor,
    *,
    patch_shape: tuple[int, int],
    params: MapParams,
) -> CellWeights:
    """The cells that a frame observes, and the weights of its patches in them.

    variance (H, W) float32 > 0, infinity = do not use. Computed on the device of the images; the
    host learns the bounds of the cells, and how many there are.
    """
    usable = (cloud.depth_m > 0) & (cloud.depth_m <= params.max_feature_range_m)
    box, flat = _flat_cells(cloud, usable & (variance < torch.inf), params)
    unused = math.prod(box.shape)
    confidence = torch.where(flat < unused, torch.ones_like(variance) / variance, 0.0)
    found, row = _unique_inverse(flat.flatten(), unused)
    (low_x, low_y), depth = box.origin_cell, box.shape[1]
    cells = torch.stack([found // depth + low_x, found % depth + low_y], dim=1)
    count = len(cells)
    check_size(count, patch_shape)
    pixels = torch.bincount(row, minlength=count + 1)[:count]
    starts, patches, values = _scatter(row, confidence, patch_shape=patch_shape, count=count)
    lengths = torch.diff(starts, append=starts.new_full((1,), len(patches)))
    owner = torch.repeat_interleave(torch.arange(count, device=row.device), lengths)
    total = values.new_zeros(count).scatter_add_(0, owner, values)
    return CellWeights(cells, total / pixels, starts, patches, values / total[owner])


def cell_features(weights: CellWeights, patch_features: Tensor) -> Tensor:
    """F_M = W F: (n, D) float32 features of the cells from patch features (h * w, D) float32."""
    return sparse_matmul(patch_features, weights.patches, weights.values, weights.starts)


def sparse_matmul(table: Tensor, columns: Tensor, values: Tensor, starts: Tensor) -> Tensor:
    """Sparse times dense: rows (n, D) of a table (K, D) float32.

    starts (n,), columns (m,) int64, values (m,) float32: row i is the sum of
    values[k] * table[columns[k]] for k from starts[i] up to the next row's start.
    """
    if len(starts) == 0:
        return table.new_zeros((0, table.shape[1]))
    return embedding_bag(columns, table, starts, mode="sum", per_sample_weights=values)


def check_size(cells: int, patch_shape: tuple[int, int]) -> None:
    """Raise ``GridTooLarge`` if W would be too large."""
    if cells > MAX_FRAME_CELLS or cells * math.prod(patch_shape) > MAX_ENTRIES:
        raise GridTooLarge(
            f"the frame observes {cells} cells with {math.prod(patch_shape)} patches; the limits "
            f"are {MAX_FRAME_CELLS} cells and {MAX_ENTRIES} pairs: are the intrinsics right?"
        )


def _flat_cells(cloud: PointCloud, usable: Tensor, params: MapParams) -> tuple[GridSpec, Tensor]:
    """A grid over the cells of usable pixels, and each pixel's flat index (H, W) in it.

    Pixels that are not usable, or too high, get the number of cells of the grid.
    """
    size_m = params.cell_size_m
    camera = world_cells(cloud.T_map_camera[:3, 3], size_m).tolist()
    # Unusable pixels fall on the camera, so that one far outlier does not widen the grid.
    ix, iy = (
        torch.where(usable, divided(plane, size_m).floor().long(), own)
        for plane, own in zip((cloud.x_m, cloud.y_m), camera, strict=True)
    )
    low_x, low_y, high_x, high_y = to_host(
        torch.stack([ix.amin(), iy.amin(), ix.amax(), iy.amax()])
    ).tolist()
    box = GridSpec(size_m, (low_x, low_y), (high_x - low_x + 1, high_y - low_y + 1))
    usable = usable & (cloud.z_m <= params.max_feature_height_m)
    flat = (ix - low_x) * box.shape[1] + iy - low_y
    return box, torch.where(usable, flat, math.prod(box.shape))


def _unique_inverse(values: Tensor, limit: int) -> tuple[Tensor, Tensor]:
    """The distinct values (k,) below ``limit``, ascending, and each value's index in them.

    The value ``limit`` stands for "none" and gets index k. ``torch.unique`` would sort.
    """
    present = torch.zeros(limit + 1, dtype=torch.bool, device=values.device)
    present[values] = True
    found = torch.nonzero(present[:limit]).squeeze(1)
    index_of = torch.empty(limit + 1, dtype=torch.int64, device=values.device)
    index_of[limit] = len(found)
    index_of[found] = torch.arange(len(found), device=values.device)
    return found, index_of[values]


def _scatter(
    row: Tensor, confidence: Tensor, *, patch_shape: tuple[int, int], count: int
) -> tuple[Tensor, Tensor, Tensor]:
    """Starts, patches and values of W before normalisation.

    All pixels between the same four patch centres interpolate those four patches, so per (cell,
    upper left patch) four sums suffice: of s, s a, s b and s a b, with a and b the pixel's
    fractions down and right. Each quadruple of sums becomes four entries afterwards.
    """
    (h, w), (height, width) = patch_shape, confidence.shape
    device = confidence.device
    top, a = (torch.from_numpy(each).to(device) for each in interpolation(height, h))
    left, b = (torch.from_numpy(each).to(device) for each in interpolation(width, w))
    down, right = w * (h > 1), int(w > 1)
    key = row * (h * w) + (top[:, None] * w + left).flatten()
    used, index = _unique_inverse(key.clamp_(max=count * h * w), count * h * w)
    s_a, s_b = confidence * a[:, None], confidence * b
    sums = confidence.new_zeros((4, len(used) + 1))
    for k, weight in enumerate((confidence, s_a, s_b, s_a * b)):
        sums[k].scatter_add_(0, index, weight.flatten())
    s, s_a, s_b, s_ab = sums[:, :-1]
    values = torch.stack([s - s_a - s_b + s_ab, s_b - s_ab, s_a - s_ab, s_ab], dim=1)
    patch = used % (h * w)
    patches = torch.stack([patch, patch + right, patch + down, patch + down + right], dim=1)
    owner = torch.arange(count, device=row.device)
    starts = 4 * torch.searchsorted(used // (h * w), owner)
    return starts, patches.flatten(), values.flatten().clamp_(min=0.0)


@lru_cache(maxsize=8)  # of an image's rows and columns; not to be written
def interpolation(pixels: int, patches: int) -> tuple[I64, F32]:
    """Per pixel the patch before it (int64) and the fraction towards the next (float32).

    Half-pixel centres with border clamping, as bilinear resizing with align_corners=False.
    """
    position = (np.arange(pixels) + 0.5) * patches / pixels - 0.5
    position = position.clip(0, patches - 1)
    before = np.minimum(np.floor(position), max(patches - 2, 0)).astype(np.int64)
    return before, (position - before).astype(np.float32)


def project_compiled(
    depth_m: F32,
    variance: F32,
    *,
    intrinsics: Intrinsics,
    T_map_camera: F64,
    patch_shape: tuple[int, int],
    params: MapParams,
) -> CellWeights:
    """The cells that a frame observes, and the weights of its patches in them, on the CPU.

    depth_m (H, W) float32 metres, 0 = no return; variance (H, W) float32 > 0, infinity = do not
    use. The same cells in the same order as ``project``; weights equal up to rounding, and those
    of one patch in a cell summed.
    """
    check_size(1, patch_shape)  # before arrays of its size are made
    variance = np.ascontiguousarray(variance).view()
    variance.flags.writeable = False  # as it comes from the bus: each kind is compiled anew
    limits = pixel_weights.FeatureLimits(
        np.float32(params.max_feature_range_m),
        np.float32(params.max_feature_height_m),
        np.float32(params.cell_size_m),
    )
    ix, iy, box = pixel_weights.locate(
        np.ascontiguousarray(depth_m),
        variance,
        intrinsics.pixel_to_ray,
        T_map_camera[:3].astype(np.float32),
        limits,
    )
    low_x, low_y, high_x, high_y = box
    if low_x > high_x:
        return _nothing()
    GridSpec(params.cell_size_m, (low_x, low_y), (high_x - low_x + 1, high_y - low_y + 1))
    (top, down), (left, right) = map(interpolation, depth_m.shape, patch_shape)
    between = pixel_weights.Interpolation(top, left, down, right)
    rows = pixel_weights.gather((ix, iy), variance, box, between, patch_shape)
    check_size(len(rows[0]), patch_shape)
    return CellWeights(*map(torch.from_numpy, rows))


def _nothing() -> CellWeights:
    empty = torch.zeros(0, dtype=torch.int64)
    values = torch.zeros(0)
    return CellWeights(empty.view(0, 2), values, empty, empty, values)
