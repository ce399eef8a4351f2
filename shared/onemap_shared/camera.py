"""The pinhole camera: pixel rays, strides and unprojection.

No other module computes with focal lengths and principal points.

Camera frame (optical): x right, y down, z forward, metres. Pixel centres lie at half-integer
image coordinates: pixel column u (0-based index) is centred at u + 0.5.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from onemap_shared.geometry import F32, F64

MAX_TANGENT = 20.0  # of a pixel's ray against the optical axis, 87 degrees: wider is no pinhole

X = TypeVar("X")  # float, NumPy array or torch tensor


@dataclass(frozen=True, slots=True)
class Intrinsics:
    """A pinhole camera without distortion, in pixels. Pixel centres lie at half-integers.

    Attributes:
        fx: horizontal focal length, > 0.
        fy: vertical focal length, > 0.
        cx: horizontal coordinate of the principal point, from the left edge.
        cy: vertical coordinate of the principal point, from the upper edge.
    """

    fx: float
    fy: float
    cx: float
    cy: float

    def __post_init__(self) -> None:
        values = (self.fx, self.fy, self.cx, self.cy)
        if not np.isfinite(values).all() or self.fx <= 0 or self.fy <= 0:
            raise ValueError(
                f"intrinsics fx={self.fx} fy={self.fy} cx={self.cx} cy={self.cy}: "
                "focal lengths must be positive and all values finite"
            )

    @classmethod
    def from_fov(cls, width: int, height: int, horizontal_fov_rad: float) -> Intrinsics:
        """The camera with square pixels whose image spans ``horizontal_fov_rad``."""
        focal = 0.5 * width / np.tan(0.5 * horizontal_fov_rad)
        return cls(float(focal), float(focal), width / 2, height / 2)

    def scaled(self, scale_x: float, scale_y: float) -> Intrinsics:
        """The same camera after its image was resized by these factors."""
        return Intrinsics(
            self.fx * scale_x, self.fy * scale_y, self.cx * scale_x, self.cy * scale_y
        )

    def x_at(self, u: X) -> X:
        """x at depth 1 of pixel columns ``u`` (0-based indices); the dtype follows ``u``."""
        return (u + (0.5 - self.cx)) / self.fx  # type: ignore[operator, return-value]

    def y_at(self, v: X) -> X:
        """y at depth 1 of pixel rows ``v`` (0-based indices); the dtype follows ``v``."""
        return (v + (0.5 - self.cy)) / self.fy  # type: ignore[operator, return-value]

    @property
    def pixel_to_ray(self) -> F32:
        """(0.5 - cx, 0.5 - cy, fx, fy) float32, for compiled loops over pixels (u, v).

        x at depth 1 is (u + [0]) / [2], y is (v + [1]) / [3], as ``x_at`` and ``y_at``.
        """
        return np.array([0.5 - self.cx, 0.5 - self.cy, self.fx, self.fy], np.float32)

    def check_image(self, width: int, height: int) -> None:
        """Raise ValueError if an image of this size would look further aside than a pinhole can.

        Otherwise a tiny focal length puts points kilometres away.
        """
        x = max(abs(self.x_at(0.0)), abs(self.x_at(width - 1.0)))
        y = max(abs(self.y_at(0.0)), abs(self.y_at(height - 1.0)))
        if max(x, y) > MAX_TANGENT:
            raise ValueError(
                f"intrinsics fx={self.fx:g} fy={self.fy:g} cx={self.cx:g} cy={self.cy:g} let "
                f"{width} x {height} pixels see {max(x, y):.3g} m aside at 1 m; the limit is "
                f"{MAX_TANGENT:g}: are they in pixels of this image?"
            )

    @property
    def focal_px(self) -> float:
        """Horizontal focal length: pixels per unit of x at depth 1."""
        return self.fx

    def size_over_focal(self, width: int, height: int) -> tuple[float, float]:
        """Image width over fx and height over fy: the extent of the view at depth 1."""
        return width / self.fx, height / self.fy


def ray_directions(intrinsics: Intrinsics, width: int, height: int) -> F32:
    """Camera-frame directions (H, W, 3) float32 of all pixels, scaled to z = 1.

    With this scale the length along a ray, in units of its direction, is the z-depth.
    """
    directions = np.ones((height, width, 3), np.float32)
    directions[..., 0] = intrinsics.x_at(np.arange(width))
    directions[..., 1] = intrinsics.y_at(np.arange(height))[:, None]
    return directions


def unproject_to_map(depth_m: F32, intrinsics: Intrinsics, T_map_camera: F64) -> F32:
    """Map-frame points (H, W, 3) float32, metres, of z-depth (H, W) float32.

    A view of three planes, one per coordinate. Where the depth is 0, the point is the camera's
    position.
    """
    height, width = depth_m.shape
    R, t = T_map_camera[:3, :3].astype(np.float32), T_map_camera[:3, 3].astype(np.float32)
    u = np.arange(width, dtype=np.float32)
    v = np.arange(height, dtype=np.float32)[:, None]
    # Multiply before dividing: walls that lie on a cell border fall on the released code's side.
    x = (u + (0.5 - intrinsics.cx)) * depth_m / intrinsics.fx
    y = (v + (0.5 - intrinsics.cy)) * depth_m / intrinsics.fy
    planes = np.empty((3, height, width), np.float32)
    for k in range(3):
        planes[k] = x * R[k, 0] + y * R[k, 1] + depth_m * R[k, 2] + t[k]
    return np.moveaxis(planes, 0, -1)
