"""Depth of one camera as another one sees it, pixel by pixel."""

from __future__ import annotations

import math

import numpy as np

from onemap_ros2.images import CameraPair


def register_depth(depth_mm: np.ndarray, cameras: CameraPair, shape: tuple[int, int]) -> np.ndarray:
    """As ``onemap_ros2.images``, in double precision."""
    registered = np.zeros(shape, np.uint16)
    spread = max(round(cameras.color.fx / cameras.depth.fx), 1)
    for row, column in zip(*np.nonzero(depth_mm), strict=True):
        z = depth_mm[row, column] / 1000
        x = (column + 0.5 - cameras.depth.cx) / cameras.depth.fx * z
        y = (row + 0.5 - cameras.depth.cy) / cameras.depth.fy * z
        x, y, z, _ = cameras.T_color_depth @ (x, y, z, 1.0)
        if z < 5e-4:
            continue
        u = x / z * cameras.color.fx + cameras.color.cx - 0.5
        v = y / z * cameras.color.fy + cameras.color.cy - 0.5
        for i in range(spread):
            for k in range(spread):
                across = math.floor(u - 0.5 * (spread - 1) + 0.5) + k
                down = math.floor(v - 0.5 * (spread - 1) + 0.5) + i
                if 0 <= across < shape[1] and 0 <= down < shape[0]:
                    before = registered[down, across]
                    registered[down, across] = min(round(1000 * z), before or 65535)
    return registered
