"""The depth image of a frame as map-frame points: unprojected once, read by everything else."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import F32, F64, Bool
from onemap_shared.jit import compiled


@compiled
def cloud_planes(depth_m: F32, pixel_to_ray: F32, pose: F32, stride: int) -> F32:
    """Depth and x, y, z in the map frame, metres, (4, h, w), of every so manieth pixel.

    In the arithmetic of ``camera.unproject_to_map``, to the last bit. depth_m (H, W); pixel_to_ray:
    of ``Intrinsics``; pose (3, 4) float32: T_map_camera's upper rows.
    """
    height, width = -(-depth_m.shape[0] // stride), -(-depth_m.shape[1] // stride)
    from_left, from_top, fx, fy = pixel_to_ray
    planes = np.empty((4, height, width), np.float32)
    columns = np.empty(width, np.float32)
    for j in range(width):
        columns[j] = np.float32(j * stride) + from_left
    for i in range(height):
        of_row, line = depth_m[i * stride], planes[0, i]
        for j in range(width):
            line[j] = of_row[j * stride]
        row = np.float32(i * stride) + from_top
        for k in range(3):
            r_x, r_y, r_z, t = pose[k]
            plane = planes[k + 1, i]
            for j in range(width):
                d = line[j]
                plane[j] = columns[j] * d / fx * r_x + row * d / fy * r_y + d * r_z + t
    return planes


@dataclass(frozen=True, slots=True)
class PointCloud:
    """An organised point cloud in planes: one point per pixel, in image order.

    T_map_camera (4, 4); depth_m (H, W) float32 z-depth in metres, 0 = no return; x_m, y_m, z_m
    (H, W) float32 metres in the map frame, of no meaning without return. All are contiguous.
    """

    T_map_camera: F64
    depth_m: F32
    x_m: F32
    y_m: F32
    z_m: F32

    @classmethod
    def of(
        cls, depth_m: F32, *, intrinsics: Intrinsics, T_map_camera: F64, stride: int = 1
    ) -> PointCloud:
        """The cloud of every so manieth pixel of a depth image (H, W) float32 metres."""
        image, pose = np.ascontiguousarray(depth_m), T_map_camera[:3].astype(np.float32)
        return cls(T_map_camera, *cloud_planes(image, intrinsics.pixel_to_ray, pose, stride))

    @property
    def camera_m(self) -> F32:
        """The camera's position (3,) in the map frame, rounded to float32 as the points are."""
        return self.T_map_camera[:3, 3].astype(np.float32)

    @property
    def planes(self) -> tuple[F32, F32, F32, F32]:
        """Depth, x, y and z (H, W)."""
        return self.depth_m, self.x_m, self.y_m, self.z_m

    def without(self, pixels: Bool) -> PointCloud:
        """The cloud without return at these pixels (H, W)."""
        return replace(self, depth_m=np.where(pixels, np.float32(0), self.depth_m))
