"""What a depth image says about the sensor and its mounting, for diagnosis."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from onemap_shared.geometry import F32, F64, Intrinsics, transform, unproject

NEAR_M = 0.1  # nothing a robot looks at is nearer: a wrong depth scale, or a covered lens
FLOOR_RANGE_M = 4.0  # beyond, one degree of pitch error moves the floor by more than 7 cm
FLOOR_SEARCH_M = 1.0  # a mounting wrong by more shows no floor at all
FLOOR_BIN_M = 0.02
FLOOR_SHARE = 0.4  # of the fullest height: less is not a floor
FLOOR_MIN_POINTS = 50
STRIDE = 4


@dataclass(frozen=True, slots=True)
class DepthCheck:
    """valid_fraction: pixels with a return; near_fraction: of those, nearer than 0.1 m.

    floor_height_m: z of the lowest large level surface, 0 if all is well, NaN if none was seen.
    """

    valid_fraction: float
    near_fraction: float
    floor_height_m: float


def check_depth(depth_m: F32, *, intrinsics: Intrinsics, T_map_camera: F64) -> DepthCheck:
    """Check one image (H, W) float32 metres, 0 = none."""
    n = STRIDE if min(depth_m.shape) >= STRIDE * 30 else 1
    cx, cy = ((centre - 0.5) / n + 0.5 for centre in (intrinsics.cx, intrinsics.cy))
    camera = Intrinsics(intrinsics.fx / n, intrinsics.fy / n, cx, cy)
    depth = depth_m[::n, ::n]
    valid = depth > 0
    near = float((depth[valid] < NEAR_M).mean()) if valid.any() else 0.0
    points = unproject(depth, camera)[valid & (depth < FLOOR_RANGE_M)].astype(np.float64)
    return DepthCheck(
        float(valid.mean()), near, floor_height(transform(T_map_camera, points)[:, 2])
    )


def floor_height(z: F64) -> float:
    """The lowest height in metres at which many of the points' z (n,) lie, NaN if none.

    Level surfaces collect many points at one height, walls spread theirs. The floor is the
    lowest of the well-filled heights, tables come above it.
    """
    edges = np.arange(-FLOOR_SEARCH_M, FLOOR_SEARCH_M + FLOOR_BIN_M, FLOOR_BIN_M)
    counts, _ = np.histogram(z, edges)
    if counts.max() < FLOOR_MIN_POINTS:
        return float("nan")
    lowest = int(np.argmax(counts >= FLOOR_SHARE * counts.max()))
    near = z[np.abs(z - (edges[lowest] + FLOOR_BIN_M)) < 2 * FLOOR_BIN_M]
    return float(np.median(near))
