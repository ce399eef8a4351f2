"""Whether the floor lies at z = 0, assessed over several viewpoints.

The lowest level surface in one image may be a bed or a table. Only a surface on which several
viewpoints agree shows that T_map_camera is wrong; a floor near z = 0 in any of them shows that it
is right.
"""

from __future__ import annotations

import statistics
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from itertools import combinations
from math import atan2, degrees, hypot, radians

from onemap_mapper.diagnostics.level_surface import LevelSurface
from onemap_shared.geometry import F64, wrap_angle

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
        """Whether the surface lies where the floor is expected."""
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
