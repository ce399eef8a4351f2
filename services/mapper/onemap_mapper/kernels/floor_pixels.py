"""Floor in a depth image read by columns: what ``floor`` does with arrays of pixels, in loops."""

from __future__ import annotations

import numpy as np

from onemap_mapper.kernels.jit import compiled
from onemap_shared.geometry import F32, Bool


@compiled
def image_planes(depth_m: F32, points_m: F32, camera: F32, step: int) -> F32:  # pragma: no cover
    """Planes (4, rows, columns) of every so manieth column, metres.

    Depth, x and y from the camera (3,), and height.
    """
    rows, width = depth_m.shape
    planes = np.empty((4, rows, -(-width // step)), np.float32)
    for i in range(rows):
        for j in range(planes.shape[2]):
            planes[0, i, j] = depth_m[i, j * step]
            planes[1, i, j] = points_m[i, j * step, 0] - camera[0]
            planes[2, i, j] = points_m[i, j * step, 1] - camera[1]
            planes[3, i, j] = points_m[i, j * step, 2]
    return planes


@compiled
def floor_and_edges(
    depth: F32, z: F32, jump: int, limits: F32
) -> tuple[Bool, Bool]:  # pragma: no cover
    """Pixels (rows, columns) of floor, and those just beyond the edge of a step down.

    As ``floor._floor_and_edges``. jump: rows between the pixels compared; limits float32: (height
    and tilt error per metre, least depth m of a drop, height m up to which there is floor, farthest
    depth m).
    """
    error_per_m, tilt_per_m, drop, tolerance, farthest = limits
    rows, columns = depth.shape
    none = rows - 1
    floor, edge = np.zeros((rows, columns), np.bool_), np.zeros((rows, columns), np.bool_)
    nearest = np.full(columns, none, np.int64)  # row of the edge in the image below
    edges = False
    for i in range(rows - 1, -1, -1):
        d, far, falls, even = depth[i], z[i], edge[i], floor[i]
        if i + jump < rows:
            below, near = depth[i + jump], z[i + jump]
            for j in range(columns):
                least = drop + error_per_m * below[j]
                step = (near[j] - far[j] > least) & (far[j] < -drop / np.float32(2))
                reach = tolerance + tilt_per_m * below[j]
                falls[j] = step & (abs(near[j]) <= reach) & (below[j] > 0) & (d[j] > 0)
        for j in range(columns):
            slack = error_per_m * d[j]
            level = (far[j] <= tolerance + slack) & (far[j] >= -(drop + slack))
            even[j] = level & (d[j] > 0) & (d[j] <= farthest)
            edges |= falls[j]
        if not edges:
            continue
        for j in range(columns):
            nearest[j] = i if falls[j] else nearest[j]
            at = nearest[j]
            middle = (z[min(at + jump, none), j] + z[at, j]) / np.float32(2)
            even[j] &= not ((at < none) & (far[j] < middle))
    return floor, edge


@compiled
def seen_places(x: F32, y: F32, floor: Bool, camera: F32, gaps: F32) -> F32:  # pragma: no cover
    """Places (n, 2) of floor pixels (rows, columns), then those of ``floor._between``.

    x, y: from the camera (3,); gaps float32: (shares of the way across a gap, the last two aside:
    narrowest and widest gap m).
    """
    shares, narrow, wide = gaps[:-2], gaps[-2], gaps[-1]
    rows, columns = floor.shape
    wide_at = np.empty(rows * columns, np.int64)
    count = gap_count = 0
    for i in range(rows):
        for j in range(columns):
            count += floor[i, j]
            if i + 1 < rows and floor[i, j] and floor[i + 1, j]:
                dx = np.float64(x[i + 1, j] - x[i, j])
                dy = np.float64(y[i + 1, j] - y[i, j])
                gap = np.float32(np.sqrt(dx * dx + dy * dy))
                if gap > narrow and gap <= wide:
                    wide_at[gap_count] = i * columns + j
                    gap_count += 1
    places = np.empty((count + gap_count * len(shares), 2), np.float32)
    filled = 0
    for i in range(rows):
        for j in range(columns):
            if floor[i, j]:
                places[filled, 0], places[filled, 1] = x[i, j] + camera[0], y[i, j] + camera[1]
                filled += 1
    for share in shares:
        for k in range(gap_count):
            i, j = wide_at[k] // columns, wide_at[k] % columns
            dx, dy = x[i + 1, j] - x[i, j], y[i + 1, j] - y[i, j]
            places[filled, 0] = x[i, j] + camera[0] + dx * share
            places[filled, 1] = y[i, j] + camera[1] + dy * share
            filled += 1
    return places
