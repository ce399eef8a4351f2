"""Diagnostics of the sensor and its mounting: does the floor lie at z = 0?

One plane is fitted to each image, the lowest level one, in inverse depth: a plane is
n . (P - camera) = 1, so 1/depth = n . d is linear in the pixel's direction d, which is
(P - camera) / depth, and the noise of a depth camera, which grows with the square of the distance,
is the same for all pixels.

It may be a bed or a table. Only a plane on which several viewpoints agree shows that T_map_camera
is wrong; a floor near z = 0 in any of them shows that it is right.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache
from math import atan2, degrees, radians
from typing import NamedTuple

import numpy as np

from onemap_mapper.frame.cloud import PointCloud
from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import F64, Bool
from onemap_shared.messages import CameraView, FeatureField

RANGE_M = (0.3, 4.0)  # nearer is the robot itself; farther, noise is larger than a step
IMAGE_ROWS = 60  # larger images are thinned to this height: 5,000 pixels tell a plane
HEIGHT_RANGE_M = (-1.5, 0.6)  # higher are table tops; lower no error of a mounting
BAND_M = 0.1  # half the height of the layer of points from which a plane is begun
FITS = 5  # to what lies near the one before: the layer of a tilted floor holds a part of it
MAX_TILT_RAD = radians(12.0)  # an error of 5 degrees, and noise
OUTLIER = 3.0  # times the median residual: what lies farther off is no part of the plane,
RESIDUALS_PER_M = (0.005, 0.06)  # but within these, of 1/depth in 1/m: 6 cm at 1 m, 24 cm at 2 m
RIDGE = 1e-12  # keeps the fit solvable where a very long focal length makes all rays equal
MIN_SHARE = 0.02  # of the image's pixels; less is a shelf or a box, whose tilt is uncertain
MIN_TOGETHER = 0.75  # of its pixels have the next one in the row on it too; noise has few


@dataclass(frozen=True, slots=True)
class LevelSurface:
    """Mean height above z = 0 in metres where it is seen, and angle to the horizontal in rad."""

    height_m: float
    tilt_rad: float


def lowest_level_surface(cloud: PointCloud) -> LevelSurface | None:
    """The lowest level plane seen from above within 4 m; None if there is none."""
    step = max(1, cloud.depth_m.shape[0] // IMAGE_ROWS)
    depth, *xyz = (plane[::step, ::step].astype(np.float64) for plane in cloud.planes)
    used = (depth > RANGE_M[0]) & (depth < RANGE_M[1])
    q = np.divide(1.0, depth, out=np.zeros(depth.shape), where=used)
    rays = (np.stack(xyz, axis=-1) - cloud.T_map_camera[:3, 3]) * q[..., None]
    layers = np.arange(*HEIGHT_RANGE_M, BAND_M)
    enough = np.histogram(xyz[2][used], layers)[0] >= MIN_SHARE * used.size
    if not enough.any():
        return None
    height_m = layers[enough.argmax()] + BAND_M / 2
    members, n = used & (np.abs(xyz[2] - height_m) < BAND_M), np.zeros(3)
    for _ in range(FITS):
        if members.sum() < MIN_SHARE * used.size:
            return None
        n = _plane(rays[members], q[members])
        residuals = np.abs(q - rays @ n)
        limit = np.clip(OUTLIER * np.median(residuals[members]), *RESIDUALS_PER_M)
        members = used & (residuals < limit)
    tilt = float(np.arccos(np.clip(-n[2] / max(np.linalg.norm(n), RIDGE), -1.0, 1.0)))
    if tilt < MAX_TILT_RAD and _is_surface(members):
        return LevelSurface(float(xyz[2][members].mean()), tilt)
    return None


def _plane(rays: F64, q: F64) -> F64:
    """n (3,) of the plane nearest to inverse depths (k,) along rays (k, 3)."""
    n: F64 = np.linalg.solve(rays.T @ rays + RIDGE * np.eye(3), rays.T @ q)
    return n


def _is_surface(members: Bool) -> bool:
    """Whether pixels (H, W) are many enough, and together."""
    count, together = members.sum(), (members[:, :-1] & members[:, 1:]).sum()
    enough = count >= max(2.0, MIN_SHARE * members.size)
    return bool(enough and together >= MIN_TOGETHER * count)


# Obstacles begin at this height by default: a floor that appears higher becomes an obstacle.
HEIGHT_LIMIT_M = 0.10
# Depth of a correctly mounted camera is warped: a metre of floor appears tilted by up to 3.7
# degrees. An error of 5 degrees moves the floor by HEIGHT_LIMIT_M at little over a metre.
TILT_LIMIT_RAD = radians(4.0)
HEIGHT_TOLERANCE_M = 0.06  # between readings of one floor: noise of pose and depth
TILT_TOLERANCE_RAD = radians(2.0)  # between tilts of one floor
SAME_PLACE_M = 0.5  # a camera that moved this far is at another viewpoint
SAME_HEADING_RAD = radians(30.0)  # and one that turned this far
MIN_AGREEING = 4  # viewpoints, before the floor is reported as wrong
MIN_SPREAD_M = 2.0  # distance of the two farthest: longer than most furniture
MIN_SPREAD_RAD = radians(90.0)  # or largest turn between two: another part of the room
READING_LIFETIME_S = 60.0  # older readings are dropped: the pose may have been corrected


class CameraPose2D(NamedTuple):
    """Position of a camera in the map frame, and its heading."""

    x_m: float
    y_m: float
    heading_rad: float


def camera_pose_2d(T_map_camera: F64) -> CameraPose2D:
    """The pose seen from above; heading from the camera's x axis, which no pitch changes."""
    x_m, y_m = (float(value) for value in T_map_camera[:2, 3])
    return CameraPose2D(x_m, y_m, atan2(float(T_map_camera[0, 0]), -float(T_map_camera[1, 0])))


