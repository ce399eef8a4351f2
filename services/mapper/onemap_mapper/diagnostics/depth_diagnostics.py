"""What a depth image says about the sensor and its mounting, for diagnosis."""

from __future__ import annotations

from dataclasses import dataclass

from onemap_mapper.diagnostics.floor_monitor import Viewpoint, viewpoint_of
from onemap_mapper.diagnostics.level_surface import LevelSurface, lowest_level_surface
from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import F32, F64

NEAR_M = 0.1  # nothing a robot looks at is nearer: a wrong depth scale, or a covered lens
STRIDE = 4


@dataclass(frozen=True, slots=True)
class DepthCheck:
    """valid_fraction: pixels with a return; near_fraction: of those, nearer than 0.1 m.

    surface: the lowest level surface seen, which may be the floor or a table, None if there was
    none; viewpoint: from where.
    """

    valid_fraction: float
    near_fraction: float
    viewpoint: Viewpoint
    surface: LevelSurface | None = None


def check_depth(depth_m: F32, *, intrinsics: Intrinsics, T_map_camera: F64) -> DepthCheck:
    """Check one image (H, W) float32 metres, 0 = none."""
    step = STRIDE if min(depth_m.shape) >= STRIDE * 30 else 1
    depth = depth_m[::step, ::step]
    valid = depth > 0
    near = float((depth[valid] < NEAR_M).mean()) if valid.any() else 0.0
    surface = lowest_level_surface(depth_m, intrinsics=intrinsics, T_map_camera=T_map_camera)
    return DepthCheck(float(valid.mean()), near, viewpoint_of(T_map_camera), surface)
