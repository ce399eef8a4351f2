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
from onemap_mapper.params import MapParams
from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import F32, F64, I64
from onemap_shared.grid import GridSpec, GridTooLarge

MAX_FRAME_CELLS = 2**17  # observed by one frame: 90 degrees to 40 m; the blur takes 3 kB for each
MAX_ENTRIES = 2**26  # cells times patches, with 9 bytes for each while W is made


@dataclass(frozen=True, slots=True)
class SparseRows:
    """A sparse matrix in compressed rows.

    starts (n,), columns (m,) int64, values (m,) float32: row i has values[k] in columns[k] for k
    from starts[i] up to the next row's start.
    """

    starts: I64
    columns: I64
    values: F32

    def times(self, table: Tensor) -> Tensor:
        """The product (n, D) with a table (K, D) float32, on the table's device."""
        if len(self.starts) == 0:
            return table.new_zeros((0, table.shape[1]))
        starts, columns, values = (
            torch.from_numpy(each).to(table.device)
            for each in (self.starts, self.columns, self.values)
        )
        return embedding_bag(columns, table, starts, mode="sum", per_sample_weights=values)


NO_ROWS = SparseRows(np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0, np.float32))


@dataclass(frozen=True, slots=True)
class CellWeights:
    """The matrix W of one frame.

    cells (n, 2) int64 world cells; confidence (n,) float32 c_M, the mean inverse variance;
    rows: of W, one per cell over the patches (row-major), values >= 0, each row summing to 1.
    """

    cells: I64
    confidence: F32
    rows: SparseRows


def check_size(cells: int, patch_shape: tuple[int, int]) -> None:
    """Raise ``GridTooLarge`` if W would be too large."""
    if cells > MAX_FRAME_CELLS or cells * math.prod(patch_shape) > MAX_ENTRIES:
        raise GridTooLarge(
            f"the frame observes {cells} cells with {math.prod(patch_shape)} patches; the limits "
            f"are {MAX_FRAME_CELLS} cells and {MAX_ENTRIES} pairs: are the intrinsics right?"
        )


@lru_cache(maxsize=8)  # of an image's rows and columns; not to be written
def interpolation(pixels: int, patches: int) -> tuple[I64, F32]:
    """Per pixel the patch before it (int64) and the fraction towards the next (float32).

    Half-pixel centres with border clamping, as bilinear resizing with align_corners=False.
    """
    position = (np.arange(pixels) + 0.5) * patches / pixels - 0.5
    position = position.clip(0, patches - 1)
    before = np.minimum(np.floor(position), max(patches - 2, 0)).astype(np.int64)
    return before, (position - before).astype(np.float32)


def project(
    depth_m: F32,
    variance: F32,
    *,
    intrinsics: Intrinsics,
    T_map_camera: F64,
    patch_shape: tuple[int, int],
    params: MapParams,
) -> CellWeights:
    """The cells that a frame observes, and the weights of its patches in them.

    depth_m (H, W) float32 metres, 0 = no return; variance (H, W) float32 > 0, infinity = do not
    use.
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
        return CellWeights(np.zeros((0, 2), np.int64), NO_ROWS.values, NO_ROWS)
    GridSpec(params.cell_size_m, (low_x, low_y), (high_x - low_x + 1, high_y - low_y + 1))
    (top, down), (left, right) = map(interpolation, depth_m.shape, patch_shape)
    between = pixel_weights.Interpolation(top, left, down, right)
    cells, confidence, starts, patches, values = pixel_weights.gather(
        (ix, iy), variance, box, between, patch_shape
    )
    check_size(len(cells), patch_shape)
    return CellWeights(cells, confidence, SparseRows(starts, patches, values))
