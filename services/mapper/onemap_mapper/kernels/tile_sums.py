"""The sums over the pixels of each tile that a plane is fitted from."""

from __future__ import annotations

import numpy as np

from onemap_mapper.kernels.jit import compiled
from onemap_shared.geometry import F32, F64


@compiled
def tile_sums(
    depth_m: F32, points_m: F32, camera_m: F64, side: int, range_m: tuple[float, float]
) -> F64:  # pragma: no cover
    """Per tile of side x side pixels (rows, columns, 14): of ``level_surface._sums``.

    With the direction d = (point - camera) / depth and q = 1 / depth of pixels in range: the upper
    half of the sum of d d^T (6), the sums of d q (3), of d (3) and of q^2, and the count.
    """
    rows, columns = depth_m.shape[0] // side, depth_m.shape[1] // side
    sums = np.zeros((rows, columns, 14))
    for i in range(rows * side):
        for j in range(columns * side):
            depth = np.float64(depth_m[i, j])
            if depth <= range_m[0] or depth >= range_m[1]:
                continue
            q = 1.0 / depth
            x = (points_m[i, j, 0] - camera_m[0]) * q
            y = (points_m[i, j, 1] - camera_m[1]) * q
            z = (points_m[i, j, 2] - camera_m[2]) * q
            tile = sums[i // side, j // side]
            tile[0] += x * x
            tile[1] += x * y
            tile[2] += x * z
            tile[3] += y * y
            tile[4] += y * z
            tile[5] += z * z
            tile[6] += x * q
            tile[7] += y * q
            tile[8] += z * q
            tile[9] += x
            tile[10] += y
            tile[11] += z
            tile[12] += q * q
            tile[13] += 1.0
    return sums
