"""Diagnostics of one depth image: the sensor and its mounting."""

from __future__ import annotations

from dataclasses import dataclass

from onemap_mapper.diagnostics.floor_monitor import CameraPose2D, camera_pose_2d
from onemap_mapper.diagnostics.level_surface import LevelSurface, lowest_level_surface
from onemap_mapper.point_cloud import PointCloud

NEAR_M = 0.1  # nothing a robot looks at is nearer: a wrong depth scale, or a covered lens
NEAR_LIMIT = 0.5  # of the pixels with a return
COUNTED_ROWS = 120  # of larger images some are left out when pixels are counted


@dataclass(frozen=True, slots=True)
class DepthDiagnostics:
    """Figures of one depth image.

    valid_fraction: of all pixels, those with a return; near_fraction: of these, those nearer than
    ``NEAR_M``; surface: the lowest level surface, floor or table, None if there was none;
    viewpoint: from where.
    """

    valid_fraction: float
    near_fraction: float
    viewpoint: CameraPose2D
    surface: LevelSurface | None = None

    @property
    def problem(self) -> str:
        """What is wrong with the sensor, in one sentence; empty if nothing is."""
        if self.valid_fraction == 0:
            return "the newest depth image is all zero: is the depth camera on and aligned?"
        if self.near_fraction > NEAR_LIMIT:
            return (
                f"{self.near_fraction:.0%} of the depth is nearer than {NEAR_M} m: "
                "is it in millimetres, and the lens free?"
            )
        return ""


def diagnose_depth(cloud: PointCloud, *, compiled: bool = False) -> DepthDiagnostics:
    """The diagnostics of one depth image; compiled: see ``lowest_level_surface``."""
    step = max(1, cloud.depth_m.shape[0] // COUNTED_ROWS)
    depth_m = cloud.depth_m[::step, ::step]
    valid = depth_m > 0
    near = float((depth_m[valid] < NEAR_M).mean()) if valid.any() else 0.0
    viewpoint = camera_pose_2d(cloud.T_map_camera)
    surface = lowest_level_surface(cloud, compiled=compiled)
    return DepthDiagnostics(float(valid.mean()), near, viewpoint, surface)
