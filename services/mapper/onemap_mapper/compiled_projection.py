"""``projection.project`` in two compiled passes over the pixels, without a point cloud."""

from __future__ import annotations

import numpy as np
import torch

from onemap_mapper.kernels import pixel_weights
from onemap_mapper.params import ProjectionParams
from onemap_mapper.projection import CellWeights, check_size, interpolation
from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import F32, F64
from onemap_shared.grid import GridSpec


def project_compiled(
    depth_m: F32,
    variance: F32,
    *,
    intrinsics: Intrinsics,
    T_map_camera: F64,
    patch_shape: tuple[int, int],
    params: ProjectionParams,
) -> CellWeights:
    """The cells that a frame observes, and the weights of its patches in them, on the CPU.

    depth_m (H, W) float32 metres, 0 = no return; variance (H, W) float32 > 0, infinity = do not
    use. The same cells in the same order as ``project``; weights equal up to rounding, and those
    of one patch in a cell summed.
    """
    check_size(1, patch_shape)  # before arrays of its size are made
    confidence = np.divide(np.float32(1), variance, dtype=np.float32)
    limits = (params.max_feature_range_m, params.max_feature_height_m, params.cell_size_m)
    cells = pixel_weights.locate(
        np.ascontiguousarray(depth_m),
        confidence,
        intrinsics.pixel_to_ray,
        T_map_camera[:3].astype(np.float32),
        np.array(limits, np.float32),
    )
    box = pixel_weights.extent(*cells)
    low_x, low_y, high_x, high_y = box
    if low_x > high_x:
        return _nothing()
    GridSpec(params.cell_size_m, (low_x, low_y), (high_x - low_x + 1, high_y - low_y + 1))
    (top, down), (left, right) = map(interpolation, depth_m.shape, patch_shape)
    rows = pixel_weights.gather(cells, confidence, box, (top, left, down, right), patch_shape)
    check_size(len(rows[0]), patch_shape)
    return CellWeights(*map(torch.from_numpy, rows))


def _nothing() -> CellWeights:
    """The weights of a frame without usable pixels."""
    empty = torch.zeros(0, dtype=torch.int64)
    values = torch.zeros(0)
    return CellWeights(empty.view(0, 2), values, empty, empty, values)
