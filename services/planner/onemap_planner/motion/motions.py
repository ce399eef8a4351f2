"""Poses on the floor, and the motions that a plan commands."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from onemap_shared.geometry import F64, Velocity2d, wrap_angle

STOP = Velocity2d()


@dataclass(frozen=True, slots=True)
class Pose2d:
    """Position and heading in the map frame."""

    x_m: float
    y_m: float
    yaw_rad: float

    @property
    def xy(self) -> tuple[float, float]:
        return (self.x_m, self.y_m)

    def bearing_to(self, xy: tuple[float, float]) -> float:
        """Angle in [-pi, pi) from the heading to a point (metres); left is positive."""
        return wrap_angle(float(np.arctan2(xy[1] - self.y_m, xy[0] - self.x_m)) - self.yaw_rad)

    def distance_to(self, xy: tuple[float, float]) -> float:
        """Distance to a point (metres)."""
        return float(np.hypot(xy[0] - self.x_m, xy[1] - self.y_m))


def moved(pose: Pose2d, velocity: Velocity2d, dt_s: float) -> Pose2d:
    """The pose after ``dt_s`` seconds at this velocity; the chord of its arc is as long as it."""
    turn = velocity.angular_radps * dt_s
    ahead, left = velocity.linear_mps * dt_s, velocity.lateral_mps * dt_s
    heading = pose.yaw_rad + 0.5 * turn
    cos, sin = float(np.cos(heading)), float(np.sin(heading))
    x_m = pose.x_m + ahead * cos - left * sin
    y_m = pose.y_m + ahead * sin + left * cos
    return Pose2d(x_m, y_m, wrap_angle(pose.yaw_rad + turn))


@dataclass(frozen=True, slots=True)
class Rest:
    """Stand still."""


@dataclass(frozen=True, slots=True)
class Rotate:
    """Rotate left in place."""


@dataclass(frozen=True, slots=True)
class Drive:
    """Follow points_xy (N, 2) metres, N >= 1, slow down at its end and face look_xy there."""

    points_xy: F64
    look_xy: tuple[float, float]


@dataclass(frozen=True, slots=True)
class Reverse:
    """Back up slowly."""


Motion = Rest | Rotate | Drive | Reverse
