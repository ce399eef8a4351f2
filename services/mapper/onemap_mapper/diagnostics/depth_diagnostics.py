"""What a depth image says about the sensor and its mounting, for diagnosis."""

from __future__ import annotations

from dataclasses import dataclass

from onemap_mapper.diagnostics.floor_monitor import CameraPose2D, camera_pose_2d
from onemap_mapper.diagnostics.level_surface import LevelSurface, lowest_level_surface
from onemap_mapper.point_cloud import PointCloud

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


def diagnose_depth(cloud: PointCloud) -> DepthDiagnostics:
    """The diagnostics of one depth image."""
    step = STRIDE if min(cloud.depth_m.shape) >= STRIDE * 30 else 1
    depth_m = cloud.depth_m[::step, ::step]
    valid = depth_m > 0
    near = float((depth_m[valid] < NEAR_M).mean()) if valid.any() else 0.0
    viewpoint = camera_pose_2d(cloud.T_map_camera)
    return DepthDiagnostics(float(valid.mean()), near, viewpoint, lowest_level_surface(cloud))
