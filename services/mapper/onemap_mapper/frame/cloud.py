"""The depth image of a frame as map-frame points: unprojected once, read by everything else."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import torch
from torch import Tensor

from onemap_mapper.jit import AVAILABLE, compiled
from onemap_shared.camera import Intrinsics, unproject_to_map
from onemap_shared.geometry import F32, F64, Bool


@compiled
def cloud_planes(depth_m: F32, pixel_to_ray: F32, pose: F32, stride: int) -> tuple[F32, F32]:
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
    ) -> PointCloud:
        """The cloud of a depth image (H, W) float32 metres, thinned as by ``strided``."""
        if AVAILABLE:
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


@dataclass(frozen=True, slots=True)
class DeviceCloud:
    """An organised point cloud in planes: one point per pixel, in image order.

    depth_m (H, W) float32 z-depth in metres, 0 = no return; x_m, y_m, z_m (H, W) float32 metres in
    the map frame, the camera's position where there is no return; T_map_camera (4, 4), on the host.
    """

    depth_m: Tensor
    x_m: Tensor
    y_m: Tensor
    z_m: Tensor
    T_map_camera: F64

    @classmethod
    def of(cls, depth_m: Tensor, *, intrinsics: Intrinsics, T_map_camera: F64) -> DeviceCloud:
        """The cloud of a depth image (H, W) float32 metres, as ``camera.unproject_to_map``."""
        height, width = depth_m.shape
        R, t = (part.astype(np.float32).tolist() for part in np.split(T_map_camera[:3], [3], 1))
        u = torch.arange(width, device=depth_m.device, dtype=torch.float32)
        v = torch.arange(height, device=depth_m.device, dtype=torch.float32)[:, None]
        left, top, fx, fy = intrinsics.pixel_to_ray.tolist()
        # Multiplied first, as on the host.
        x, y = divided((u + left) * depth_m, fx), divided((v + top) * depth_m, fy)
        x_m, y_m, z_m = (
            x * row[0] + y * row[1] + depth_m * row[2] + at[0] for row, at in zip(R, t, strict=True)
        )
        return cls(depth_m, x_m, y_m, z_m, T_map_camera)

    @property
    def camera_m(self) -> tuple[float, float, float]:
        """The camera's position in the map frame, rounded to float32 as the points are."""
        x_m, y_m, z_m = self.T_map_camera[:3, 3].astype(np.float32).tolist()
        return x_m, y_m, z_m

    def without(self, pixels: Tensor) -> DeviceCloud:
        """The cloud without return at these pixels (H, W)."""
        x_m, y_m, z_m = self.camera_m
        return replace(
            self,
            depth_m=self.depth_m.masked_fill(pixels, 0.0),
            x_m=self.x_m.masked_fill(pixels, x_m),
            y_m=self.y_m.masked_fill(pixels, y_m),
            z_m=self.z_m.masked_fill(pixels, z_m),
        )

    def strided(self, rows: int, columns: int) -> DeviceCloud:
        """The cloud of every so manieth pixel of every so manieth row, without averaging."""
        depth_m, x_m, y_m, z_m = (
            plane[::rows, ::columns].contiguous()
            for plane in (self.depth_m, self.x_m, self.y_m, self.z_m)
        )
        return DeviceCloud(depth_m, x_m, y_m, z_m, self.T_map_camera)

    def points(self, pixels: Tensor) -> Tensor:
        """Points (n, 3) of the chosen pixels (H, W), in image order."""
        return torch.stack([plane[pixels] for plane in (self.x_m, self.y_m, self.z_m)], dim=1)


def divided(values: Tensor, by: float) -> Tensor:
    """values / by, rounded as on the CPU: a GPU would multiply by the inverse of a plain number."""
    return values / values.new_full((), by)


def lengths(vectors: Tensor) -> Tensor:
    """Lengths (n,) float32 of vectors (n, 2 or 3), rounded as NumPy does.

    A square root of torch in float32 may differ in the last place.
    """
    squares = vectors.square().unbind(dim=1)
    total = squares[0]
    for square in squares[1:]:
        total = total + square
    return total.double().sqrt().float()


def cells_of(places: Tensor, cell_size_m: float) -> Tensor:
    """World cells (..., 2) int64 of places (..., 2 or more) in metres, as ``GridSpec.cells``."""
    return divided(places[..., :2].double(), cell_size_m).floor().long()
