"""A depth image as the color camera would have taken it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from onemap_shared.camera import Intrinsics, project, unproject
from onemap_shared.geometry import F64, U16

NOTHING = 65535  # mm; further than any measurement
MAX_SPREAD = 8  # pixels of the color image to a pixel of depth, along each side


@dataclass(frozen=True, slots=True)
class CameraPair:
    """A depth camera beside a color camera.

    Attributes:
        depth: the depth camera.
        color: the color camera.
        T_color_depth: (4, 4), from the depth camera's optical frame to the color camera's.
    """

    depth: Intrinsics
    color: Intrinsics
    T_color_depth: F64


def register_depth(depth_mm: U16, cameras: CameraPair, shape: tuple[int, int]) -> U16:
    """The depth (H, W) uint16 in mm, 0 invalid, for each pixel of a color image of ``shape``.

    Each measured pixel becomes a point, and the color pixels that it covers get its depth; where
    several points meet, the nearest one. Pixels that no point reaches are 0.
    """
    rows, columns = np.nonzero(depth_mm)
    points = unproject(depth_mm.astype(np.float32) * np.float32(1e-3), cameras.depth)[rows, columns]
    R, t = cameras.T_color_depth[:3, :3].astype(np.float32), cameras.T_color_depth[:3, 3]
    points = points @ R.T + t.astype(np.float32)
    points = points[points[:, 2] >= 5e-4]  # under half a millimetre, and behind
    millimetres = np.rint(points[:, 2] * 1e3)
    kept = np.flatnonzero(millimetres < NOTHING)
    far_first = kept[np.argsort(~millimetres[kept].astype(np.uint16), kind="stable")]  # radix sort
    values = millimetres[far_first].astype(np.uint16)
    pixels = project(points[far_first], cameras.color)
    registered = np.zeros(shape[0] * shape[1], np.uint16)
    spread = min(max(round(cameras.color.focal_px / cameras.depth.focal_px), 1), MAX_SPREAD)
    first = np.floor(pixels - np.float32(0.5 * (spread - 1) - 0.5)).astype(np.int32)
    for down in range(spread):
        for right in range(spread):
            u, v = first[:, 0] + right, first[:, 1] + down
            inside = (u >= 0) & (u < shape[1]) & (v >= 0) & (v < shape[0])
            one = np.zeros_like(registered)
            one[v[inside] * shape[1] + u[inside]] = values[inside]  # the nearest is written last
            registered = np.where(
                (one > 0) & ((registered == 0) | (one < registered)), one, registered
            )
    return registered.reshape(shape)
