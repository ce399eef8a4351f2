"""The points of a depth image, thinned, in one pass."""

from __future__ import annotations

import numpy as np

from onemap_mapper.kernels.jit import compiled
from onemap_shared.geometry import F32


@compiled
def cloud_planes(
    depth_m: F32, pixel_to_ray: F32, pose: F32, stride: int
) -> tuple[F32, F32]:  # pragma: no cover
    """Depth (h, w) of every so manieth pixel, and x, y, z (3, h, w) in the map frame, metres.

    In the arithmetic of ``camera.unproject_to_map``, to the last bit. depth_m (H, W); pixel_to_ray:
    of ``Intrinsics``; pose (3, 4) float32: T_map_camera's upper rows.
    """
    height, width = -(-depth_m.shape[0] // stride), -(-depth_m.shape[1] // stride)
    from_left, from_top, fx, fy = pixel_to_ray
    thinned = np.empty((height, width), np.float32)
    planes = np.empty((3, height, width), np.float32)
    columns = np.empty(width, np.float32)
    for j in range(width):
        columns[j] = np.float32(j * stride) + from_left
    for i in range(height):
        of_row, line = depth_m[i * stride], thinned[i]
        for j in range(width):
            line[j] = of_row[j * stride]
        row = np.float32(i * stride) + from_top
        for k in range(3):
            r_x, r_y, r_z, t = pose[k]
            plane = planes[k, i]
            for j in range(width):
                d = line[j]
                plane[j] = columns[j] * d / fx * r_x + row * d / fy * r_y + d * r_z + t
    return thinned, planes
