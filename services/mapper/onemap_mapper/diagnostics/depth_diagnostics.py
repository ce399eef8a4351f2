"""What a depth image says about the sensor and its mounting, for diagnosis."""

from __future__ import annotations

from dataclasses import dataclass

from onemap_mapper.diagnostics.floor_monitor import CameraPose2D, camera_pose_2d
from onemap_mapper.diagnostics.level_surface import LevelSurface, lowest_level_surface
from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import F32, F64

NEAR_M = 0.1  # nothing a robot looks at is nearer: a wrong depth scale, or a covered lens
STRIDE = 4


@dataclass(frozen=True, slots=True)
class DepthDiagnostics:
    """valid_fraction: pixels with a return; near_fraction: of those, nearer than 0.1 m.

    surface: the lowest level surface seen, which may be the floor or a table, None if there was
    none; viewpoint: from where.
    """

    valid_fraction: float
    near_fraction: float
    viewpoint: CameraPose2D
    surface: LevelSurface | None = None


def diagnose_depth(depth_m: F32, *, intrinsics: Intrinsics, T_map_camera: F64) -> DepthDiagnostics:
    """Check one image (H, W) float32 metres, 0 = none."""
    step = STRIDE if min(depth_m.shape) >= STRIDE * 30 else 1
    depth = depth_m[::step, ::step]
    valid = depth > 0
    near = float((depth[valid] < NEAR_M).mean()) if valid.any() else 0.0
    surface = lowest_level_surface(depth_m, intrinsics=intrinsics, T_map_camera=T_map_camera)
    return DepthDiagnostics(float(valid.mean()), near, camera_pose_2d(T_map_camera), surface)