def _apart(one: F64, other: F64) -> tuple[F64, F64]:
    """Distances in metres and turns in radians (...) between poses (..., 3)."""
    moved = one - other
    turned_rad = np.abs((moved[..., 2] + np.pi) % (2 * np.pi) - np.pi)
    return np.hypot(moved[..., 0], moved[..., 1]), turned_rad


@dataclass(frozen=True, slots=True)
class FloorAssessment:
    """The floor over recent viewpoints, by their medians, and whether T_map_camera is wrong."""

    wrong: bool
    viewpoints: int
    height_m: float
    tilt_rad: float

    @property
    def problem(self) -> str:
        """What is wrong in one sentence; empty if nothing is."""
        if not self.wrong:
            return ""
        return (
            f"the floor appears at z = {self.height_m:+.2f} m, tilted by "
            f"{degrees(self.tilt_rad):.1f} degrees, from {self.viewpoints} viewpoints: "
            "check the camera's mounting (T_map_camera)"
        )


@dataclass(frozen=True, slots=True)
class FloorMonitor:
    """The newest level surface seen from each recent viewpoint. Immutable.

    readings (n, 6) float64: x, y, heading of the viewpoint, height, tilt, monotonic seconds.
    """

    readings: F64 = field(default_factory=lambda: np.zeros((0, 6)))

    def with_surface(
        self, surface: LevelSurface, viewpoint: CameraPose2D, now_s: float
    ) -> FloorMonitor:
        """The monitor after a frame.

        A viewpoint keeps its first pose, so that a robot that turns slowly reaches a new one every
        30 degrees.
        """
        recent = self.recent(now_s)
        moved_m, turned_rad = _apart(recent[:, :3], np.array(viewpoint))
        former = np.flatnonzero((moved_m < SAME_PLACE_M) & (turned_rad < SAME_HEADING_RAD))[:1]
        pose = recent[former[0], :3] if len(former) else viewpoint
        newest = (*pose, surface.height_m, surface.tilt_rad, now_s)
        return FloorMonitor(np.vstack([np.delete(recent, former, axis=0), newest]))

    def recent(self, now_s: float) -> F64:
        """The readings that count."""
        return self.readings[now_s - self.readings[:, 5] <= READING_LIFETIME_S]

    def assessment(self, now_s: float) -> FloorAssessment | None:
        """Right if any recent viewpoint shows the floor at z = 0, wrong if enough agree on another
        plane, None otherwise."""
        recent = self.recent(now_s)
        is_floor = np.abs(recent[:, 3]) <= HEIGHT_LIMIT_M
        floors = recent[is_floor & (recent[:, 4] <= TILT_LIMIT_RAD)]
        found = floors if len(floors) else _agreeing(recent)
        if len(found) == 0:
            return None
        height_m, tilt_rad = np.median(found[:, 3:5], axis=0).tolist()
        return FloorAssessment(len(floors) == 0, len(recent), height_m, tilt_rad)


