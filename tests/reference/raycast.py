"""The slow twin of the renderer's tracing: every ray against every triangle."""

from __future__ import annotations

import numpy as np

from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import F32, F64, I32


def first_hits(
    vertices: F32, faces: I32, T_map_camera: F64, intrinsics: Intrinsics, size: tuple[int, int]
) -> tuple[F64, I32]:
    """z-depth (H, W) float64, 0 = no hit, and face index (H, W) int32, -1 = no hit.

    Moeller and Trumbore (1997) in float64 for an image of ``size`` (width, height).
    """
    width, height = size
    depth = np.zeros((height, width))
    face = np.full((height, width), -1, np.int32)
    corners = vertices[faces].astype(np.float64)
    first, edge1, edge2 = (
        corners[:, 0],
        corners[:, 1] - corners[:, 0],
        corners[:, 2] - corners[:, 0],
    )
    origin = T_map_camera[:3, 3]
    for row in range(height):
        for column in range(width):
            ray = np.array([intrinsics.x_at(column), intrinsics.y_at(row), 1.0])
            direction = T_map_camera[:3, :3] @ ray
            p = np.cross(direction, edge2)
            determinant = (edge1 * p).sum(axis=1)
            with np.errstate(divide="ignore", invalid="ignore"):
                s = origin - first
                u = (s * p).sum(axis=1) / determinant
                q = np.cross(s, edge1)
                v = (direction * q).sum(axis=1) / determinant
                t = (edge2 * q).sum(axis=1) / determinant
                hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0)
            if hit.any():
                nearest = int(np.argmin(np.where(hit, t, np.inf)))
                depth[row, column], face[row, column] = t[nearest], nearest
    return depth, face
