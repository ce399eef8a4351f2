"""Corrections of the pose: where the floor that was seen from a keyframe really lies.

The robot drives on a floor, so of a correction the part in the plane is used: x, y and yaw.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, sin

import numpy as np

from onemap_shared.geometry import F64, inverse, wrap_angle, yaw_of
from onemap_shared.messages import PoseGraph


@dataclass(frozen=True, slots=True)
class PlanarCorrection:
    """The rigid motion p -> R(yaw) p + t of the map's plane, in radians and metres."""

    yaw_rad: float = 0.0
    x_m: float = 0.0
    y_m: float = 0.0

    @classmethod
    def about(cls, centre_m: F64, *, to_m: F64, yaw_rad: float) -> PlanarCorrection:
        """The motion that takes centre_m (2,) to to_m (2,) and turns by ``yaw_rad``."""
        x_m, y_m = to_m - centre_m @ _rotation(yaw_rad).T
        return cls(yaw_rad, float(x_m), float(y_m))

    @property
    def is_identity(self) -> bool:
        """Whether nothing moves at all."""
        return self == NO_CORRECTION

    def apply(self, points_m: F64) -> F64:
        """Where points (n, 2) lie after the correction."""
        moved: F64 = points_m @ _rotation(self.yaw_rad).T + (self.x_m, self.y_m)
        return moved

    def undo(self, points_m: F64) -> F64:
        """Where points (n, 2) lay before the correction."""
        original: F64 = (points_m - (self.x_m, self.y_m)) @ _rotation(self.yaw_rad)
        return original


NO_CORRECTION = PlanarCorrection()


def correction_at(graph: PoseGraph, stamp_ns: int, centre_m: F64) -> PlanarCorrection:
    """The correction of what was seen at a time from centre_m (2,), as published.

    Between two keyframes the correction, not the pose, is interpolated: it changes slowly.
    Before the first and after the last keyframe theirs holds; poses that were published after the
    graph's stamp are right.
    """
    stamps = graph.keyframe_stamps_ns
    if len(stamps) == 0 or stamp_ns > graph.stamp_ns:
        return NO_CORRECTION
    since_ns = np.clip(stamp_ns, stamps[0], stamps[-1]) - stamps[0]  # floats hold no stamps
    place = float(np.interp(since_ns, stamps - stamps[0], np.arange(len(stamps))))
    first, share = int(place), place % 1.0
    before = _keyframe_correction(graph, first, centre_m)
    after = _keyframe_correction(graph, min(first + 1, len(stamps) - 1), centre_m)
    yaw_rad = before[2] + share * wrap_angle(after[2] - before[2])
    to_m = before[:2] + share * (after[:2] - before[:2])
    return PlanarCorrection.about(centre_m, to_m=to_m, yaw_rad=float(yaw_rad))


def _keyframe_correction(graph: PoseGraph, index: int, centre_m: F64) -> F64:
    """x, y (metres) to which one keyframe's correction takes a point (2,), and its yaw."""
    T = graph.T_map_body[index] @ inverse(graph.T_map_body_published[index])
    moved = T[:2, :2] @ centre_m + T[:2, 3]
    return np.array([*moved, yaw_of(T)])


def _rotation(yaw_rad: float) -> F64:
    c, s = cos(yaw_rad), sin(yaw_rad)
    return np.array([[c, -s], [s, c]])