def _agreeing(readings: F64) -> F64:
    """Those near the median, if they are enough, and so far apart that no single object fills all
    views; else none.

    Tilted surfaces are compared by tilt alone: with a pitch error the height depends on the
    distance.
    """
    if len(readings) < MIN_AGREEING:
        return readings[:0]
    heights_m, tilts_rad = readings[:, 3], readings[:, 4]
    if np.median(tilts_rad) > TILT_LIMIT_RAD:
        agrees = np.abs(tilts_rad - np.median(tilts_rad)) <= TILT_TOLERANCE_RAD
    else:
        agrees = np.abs(heights_m - np.median(heights_m)) <= HEIGHT_TOLERANCE_M
        agrees &= tilts_rad <= TILT_LIMIT_RAD
    agreed = readings[agrees]
    moved_m, turned_rad = _apart(agreed[:, None, :3], agreed[:, :3])
    spread = ((moved_m >= MIN_SPREAD_M) | (turned_rad >= MIN_SPREAD_RAD)).any()
    return agreed if len(agreed) >= MIN_AGREEING and spread else readings[:0]


@lru_cache(maxsize=8)  # not to be written
def _edge_rays(intrinsics: Intrinsics, height: int, width: int) -> F64:
    """Unit rays (4, 3), in the camera's axes, to the middles of left, right, upper, lower edge."""
    u, v = np.array([0, width, width / 2, width / 2]), np.array([height / 2, height / 2, 0, height])
    x, y = intrinsics.x_at(u - 0.5), intrinsics.y_at(v - 0.5)
    rays = np.stack([x, y, np.ones(4)], axis=-1)
    unit: F64 = rays / np.linalg.norm(rays, axis=-1, keepdims=True)
    return unit


def camera_view(field: FeatureField) -> CameraView:
    """What the camera of a frame has in its image; the floor is z = 0.

    The middles of the four edges decide, so that a camera may be mounted upright or upside down.
    """
    height, width = field.depth_mm.shape
    rays = _edge_rays(field.intrinsics, height, width) @ field.T_map_camera[:3, :3].T
    above_deg = np.degrees(np.arcsin(np.clip(rays[:, 2], -1.0, 1.0)))
    height_m = float(field.T_map_camera[2, 3])
    left, right = min((rays[:2], rays[2:]), key=lambda pair: abs(pair[0, 2] - pair[1, 2]))
    across_deg = float(np.degrees(np.arccos(np.clip(left @ right, -1.0, 1.0))))
    return CameraView(height_m, -float(above_deg.min()), float(above_deg.max()), across_deg)


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


DIAGNOSIS_PERIOD_NS = 10**9  # of a robot's clock: the mounting changes no faster


def diagnosis_due(stamp_ns: int, last_ns: int | None) -> bool:
    """Whether a frame is to be diagnosed, by its stamp and that of the last one that was.

    A clock that was set back does not stop diagnoses.
    """
    return last_ns is None or abs(stamp_ns - last_ns) >= DIAGNOSIS_PERIOD_NS


def diagnose_depth(cloud: PointCloud) -> DepthDiagnostics:
    """The diagnostics of one depth image."""
    step = max(1, cloud.depth_m.shape[0] // COUNTED_ROWS)
    depth_m = cloud.depth_m[::step, ::step]
    valid = depth_m > 0
    near = float((depth_m[valid] < NEAR_M).mean()) if valid.any() else 0.0
    viewpoint = camera_pose_2d(cloud.T_map_camera)
    surface = lowest_level_surface(cloud)
    return DepthDiagnostics(float(valid.mean()), near, viewpoint, surface)
