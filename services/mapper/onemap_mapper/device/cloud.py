"""``PointCloud`` on a device."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import torch
from torch import Tensor

from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import F64


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
