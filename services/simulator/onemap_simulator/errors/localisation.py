"""The pose that the robot reports: drift, loop closures, white noise; and the way back to truth."""

from __future__ import annotations

import numpy as np

from onemap_shared.geometry import F64, inverse, transform
from onemap_simulator.errors.loop_closure import LoopClosureParams, LoopClosures
from onemap_simulator.errors.odometry_drift import DriftingOdometry, OdometryDriftParams
from onemap_simulator.physics.pose_noise import PoseNoiseParams, noisy_pose

KEPT_EVERY_M = 0.05  # between two poses of the history


class Localisation:
    """Reports poses with errors, for true poses in the order of time.

    It keeps which true pose each report stands for, so that a place that was told in the reported
    frame can be judged by the ground truth.
    """

    def __init__(
        self,
        noise: PoseNoiseParams,
        noise_rng: np.random.Generator,
        *,
        drift: OdometryDriftParams,
        loop_closure: LoopClosureParams,
        drift_rng: np.random.Generator,
    ) -> None:
        self._noise, self._noise_rng = noise, noise_rng
        self._drift = DriftingOdometry(drift, drift_rng) if drift.active else None
        self._closures = LoopClosures(loop_closure) if loop_closure.radius_m > 0 else None
        self._history: list[tuple[F64, F64]] = []  # reported, true T_map_body
        self.largest_error_m = 0.0

    @property
    def jumps(self) -> int:
        """Loop closures so far."""
        return self._closures.count if self._closures else 0

    def reported(self, T_true: F64) -> F64:
        """The reported T_map_body (4, 4) at the next true one."""
        if self._drift is None:
            return noisy_pose(T_true, self._noise, self._noise_rng)
        T_reported = self._drift.reported(T_true)
        if self._closures is not None and self._closures.closes(T_true):
            self._drift.correct(T_true)
            T_reported = T_true
        error_m = float(np.linalg.norm(T_reported[:2, 3] - T_true[:2, 3]))
        self.largest_error_m = max(self.largest_error_m, error_m)
        self._keep(T_reported, T_true)
        return noisy_pose(T_reported, self._noise, self._noise_rng)

    def true_place(self, x_m: float, y_m: float) -> tuple[float, float]:
        """Where a place of the reported frame truly is, seen from the latest reported pose near it.

        The same place without drift.
        """
        if not self._history:
            return x_m, y_m
        reported_xy = np.array([reported[:2, 3] for reported, _ in self._history])
        away = np.hypot(*(reported_xy - (x_m, y_m)).T)
        near = np.flatnonzero(away <= away.min() + KEPT_EVERY_M)
        T_reported, T_true = self._history[int(near[-1])]
        return true_place(T_reported, T_true, (x_m, y_m))

    def _keep(self, T_reported: F64, T_true: F64) -> None:
        if self._history:
            step = T_reported[:2, 3] - self._history[-1][0][:2, 3]
            if np.hypot(*step) < KEPT_EVERY_M:
                return
        self._history.append((T_reported, T_true))


def true_place(T_reported: F64, T_true: F64, place: tuple[float, ...]) -> tuple[float, float]:
    """Where a place (x, y) of the reported frame truly is, for a robot at these T_map_body."""
    moved = transform(T_true @ inverse(T_reported), np.array([place[0], place[1], 0.0]))
    return float(moved[0]), float(moved[1])
