"""The depth image of a frame as map-frame points: unprojected once, read by everything else."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import torch
from torch import Tensor

from onemap_mapper import jit
from onemap_mapper.jit import compiled
from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import F32, F64


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

    T_map_camera (4, 4), on the host; depth_m (H, W) float32 z-depth in metres, 0 = no return; x_m,
    y_m, z_m (H, W) float32 metres in the map frame, of no meaning without return.
    """

    T_map_camera: F64
    depth_m: Tensor
    x_m: Tensor
    y_m: Tensor
    z_m: Tensor

    @classmethod
    def of(
        cls, depth_m: F32 | Tensor, *, intrinsics: Intrinsics, T_map_camera: F64, stride: int = 1
    ) -> PointCloud:
        """The cloud of a depth image (H, W) float32 metres, thinned; by torch, of a tensor."""
        pose, pixel_to_ray = T_map_camera[:3].astype(np.float32), intrinsics.pixel_to_ray
        if not isinstance(depth_m, Tensor):
            if jit.AVAILABLE:
                image = np.ascontiguousarray(depth_m)
                planes = cloud_planes(image, pixel_to_ray, pose, stride)
                return cls(T_map_camera, *torch.from_numpy(planes).unbind())
            depth_m = torch.from_numpy(depth_m)
        v, u = (
            torch.arange(0, pixels, stride, device=depth_m.device, dtype=torch.float32)
            for pixels in depth_m.shape
        )
        depth_m = depth_m[::stride, ::stride].contiguous()
        left, top, fx, fy = pixel_to_ray.tolist()
        # Multiplied first, as on the host.
        x, y = divided((u + left) * depth_m, fx), divided((v[:, None] + top) * depth_m, fy)
        x_m, y_m, z_m = (x * a + y * b + depth_m * c + at for a, b, c, at in pose.tolist())
        return cls(T_map_camera, depth_m, x_m, y_m, z_m)

    @property
    def camera_m(self) -> tuple[float, float, float]:
        """The camera's position in the map frame, rounded to float32 as the points are."""
        x_m, y_m, z_m = self.T_map_camera[:3, 3].astype(np.float32).tolist()
        return x_m, y_m, z_m

    @property
    def planes(self) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """Depth, x, y and z (H, W)."""
        return self.depth_m, self.x_m, self.y_m, self.z_m

    def arrays(self) -> tuple[F32, F32, F32, F32]:
        """The planes as contiguous arrays, for compiled code."""
        depth, x, y, z = (plane.contiguous().numpy() for plane in self.planes)
        return depth, x, y, z

    def without(self, pixels: Tensor) -> PointCloud:
        """The cloud without return at these pixels (H, W)."""
        return replace(self, depth_m=torch.where(pixels, 0.0, self.depth_m))

    def strided(self, rows: int, columns: int) -> PointCloud:
        """The cloud of every so manieth pixel of every so manieth row, a view."""
        thinned = (plane[::rows, ::columns] for plane in self.planes)
        return PointCloud(self.T_map_camera, *thinned)

    def points(self, pixels: Tensor) -> Tensor:
        """Points (n, 3) of the chosen pixels (H, W), in image order."""
        at = torch.nonzero(pixels, as_tuple=True)
        return torch.stack([plane[at] for plane in (self.x_m, self.y_m, self.z_m)], dim=1)


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
