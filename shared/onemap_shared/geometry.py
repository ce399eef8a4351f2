"""Rigid transforms, planar velocity and array types.

Frames: map and body are x forward, y left, z up; camera optical is x right,
y down, z forward. A transform is named by both ends, destination first:
``T_map_camera`` takes points in the camera frame to the map frame.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

F16 = NDArray[np.float16]
F64 = NDArray[np.float64]
F32 = NDArray[np.float32]
U8 = NDArray[np.uint8]
U16 = NDArray[np.uint16]
I16 = NDArray[np.int16]
I32 = NDArray[np.int32]
I64 = NDArray[np.int64]
Bool = NDArray[np.bool_]

# Columns: the camera's x (right), y (down), z (forward) axes in body axes.
R_BODY_CAMERA_LEVEL: F64 = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])

MAX_RIGID_ERROR = 1e-3  # largest |R R^T - I| entry still accepted: float32 poses from robots
MAX_COORDINATE_M = 1e5  # 100 km: beyond this a pose is a unit error, not a place


def check_rigid(T: F64, name: str) -> F64:
    """Return ``T`` (4, 4) as float64, or raise ValueError with what is wrong."""
    T = np.asarray(T, dtype=np.float64)
    if T.shape != (4, 4):
        raise ValueError(f"{name} has shape {T.shape}; a rigid transform is (4, 4)")
    if not np.isfinite(T).all():
        raise ValueError(f"{name} contains NaN or infinity")
    R = T[:3, :3]
    with np.errstate(over="ignore", invalid="ignore"):
        error = float(np.abs(R @ R.T - np.eye(3)).max())
    if not error <= MAX_RIGID_ERROR:  # NaN too: the squares of huge entries cancel
        raise ValueError(
            f"{name} is not rigid: rotation departs from orthonormal by {error:.3g}, "
            f"limit {MAX_RIGID_ERROR}"
        )
    if np.linalg.det(R) < 0:
        raise ValueError(f"{name} is a reflection (determinant -1), not a rotation")
    if float(np.abs(T[3] - [0.0, 0.0, 0.0, 1.0]).max()) > MAX_RIGID_ERROR:
        raise ValueError(f"{name} has last row {T[3].tolist()}; it must be [0, 0, 0, 1]")
    if float(np.abs(T[:3, 3]).max()) > MAX_COORDINATE_M:
        raise ValueError(f"{name} lies beyond {MAX_COORDINATE_M:g} m: are its units metres?")
    return T


@dataclass(frozen=True, slots=True)
class Velocity2d:
    """Velocity of a robot on the floor, in its body frame (x forward, positive turns left).

    lateral_mps: to the left, of a holonomic robot; a differential drive has none.
    """

    linear_mps: float = 0.0
    angular_radps: float = 0.0
    lateral_mps: float = 0.0

    @property
    def speed_mps(self) -> float:
        """Metres per second over the floor, whatever the direction."""
        return float(np.hypot(self.linear_mps, self.lateral_mps))


def pose_2d(x_m: float, y_m: float, yaw_rad: float) -> F64:
    """T_map_body (4, 4) of a robot standing on the floor."""
    c, s = np.cos(yaw_rad), np.sin(yaw_rad)
    return np.array([[c, -s, 0, x_m], [s, c, 0, y_m], [0, 0, 1, 0], [0, 0, 0, 1]], dtype=np.float64)


def camera_mount(x_m: float, z_m: float, pitch_down_rad: float) -> F64:
    """T_body_camera (4, 4) of a camera on the body's x axis, tilted down by the given angle."""
    c, s = np.cos(pitch_down_rad), np.sin(pitch_down_rad)
    R_pitch = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    T = np.eye(4)
    T[:3, :3] = R_pitch @ R_BODY_CAMERA_LEVEL
    T[:3, 3] = (x_m, 0.0, z_m)
    return T


def inverse(T_a_b: F64) -> F64:
    """T_b_a from the rigid T_a_b (4, 4)."""
    T = np.eye(4)
    R = T_a_b[:3, :3]
    T[:3, :3] = R.T
    T[:3, 3] = -R.T @ T_a_b[:3, 3]
    return T


def transform(T_a_b: F64, points_b: F64) -> F64:
    """Points (..., 3) of frame b in frame a."""
    points_a: F64 = points_b @ T_a_b[:3, :3].T + T_a_b[:3, 3]
    return points_a


def yaw_of(T_map_body: F64) -> float:
    """Heading in radians, (-pi, pi], of the body's x axis seen from above."""
    return float(np.arctan2(T_map_body[1, 0], T_map_body[0, 0]))


def wrap_angle(angle_rad: float) -> float:
    """The same angle in [-pi, pi)."""
    return float((angle_rad + np.pi) % (2 * np.pi) - np.pi)
