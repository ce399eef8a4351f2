"""Points and rays to the voxels of an occupancy update, without an array of samples.

A voxel is found in the arithmetic of ``occupancy.voxel_indices``, so that it does not matter which
of them found it: cells in float64, heights in float32. Which points and rays count, and for what,
is decided in ``occupancy``.
"""

from __future__ import annotations

import numpy as np

from onemap_mapper.kernels.jit import compiled
from onemap_shared.geometry import F32, I32, Bool

Shape = tuple[int, int, int]  # cells along x and y, levels


@compiled
def count_points(
    points: F32, origin: tuple[int, int], shape: Shape, cell_size_m: float, band: F32
) -> I32:  # pragma: no cover
    """How many of the points (n, 3) lie in each voxel (nx, ny, levels), int32.

    origin: world cell of voxel [0, 0]; band: (lowest height m, thickness of a level m) float32.
    """
    counts = np.zeros(shape, np.int32)
    lowest, thickness = band
    for k in range(len(points)):
        i = _cell(points[k, 0], cell_size_m) - origin[0]
        j = _cell(points[k, 1], cell_size_m) - origin[1]
        level = np.int64((points[k, 2] - lowest) / thickness)
        counts[i, j, min(level, shape[2] - 1)] += 1
    return counts


@compiled
def mark_rays(
    rays: tuple[F32, F32, F32], origin: tuple[int, int], shape: Shape, cell_size_m: float, band: F32
) -> Bool:  # pragma: no cover
    """The voxels (nx, ny, levels) in which the samples of ``occupancy.ray_samples`` lie.

    rays: camera (3,), ends (m, 3), ascending distances (k,) of samples from the camera, m; band:
    (lowest height m, thickness of a level m, greatest height m, margin m before the end) float32.
    """
    camera, ends, distances = rays
    lowest, thickness, highest, margin = band
    crossed = np.zeros(shape, np.bool_)
    for k in range(len(ends)):
        x, y, z = ends[k, 0] - camera[0], ends[k, 1] - camera[1], ends[k, 2] - camera[2]
        length = np.sqrt(x * x + y * y + z * z)
        scale = max(length, np.float32(1e-6))
        x, y, z = x / scale, y / scale, z / scale
        for distance in distances:
            if distance > length - margin:
                break
            height = camera[2] + z * distance
            if height >= highest or height < lowest:
                continue
            i = _cell(camera[0] + x * distance, cell_size_m) - origin[0]
            j = _cell(camera[1] + y * distance, cell_size_m) - origin[1]
            level = np.int64((height - lowest) / thickness)
            crossed[i, j, min(level, shape[2] - 1)] = True
    return crossed


@compiled
def _cell(x_m: float, cell_size_m: float) -> int:  # pragma: no cover
    return int(np.floor(np.float64(x_m) / cell_size_m))
