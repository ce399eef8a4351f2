"""The points of an image that occupancy is made of, in one pass over the pixels each."""

from __future__ import annotations

import numpy as np

from onemap_mapper.kernels.jit import compiled
from onemap_shared.geometry import F32


@compiled
def obstacle_points(
    depth_m: F32, planes_m: F32, limits: F32
) -> tuple[F32, F32]:  # pragma: no cover
    """Points (n, 3) on obstacles and (m, 3) too low for one, as ``occupancy._obstacles``.

    planes_m (3, H, W): x, y, z; limits float32: (height error per metre, depth m up to which an
    obstacle needs no slack, lowest height m of an obstacle, end of it m, farthest depth m, greatest
    height m of floor).
    """
    error_per_m, exact, least_height, highest, farthest, floor = limits
    pixels = depth_m.size
    depths, x, y, z = depth_m.ravel(), planes_m[0].ravel(), planes_m[1].ravel(), planes_m[2].ravel()
    kind = np.empty(pixels, np.uint8)
    for k in range(pixels):
        error = error_per_m * depths[k]
        least = least_height + (error if depths[k] > exact else np.float32(0))
        usable = (depths[k] > 0) & (depths[k] <= farthest)
        high = usable & (z[k] >= least) & (z[k] < highest)
        low = usable & (z[k] > floor + error) & (z[k] < least)
        kind[k] = np.uint8(high) + np.uint8(2) * np.uint8(low)
    high_at, low_at = np.flatnonzero(kind == 1), np.flatnonzero(kind == 2)
    found = np.empty((len(high_at), 3), np.float32), np.empty((len(low_at), 3), np.float32)
    for of_kind, at in zip(found, (high_at, low_at)):  # noqa: B905 (compiled code knows no strict)
        for row in range(len(at)):
            k = at[row]
            of_kind[row, 0], of_kind[row, 1], of_kind[row, 2] = x[k], y[k], z[k]
    return found


@compiled
def every_point(depth_m: F32, points_m: F32, stride: int) -> F32:  # pragma: no cover
    """Points (n, 3) with depth of every so manieth pixel of every so manieth row."""
    height, width = depth_m.shape
    found = np.empty((-(-height // stride) * -(-width // stride), 3), np.float32)
    filled = 0
    for i in range(0, height, stride):
        for j in range(0, width, stride):
            if depth_m[i, j] > 0:
                for k in range(3):
                    found[filled, k] = points_m[i, j, k]
                filled += 1
    return found[:filled]


@compiled
def bounds_of(places_m: F32) -> tuple[float, float, float, float]:  # pragma: no cover
    """The least and greatest x and y of places (n, 2 or 3): low x, low y, high x, high y.

    Infinite where there are none, the low ones above the high ones.
    """
    low_x = low_y = np.float32(np.inf)
    high_x = high_y = -np.float32(np.inf)
    for k in range(len(places_m)):
        x, y = places_m[k, 0], places_m[k, 1]
        low_x, low_y = min(low_x, x), min(low_y, y)
        high_x, high_y = max(high_x, x), max(high_y, y)
    return low_x, low_y, high_x, high_y


@compiled
def reached_bounds(
    camera: F32, ends: F32, range_m: F32
) -> tuple[float, float, float, float]:  # pragma: no cover
    """``bounds_of`` the camera (3,) and the ends (m, 3) of rays, shortened as ``_cleared`` does.

    range_m (1,): how far rays clear.
    """
    low_x = high_x = camera[0]
    low_y = high_y = camera[1]
    for k in range(len(ends)):
        x, y, z = ends[k, 0] - camera[0], ends[k, 1] - camera[1], ends[k, 2] - camera[2]
        length = np.sqrt(x * x + y * y + z * z)
        share = min(range_m[0] / max(length, np.float32(1e-6)), np.float32(1))
        x, y = camera[0] + x * share, camera[1] + y * share
        low_x, low_y = min(low_x, x), min(low_y, y)
        high_x, high_y = max(high_x, x), max(high_y, y)
    return low_x, low_y, high_x, high_y
