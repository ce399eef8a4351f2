"""Odometry that drifts with the way: a bias drawn once per run, and a random walk."""

from __future__ import annotations

import numpy as np
from pydantic import Field

from onemap_shared.geometry import F64, inverse, pose_2d, yaw_of
from onemap_shared.params import Params

LEAST_SHARE = 0.25  # of the largest bias: every run drifts


class OdometryDriftParams(Params):
    """Drift of the reported pose; off by default. The sign of each bias is drawn per run."""

    way_percent: float = Field(
        default=0.0,
        ge=0,
        le=20,
        description="Largest error of lengths, in percent of the way; a run has between a quarter "
        "of it and all of it. 2 stands for good visual or wheel odometry without loop closure.",
    )
    yaw_deg_per_m: float = Field(
        default=0.0,
        ge=0,
        le=10,
        description="Largest error of the heading, in degrees per metre of way; a run has between "
        "a quarter of it and all of it. 0.5 stands for wheels without a gyroscope.",
    )
    random_walk: float = Field(
        default=0.5,
        ge=0,
        le=5,
        description="Standard deviation of the random part after 1 m, over the largest bias; it "
        "grows with the square root of the way. 0.5: the bias dominates from 1 m on.",
    )

    @property
    def active(self) -> bool:
        """Whether there is any drift."""
        return self.way_percent > 0 or self.yaw_deg_per_m > 0


class DriftingOdometry:
    """Integrates the true motion with errors; exact at the first pose and after ``correct``."""

    def __init__(self, params: OdometryDriftParams, rng: np.random.Generator) -> None:
        largest = np.array([params.way_percent / 100, np.radians(params.yaw_deg_per_m)])
        self._bias: F64 = largest * rng.uniform(LEAST_SHARE, 1.0, 2) * rng.choice((-1.0, 1.0), 2)
        self._walk: F64 = largest * params.random_walk
        self._rng = rng
        self._T_true: F64 | None = None
        self._T_reported: F64 = np.eye(4)

    def reported(self, T_true: F64) -> F64:
        """The reported T_map_body (4, 4) at the next true one."""
        if self._T_true is None:
            self.correct(T_true)
        else:
            moved = inverse(self._T_true) @ T_true
            self._T_reported = self._T_reported @ self._measured(moved)
            self._T_true = T_true
        return self._T_reported

    def correct(self, T_true: F64) -> None:
        """Set the reported pose to the true one (4, 4)."""
        self._T_true = self._T_reported = T_true

    def _measured(self, moved: F64) -> F64:
        """A small motion (4, 4) of the body as odometry measures it."""
        dx_m, dy_m = float(moved[0, 3]), float(moved[1, 3])
        way_m = float(np.hypot(dx_m, dy_m))
        if way_m == 0:
            return moved  # no way, no error: turning on the spot is measured exactly
        errors = self._bias * way_m + self._walk * np.sqrt(way_m) * self._rng.standard_normal(2)
        scale = 1.0 + float(errors[0]) / way_m
        return pose_2d(dx_m * scale, dy_m * scale, yaw_of(moved) + float(errors[1]))
