"""Diagnostics of the sensor and its mounting: does the floor lie at z = 0?

The lowest level surface of an image: it is divided into tiles and a plane is fitted to each, in
inverse depth: a plane is n . (P - camera) = 1, so 1/depth = n . d is linear in the pixel's
direction d, which is (P - camera) / depth, and the noise of a depth camera, which grows with the
square of the distance, is the same for all pixels. Tiles that face up and touch each other at one
height make a surface. Walls, fronts of furniture, ramps and noise make none.

It may be a bed or a table. Only a surface on which several viewpoints agree shows that
T_map_camera is wrong; a floor near z = 0 in any of them shows that it is right.
"""

from __future__ import annotations

import statistics
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from functools import lru_cache
from itertools import combinations
from math import atan2, degrees, hypot, radians

import numpy as np

from onemap_mapper.frame.cloud import PointCloud
from onemap_mapper.jit import compiled
from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import F32, F64, I64, Bool, wrap_angle
from onemap_shared.messages import CameraView, FeatureField


@compiled
def tile_sums(
    planes: tuple[F32, F32, F32, F32], camera_m: F64, side: int, range_m: tuple[float, float]
) -> F64:
    """Per tile of side x side pixels (rows, columns, 5, 5): the sum of v v^T over its pixels.

    v = (d, q, 1) with the direction d = (point - camera) / depth and q = 1 / depth of pixels in
    range. planes: depth, x, y, z (H, W).
    """
    depths, x, y, z = planes
    rows, columns = depths.shape[0] // side, depths.shape[1] // side
    sums = np.zeros((rows, columns, 5, 5))
    for i in range(rows * side):
        for j in range(columns * side):
            depth = np.float64(depths[i, j])
            if depth <= range_m[0] or depth >= range_m[1]:
                continue
            q = 1.0 / depth
            dx, dy, dz = x[i, j] - camera_m[0], y[i, j] - camera_m[1], z[i, j] - camera_m[2]
            v = (dx * q, dy * q, dz * q, q, 1.0)
            tile = sums[i // side, j // side]
            for k in range(5):
                for m in range(k + 1):
                    tile[k, m] += v[k] * v[m]
    for i in range(rows):
        for j in range(columns):
            tile = sums[i, j]
            for k in range(5):
                for m in range(k):
                    tile[m, k] = tile[k, m]
    return sums


@compiled
def connected(across: Bool, down: Bool) -> I64:
    """The least number (rows, columns), row by row, of any tile that each is connected with.

    across (rows, columns - 1), down (rows - 1, columns): whether a tile is with the next one.
    """
    rows, columns = len(across), down.shape[1]
    labels = np.arange(rows * columns).reshape(rows, columns)
    changed = True
    while changed:
        changed = False
        for i in range(rows):
            for j in range(columns):
                least = labels[i, j]
                if j > 0 and across[i, j - 1]:
                    least = min(least, labels[i, j - 1])
                if j < columns - 1 and across[i, j]:
                    least = min(least, labels[i, j + 1])
                if i > 0 and down[i - 1, j]:
                    least = min(least, labels[i - 1, j])
                if i < rows - 1 and down[i, j]:
                    least = min(least, labels[i + 1, j])
                changed |= least < labels[i, j]
                labels[i, j] = least
    return labels


RANGE_M = (0.3, 4.0)  # nearer is the robot itself; farther, a tile of floor is a metre long
IMAGE_ROWS = 120  # larger images are thinned to this height: 8 x 8 pixels a tile are enough
TILE_ROWS = 15  # tiles in a column of the image
TILE_MIN_PX = 8
TILE_MIN_VALID = 0.75  # of its pixels
MAX_RESIDUAL_PER_M = 0.03  # rms of 1/depth in 1/m: 3 cm of noise at 1 m, 12 cm at 2 m
MAX_TILT_RAD = float(np.deg2rad(12.0))  # an error of 5 degrees, and the noise of one tile
MAX_STEP_M = 0.03  # between neighbouring tiles of one surface
RIDGE = 1e-12  # keeps the fit solvable where a very long focal length makes all rays equal
MIN_SHARE = 0.02  # of the image's tiles; less is a shelf or a box, whose tilt is uncertain


@dataclass(frozen=True, slots=True)
class LevelSurface:
    """Mean height above z = 0 in metres where it is seen, and angle to the horizontal in rad."""

    height_m: float
    tilt_rad: float


@dataclass(frozen=True, slots=True)
class _Tiles:
    """Planes of the tiles, in image order (rows, columns).

    AtA (..., 3, 3) and Atq (..., 3): normal equations of 1/depth over the ray directions;
    n (..., 3) the plane, NaN where none fits; centres (..., 3) metres. All in the map's axes.
    """

    AtA: F64
    Atq: F64
    n: F64
    centres: F64


def lowest_level_surface(cloud: PointCloud) -> LevelSurface | None:
    """The lowest level surface seen from above within 4 m; None if there is none."""
    step = max(1, cloud.depth_m.shape[0] // IMAGE_ROWS)
    cloud = cloud.strided(step)
    tiles = _fit(cloud)
    up = -_unit(tiles.n)  # n points away from the camera
    level = np.nan_to_num(up[..., 2], nan=-1.0) > np.cos(MAX_TILT_RAD)
    labels = connected(
        _continues(tiles.centres, up, level, axis=1), _continues(tiles.centres, up, level, axis=0)
    )
    sizes = np.bincount(labels[level], minlength=level.size)
    large = np.flatnonzero(sizes >= max(2.0, MIN_SHARE * level.size))
    surfaces = [_surface(tiles, labels == label) for label in large]
    return min(surfaces, key=lambda surface: surface.height_m, default=None)


def _fit(cloud: PointCloud) -> _Tiles:
    side = max(TILE_MIN_PX, cloud.depth_m.shape[0] // TILE_ROWS)
    camera_m = cloud.T_map_camera[:3, 3].copy()
    sums = tile_sums(cloud.planes, camera_m, side, RANGE_M)
    AtA, Atq = sums[..., :3, :3] + RIDGE * np.eye(3), sums[..., :3, 3]
    squares, count = sums[..., 3, 3], sums[..., 4, 4]
    full = count >= TILE_MIN_VALID * side**2
    n = np.full(Atq.shape, np.nan)
    n[full] = np.linalg.solve(AtA[full], Atq[full][..., None])[..., 0]
    residuals = squares - (n * Atq).sum(axis=-1)  # their squares, at the minimum
    n[~(residuals <= MAX_RESIDUAL_PER_M**2 * count)] = np.nan
    centre_rays = sums[..., :3, 4] / np.maximum(count, 1)[..., None]
    inverse_depth = (centre_rays * n).sum(axis=-1)
    inverse_depth[~(inverse_depth > 0)] = np.nan
    return _Tiles(AtA, Atq, n, centre_rays / inverse_depth[..., None] + camera_m)


def _unit(vectors: F64) -> F64:
    unit: F64 = vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
    return unit


def _continues(centres: F64, up: F64, level: Bool, *, axis: int) -> Bool:
    """Which level tiles lie in the plane of the next one along an axis, by both's mean normal."""
    before = (slice(-1), slice(None))[:: 1 - 2 * axis]
    after = (slice(1, None), slice(None))[:: 1 - 2 * axis]
    step = centres[after] - centres[before]
    apart = (_unit(up[before] + up[after]) * step).sum(axis=-1)
    linked = np.abs(np.nan_to_num(apart, nan=np.inf)) < MAX_STEP_M
    found: Bool = linked & level[before] & level[after]
    return found


def _surface(tiles: _Tiles, members: Bool) -> LevelSurface:
    n = np.linalg.solve(tiles.AtA[members].sum(axis=0), tiles.Atq[members].sum(axis=0))
    tilt = float(np.arccos(np.clip(-_unit(n)[2], -1.0, 1.0)))
    return LevelSurface(float(tiles.centres[members][:, 2].mean()), tilt)


# Obstacles begin at this height by default: a floor that appears higher becomes an obstacle.
HEIGHT_LIMIT_M = 0.10
# Depth of a correctly mounted camera is warped: a metre of floor appears tilted by up to 3.7
# degrees. An error of 5 degrees moves the floor by HEIGHT_LIMIT_M at little over a metre.
TILT_LIMIT_RAD = radians(4.0)
HEIGHT_RANGE_M = (-1.5, 0.6)  # higher are table tops; lower no error of a mounting
HEIGHT_TOLERANCE_M = 0.06  # between readings of one floor: noise of pose and depth
TILT_TOLERANCE_RAD = radians(2.0)  # between tilts of one floor
SAME_PLACE_M = 0.5  # a camera that moved this far is at another viewpoint
SAME_HEADING_RAD = radians(30.0)  # and one that turned this far
MIN_AGREEING = 4  # viewpoints, before the floor is reported as inconsistent
MIN_SPREAD_M = 2.0  # distance of the two farthest: longer than most furniture
MIN_SPREAD_RAD = radians(90.0)  # or largest turn between two: another part of the room
READING_LIFETIME_S = 60.0  # older readings are dropped: the pose may have been corrected


@dataclass(frozen=True, slots=True)
class CameraPose2D:
    """Position of a camera in the map frame, and its heading."""

    x_m: float
    y_m: float
    heading_rad: float

    def offset_to(self, other: CameraPose2D) -> tuple[float, float]:
        """Distance in metres and turn in radians between the two."""
        turn = abs(wrap_angle(self.heading_rad - other.heading_rad))
        return hypot(self.x_m - other.x_m, self.y_m - other.y_m), turn

    def is_near(self, other: CameraPose2D) -> bool:
        """Whether both are one viewpoint: they see the same part of the room."""
        moved_m, turned_rad = self.offset_to(other)
        return moved_m < SAME_PLACE_M and turned_rad < SAME_HEADING_RAD


def camera_pose_2d(T_map_camera: F64) -> CameraPose2D:
    """The pose seen from above; heading from the camera's x axis, which no pitch changes."""
    x_m, y_m = (float(value) for value in T_map_camera[:2, 3])
    return CameraPose2D(x_m, y_m, atan2(float(T_map_camera[0, 0]), -float(T_map_camera[1, 0])))


@dataclass(frozen=True, slots=True)
class SurfaceReading:
    """The newest level surface seen from a viewpoint, at monotonic seconds ``at_s``."""

    viewpoint: CameraPose2D
    surface: LevelSurface
    at_s: float

    @property
    def is_floor(self) -> bool:
        return (
            abs(self.surface.height_m) <= HEIGHT_LIMIT_M and self.surface.tilt_rad <= TILT_LIMIT_RAD
        )


class FloorState(Enum):
    """Whether the floor agrees with T_map_camera."""

    UNKNOWN = "unknown"
    CONSISTENT = "consistent"
    INCONSISTENT = "inconsistent"


@dataclass(frozen=True, slots=True)
class FloorAssessment:
    """The floor over all recent viewpoints.

    viewpoints: how many saw a level surface; height_m and tilt_rad of the floor, NaN if unknown.
    """

    state: FloorState
    viewpoints: int = 0
    height_m: float = float("nan")
    tilt_rad: float = float("nan")

    @property
    def problem(self) -> str:
        """What is wrong in one sentence; empty if nothing is, or if it is unknown."""
        if self.state is not FloorState.INCONSISTENT:
            return ""
        return (
            f"the floor appears at z = {self.height_m:+.2f} m, tilted by "
            f"{degrees(self.tilt_rad):.1f} degrees, from {self.viewpoints} viewpoints: "
            "check the camera's mounting (T_map_camera)"
        )


@dataclass(frozen=True, slots=True)
class FloorMonitor:
    """The recent readings, one per viewpoint. Immutable."""

    readings: tuple[SurfaceReading, ...] = ()

    def with_surface(
        self, surface: LevelSurface, viewpoint: CameraPose2D, now_s: float
    ) -> FloorMonitor:
        """The monitor after a frame.

        A viewpoint keeps its first pose, so that a robot that turns slowly reaches a new one every
        30 degrees.
        """
        recent = self._recent(now_s)
        former = next((r for r in recent if r.viewpoint.is_near(viewpoint)), None)
        others = tuple(r for r in recent if r is not former)
        if former is not None:
            viewpoint = former.viewpoint
        return FloorMonitor((*others, SurfaceReading(viewpoint, surface, now_s)))

    def assessment(self, now_s: float) -> FloorAssessment:
        """Consistent if any recent viewpoint shows the floor at z = 0, inconsistent if enough agree
        on another plane, unknown otherwise."""
        recent = self._recent(now_s)
        floors = [reading for reading in recent if reading.is_floor]
        if floors:
            return _assessment_of(FloorState.CONSISTENT, floors, len(recent))
        low, high = HEIGHT_RANGE_M
        plausible = [r for r in recent if low <= r.surface.height_m <= high]
        agreed = max((_agreeing(plausible, seed) for seed in plausible), key=len, default=[])
        if len(agreed) >= MIN_AGREEING and _spread(agreed):
            return _assessment_of(FloorState.INCONSISTENT, agreed, len(recent))
        return FloorAssessment(FloorState.UNKNOWN, len(recent))

    def _recent(self, now_s: float) -> tuple[SurfaceReading, ...]:
        return tuple(r for r in self.readings if now_s - r.at_s <= READING_LIFETIME_S)


def _agreeing(readings: Sequence[SurfaceReading], seed: SurfaceReading) -> list[SurfaceReading]:
    """The readings that may be of the same plane as ``seed``.

    Tilted surfaces are compared by tilt alone: with a pitch error the height depends on the
    distance.
    """
    tilted = seed.surface.tilt_rad > TILT_LIMIT_RAD
    return [
        r
        for r in readings
        if (r.surface.tilt_rad > TILT_LIMIT_RAD) == tilted
        and (
            abs(r.surface.tilt_rad - seed.surface.tilt_rad) <= TILT_TOLERANCE_RAD
            if tilted
            else abs(r.surface.height_m - seed.surface.height_m) <= HEIGHT_TOLERANCE_M
        )
    ]


def _spread(readings: Sequence[SurfaceReading]) -> bool:
    """Whether two of the viewpoints are so far apart that no single object fills both views."""
    gaps = [a.viewpoint.offset_to(b.viewpoint) for a, b in combinations(readings, 2)]
    return any(m >= MIN_SPREAD_M or rad >= MIN_SPREAD_RAD for m, rad in gaps)


def _assessment_of(
    state: FloorState, readings: Sequence[SurfaceReading], viewpoints: int
) -> FloorAssessment:
    return FloorAssessment(
        state,
        viewpoints,
        statistics.median(r.surface.height_m for r in readings),
        statistics.median(r.surface.tilt_rad for r in readings),
    )


@lru_cache(maxsize=8)  # not to be written
def _edge_rays(intrinsics: Intrinsics, height: int, width: int) -> F64:
    """Unit rays (4, 3), in the camera's axes, to the middles of left, right, upper, lower edge."""
    u, v = np.array([0, width, width / 2, width / 2]), np.array([height / 2, height / 2, 0, height])
    x, y = intrinsics.x_at(u - 0.5), intrinsics.y_at(v - 0.5)
    return _unit(np.stack([x, y, np.ones(4)], axis=-1))


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
