"""The confidence of pixels per cell and level of height, in one pass."""

from __future__ import annotations

import numpy as np

from onemap_mapper.kernels.jit import compiled
from onemap_shared.geometry import F32, I32


@compiled
def height_sums(
    image: tuple[F32, F32, F32],
    row_of: I32,
    origin: tuple[int, int],
    limits: tuple[float, float, float, float, float],
    shape: tuple[int, int],
) -> F32:  # pragma: no cover
    """Sums (rows, levels) float32 of the confidence of points.

    image: z-depth (H, W) and points (H, W, 3) in metres, and confidence (H, W), 0 = do not use;
    row_of (nx, ny): the row of each cell of a box that begins at world cell ``origin``, -1 =
    none; limits: (edge of a cell, upper end of the lowest level, height of a level, farthest depth,
    greatest height) m; shape: rows and levels.
    """
    depth_m, points_m, confidence = image
    sums = np.zeros(shape, np.float32)
    size, lowest, thickness = limits[:3]
    farthest, highest = np.float32(limits[3]), np.float32(limits[4])
    for i in range(points_m.shape[0]):
        for j in range(points_m.shape[1]):
            depth, z = depth_m[i, j], points_m[i, j, 2]
            if not ((depth > 0) & (depth <= farthest) & (z <= highest) & (confidence[i, j] > 0)):
                continue
            ix = int(np.floor(np.float64(points_m[i, j, 0]) / size)) - origin[0]
            iy = int(np.floor(np.float64(points_m[i, j, 1]) / size)) - origin[1]
            if ix < 0 or iy < 0 or ix >= row_of.shape[0] or iy >= row_of.shape[1]:
                continue
            row = row_of[ix, iy]
            if row < 0:
                continue
            above = np.float64(z) - lowest
            level = min(max(int(np.floor(above / thickness)) + 1, 0), shape[1] - 1)
            sums[row, level] += confidence[i, j]
    return sums
