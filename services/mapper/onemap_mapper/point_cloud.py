"""The depth image of a frame as map-frame points: unprojected once, read by everything else."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from onemap_mapper.kernels.cloud_planes import cloud_planes
from onemap_shared.camera import Intrinsics, unproject_to_map
from onemap_shared.geometry import F32, F64, Bool


@dataclass(frozen=True, slots=True)
class PointCloud:
    """An organised point cloud: one point per pixel, in image order.

    depth_m (H, W) float32 z-depth in metres, 0 = no return; points_m (H, W, 3) float32 metres in
    the map frame, the camera's position where there is no return; T_map_camera (4, 4).
    """

    depth_m: F32
    points_m: F32
    T_map_camera: F64

    @classmethod
    def of(
        cls,
        depth_m: F32,
        *,
        intrinsics: Intrinsics,
        T_map_camera: F64,
        stride: int = 1,
        compiled: bool = False,
    ) -> PointCloud:
        """The cloud of a depth image (H, W) float32 metres, thinned as by ``strided``.

        compiled: by the compiled loop, with the same result.
        """
        if compiled:
            pose, image = T_map_camera[:3].astype(np.float32), np.ascontiguousarray(depth_m)
            thinned, planes = cloud_planes(image, intrinsics.pixel_to_ray, pose, stride)
            return cls(thinned, np.moveaxis(planes, 0, -1), T_map_camera)
        depth_m = np.ascontiguousarray(depth_m[::stride, ::stride])
        points_m = unproject_to_map(depth_m, intrinsics, T_map_camera, stride=stride)
        return cls(depth_m, points_m, T_map_camera)

    @property
    def camera_m(self) -> F64:
        """The camera's position (3,) in the map frame."""
        position: F64 = self.T_map_camera[:3, 3]
        return position

    @property
    def planes_m(self) -> F32:
        """x, y, z (3, H, W) contiguous; no copy of a cloud that was not thinned afterwards."""
        return np.ascontiguousarray(np.moveaxis(self.points_m, -1, 0))

    def without(self, pixels: Bool) -> PointCloud:
        """The cloud without return at these pixels (H, W)."""
        depth_m, points_m = self.depth_m.copy(), np.copy(self.points_m, order="K")
        depth_m[pixels] = 0.0
        points_m[pixels] = self.camera_m.astype(np.float32)
        return PointCloud(depth_m, points_m, self.T_map_camera)

    def strided(self, n: int) -> PointCloud:
        """The cloud of every n-th pixel of every n-th row, without averaging; a view."""
        return PointCloud(self.depth_m[::n, ::n], self.points_m[::n, ::n], self.T_map_camera)
