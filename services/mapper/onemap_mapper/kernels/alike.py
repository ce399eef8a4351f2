"""Pixels whose depth their neighbours share."""

from __future__ import annotations

import numpy as np

from onemap_mapper.kernels.jit import compiled
from onemap_shared.geometry import F32, Bool


@compiled
def few_alike(depth_m: F32, alike: float, neighbours: int) -> Bool:  # pragma: no cover
    """Mask (H, W) of pixels with depth with fewer than so many of eight neighbours alike.

    alike: the greatest difference, as a share of the depth of whichever of the two comes first,
    row by row. Pixels at the rim are not in the mask.
    """
    height, width = depth_m.shape
    share = np.float32(alike)
    few = np.zeros((height, width), np.bool_)
    for i in range(1, height - 1):
        for j in range(1, width - 1):
            d = depth_m[i, j]
            own = share * d
            count = np.int32(abs(d - depth_m[i, j + 1]) <= own)
            count += np.int32(abs(d - depth_m[i + 1, j]) <= own)
            count += np.int32(abs(d - depth_m[i + 1, j + 1]) <= own)
            count += np.int32(abs(d - depth_m[i + 1, j - 1]) <= own)
            for other in (
                depth_m[i, j - 1],
                depth_m[i - 1, j],
                depth_m[i - 1, j - 1],
                depth_m[i - 1, j + 1],
            ):
                count += np.int32(abs(other - d) <= share * other)
            few[i, j] = (count < neighbours) & (d > 0)
    return few
