"""Whether the floor lies at z = 0, judged over several viewpoints.

The lowest level surface in one image may be a bed or a table. Only what several viewpoints agree
on tells of the camera's mounting; a floor near z = 0 in any of them shows that it is right.
"""

from __future__ import annotations

import statistics
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum
from itertools import combinations
from math import atan2, degrees, hypot, radians

from onemap_mapper.diagnostics.level_surface import LevelSurface
from onemap_shared.geometry import F64, wrap_angle

# The threshold for the floor's height: here obstacles begin by default, so the floor becomes one.
HEIGHT_LIMIT_M = 0.10
# A real camera, mounted right, shows a metre of floor tilted by up to 3.7 degrees (its depth is
# warped); an error of 5 moves the floor by HEIGHT_LIMIT_M at little over a metre.
TILT_LIMIT_RAD = radians(4.0)
HEIGHT_RANGE_M = (-1.5, 0.6)  # a mounting wrong by more is no slip of a tape measure; table tops
HEIGHT_TOLERANCE_M = 0.06  # between heights that are one floor: the noise of a pose and of a tile
TILT_TOLERANCE_RAD = radians(2.0)  # between tilts of one floor
SAME_PLACE_M = 0.5  # a viewpoint is another one when the camera moved this far
SAME_HEADING_RAD = radians(30.0)  # or turned this far
MIN_AGREEING = 4  # viewpoints that agree before there is an alarm
MIN_SPREAD_M = 2.0  # and the largest distance between two of them: longer than most furniture
MIN_SPREAD_RAD = radians(90.0)  # or turn: the robot has looked somewhere else
READING_LIFETIME_S = 60.0  # older readings are dropped: the pose may have been corrected since


@dataclass(frozen=True, slots=True)
class CameraPose2D:
    """Where the camera was, metres in the map frame, and its heading in radians."""

    x_m: float
    y_m: float
    heading_rad: float

    def offset_to(self, other: CameraPose2D) -> tuple[float, float]:
        """Metres and radians between the two."""
        turn = abs(wrap_angle(self.heading_rad - other.heading_rad))
        return hypot(self.x_m - other.x_m, self.y_m - other.y_m), turn

    def is_near(self, other: CameraPose2D) -> bool:
        """Whether both see the same part of the room."""
        moved_m, turned_rad = self.offset_to(other)
        return moved_m < SAME_PLACE_M and turned_rad < SAME_HEADING_RAD


def camera_pose_2d(T_map_camera: F64) -> CameraPose2D:
    """Where a camera is and looks; its x axis tells the heading however far it is tilted down."""
    x_m, y_m = (float(value) for value in T_map_camera[:2, 3])
    return CameraPose2D(x_m, y_m, atan2(float(T_map_camera[0, 0]), -float(T_map_camera[1, 0])))


@dataclass(frozen=True, slots=True)
class SurfaceReading:
    """The newest level surface seen from a viewpoint, and when: monotonic seconds."""

    viewpoint: CameraPose2D
    surface: LevelSurface
    at_s: float

    @property
    def is_floor(self) -> bool:
        """Whether the surface lies where the floor should."""
        return (
            abs(self.surface.height_m) <= HEIGHT_LIMIT_M and self.surface.tilt_rad <= TILT_LIMIT_RAD
        )


class FloorState(Enum):
    """What is known of the floor."""

    UNKNOWN = "unknown"
    CONSISTENT = "right"
    INCONSISTENT = "wrong"


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
        """What is wrong in one sentence; empty if nothing is, or if nobody can tell."""
        if self.state is not FloorState.INCONSISTENT:
            return ""
        return (
            f"the floor appears at z = {self.height_m:+.2f} m, tilted by "
            f"{degrees(self.tilt_rad):.1f} degrees, from {self.viewpoints} viewpoints: "
            "check the camera's mounting (T_map_camera)"
        )


@dataclass(frozen=True, slots=True)
class FloorMonitor:
    """The recent readings, one for each viewpoint; a value, replaced with every frame."""

    readings: tuple[SurfaceReading, ...] = ()

    def with_surface(
        self, surface: LevelSurface, viewpoint: CameraPose2D, now_s: float
    ) -> FloorMonitor:
        """The monitor after a frame. A viewpoint keeps its first place, so that a robot that
        turns slowly comes to a new one every 30 degrees."""
        recent = self._recent(now_s)
        known = next((r for r in recent if r.viewpoint.is_near(viewpoint)), None)
        others = tuple(r for r in recent if r is not known)
        place = known.viewpoint if known else viewpoint
        return replace(self, readings=(*others, SurfaceReading(place, surface, now_s)))

    def assessment(self, now_s: float) -> FloorAssessment:
        """Right if any recent viewpoint shows the floor at z = 0, wrong if enough agree on another
        plane, unknown otherwise."""
        recent = self._recent(now_s)
        floors = [reading for reading in recent if reading.is_floor]
        if floors:
            return _assessment_of(FloorState.CONSISTENT, floors, len(recent))
        low, high = HEIGHT_RANGE_M
        wrong = [r for r in recent if low <= r.surface.height_m <= high]
        agreed = max((_agreeing(wrong, seed) for seed in wrong), key=len, default=[])
        if len(agreed) >= MIN_AGREEING and _spread(agreed):
            return _assessment_of(FloorState.INCONSISTENT, agreed, len(recent))
        return FloorAssessment(FloorState.UNKNOWN, len(recent))

    def _recent(self, now_s: float) -> tuple[SurfaceReading, ...]:
        return tuple(r for r in self.readings if now_s - r.at_s <= READING_LIFETIME_S)


def _agreeing(readings: Sequence[SurfaceReading], seed: SurfaceReading) -> list[SurfaceReading]:
    """The readings that may be of the same plane as ``seed``.

    A tilt is compared by itself: with a pitch error the height depends on the distance.
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
    """Whether two of the viewpoints are so far apart that no one thing fills both views."""
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
