"""Habitat's coordinates and the map's; no other module converts between them.

Habitat: metres, x right, y up, z backward; an agent without rotation looks along -z; rotations are
quaternions (x, y, z, w). Map: metres, x forward, y left, z up, floor at z = 0. The map of an
episode has Habitat's origin seen from above, and the height of the start as z = 0:

    x_map = -z_habitat,  y_map = -x_habitat,  z_map = y_habitat - floor_y_m.
"""

from __future__ import annotations

import numpy as np

from onemap_shared.geometry import F64

Point = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]

# Rows: the map's x, y, z axes in Habitat's axes. A proper rotation, the same for agent and body.
R_MAP_HABITAT: F64 = np.array([[0.0, 0.0, -1.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])


def to_map(points_habitat: F64, floor_y_m: float) -> F64:
    """Points (..., 3) of Habitat in the map, whose floor is at ``floor_y_m`` in Habitat."""
    points: F64 = np.asarray(points_habitat, np.float64) @ R_MAP_HABITAT.T
    points[..., 2] -= floor_y_m
    return points


def to_habitat(points_map: F64, floor_y_m: float) -> F64:
    """Points (..., 3) of the map in Habitat: the inverse of ``to_map``."""
    lifted = np.asarray(points_map, np.float64) + [0.0, 0.0, floor_y_m]
    points: F64 = lifted @ R_MAP_HABITAT
    return points


def body_pose(position: Point, rotation: Quaternion, floor_y_m: float) -> F64:
    """T_map_body (4, 4) of an agent at a position with a unit rotation, both Habitat's."""
    T = np.eye(4)
    T[:3, :3] = R_MAP_HABITAT @ rotation_matrix(rotation) @ R_MAP_HABITAT.T
    T[:3, 3] = to_map(np.array(position), floor_y_m)
    return T


def habitat_rotation(yaw_rad: float) -> Quaternion:
    """Habitat's rotation of an upright agent that heads ``yaw_rad`` to the left of the map's x."""
    return (0.0, float(np.sin(yaw_rad / 2)), 0.0, float(np.cos(yaw_rad / 2)))


def rotation_matrix(rotation: Quaternion) -> F64:
    """Matrix (3, 3) of a unit quaternion (x, y, z, w)."""
    x, y, z, w = rotation
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
