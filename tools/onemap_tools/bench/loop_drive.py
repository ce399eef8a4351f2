"""A drive through a scene and back to its start, and what drifting odometry says of it."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from onemap_shared.geometry import F64, inverse, pose_2d, wrap_angle, yaw_of
from onemap_simulator.ground_truth.shortest_paths import ShortestPaths
from onemap_simulator.physics.collision import CollisionMap
from onemap_simulator.rendering.rgbd_camera import CameraParams
from onemap_simulator.scene.scene import Scene
from onemap_tools.bench.scene_tour import tour_places

CELL_M = 0.05  # of the paths
RADIUS_M = 0.25  # free around the robot
STEP_M = 0.125  # between two frames: 0.5 m/s at 4 Hz
TURN_RAD = np.radians(15.0)  # between two frames of a turn on the spot


@dataclass(frozen=True, slots=True)
class OdometryDrift:
    """scale: metres too much per metre of way; yaw_rad_per_m: turned too far to the left."""

    scale: float
    yaw_rad_per_m: float


def loop_drive(scene: Scene, places: int) -> F64:
    """Poses T_map_body (n, 4, 4), a frame apart: from the start by way of places back to it.

    ``places`` are spread over the reachable floor; the next is always the nearest of those left.
    """
    collision = CollisionMap.of(scene, CameraParams().height_m, CELL_M)
    free = collision.reachable_cells(*scene.start[:2], RADIUS_M)
    left = [
        collision.grid.cells(place) for place in tour_places(scene, CameraParams().height_m, places)
    ]
    first = here = left.pop(0)
    way: list[F64] = []
    while left or here is not first:
        paths = ShortestPaths.to(_only(here, free), free)
        reached = [k for k, cell in enumerate(left) if np.isfinite(_length(paths, cell))]
        nearest = min(reached, key=lambda k: _length(paths, left[k]), default=None)
        goal = first if nearest is None else left[nearest]
        left = [] if nearest is None else left[:nearest] + left[nearest + 1 :]
        way.append(collision.grid.centres(paths.cells_from(goal)[::-1]))
        here = goal
    return _poses(np.concatenate(way))


def drifting(poses: F64, drift: OdometryDrift) -> F64:
    """What odometry says of true poses (n, 4, 4), beginning at the truth."""
    steps = np.array([inverse(a) @ b for a, b in pairwise(poses)])
    said = [poses[0]]
    for step in steps:
        way_m = float(np.linalg.norm(step[:2, 3]))
        wrong = step.copy()
        wrong[:2, 3] *= 1.0 + drift.scale
        said.append(said[-1] @ wrong @ pose_2d(0.0, 0.0, drift.yaw_rad_per_m * way_m))
    return np.stack(said)


def loop_closed(said: F64, end: F64) -> F64:
    """The poses (n, 4, 4) after a loop closure found that the last one is ``end`` (4, 4).

    The error of the heading is shared out over the way, then that of the place: what a pose graph
    of odometry and one loop closure gives, not the truth.
    """
    steps = np.array([inverse(a) @ b for a, b in pairwise(said)])
    way_m = np.linalg.norm(steps[:, :2, 3], axis=1)
    share = way_m / max(float(way_m.sum()), 1e-9)
    yaw_rad = wrap_angle(yaw_of(end) - yaw_of(said[-1]))
    turned = [said[0]]
    for step, part in zip(steps, share, strict=True):
        turned.append(turned[-1] @ step @ pose_2d(0.0, 0.0, yaw_rad * float(part)))
    closed = np.stack(turned)
    missing = end[:2, 3] - closed[-1, :2, 3]
    closed[1:, :2, 3] += np.cumsum(share)[:, None] * missing
    return closed


def _only(cell: np.ndarray, free: np.ndarray) -> np.ndarray:
    mask = np.zeros_like(free)
    mask[tuple(cell)] = True
    return mask


def _length(paths: ShortestPaths, cell: np.ndarray) -> float:
    return float(paths.lengths[paths.number[tuple(cell)]])


def _poses(way: F64) -> F64:
    """A pose every ``STEP_M`` of a way (n, 2), looking along it; turns on the spot in between."""
    lengths = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(way, axis=0), axis=1)))
    at = np.arange(0.0, lengths[-1], STEP_M)
    places = np.stack([np.interp(at, lengths, way[:, k]) for k in range(2)], axis=1)
    ahead = np.minimum(np.arange(len(places)) + 4, len(places) - 1)  # half a metre
    poses: list[F64] = []
    yaw_rad = 0.0
    for (x, y), (dx, dy) in zip(places, places[ahead] - places, strict=True):
        wanted = float(np.arctan2(dy, dx)) if dx or dy else yaw_rad
        while poses and abs(wrap_angle(wanted - yaw_rad)) > TURN_RAD:
            yaw_rad += float(np.copysign(TURN_RAD, wrap_angle(wanted - yaw_rad)))
            at_x, at_y = poses[-1][:2, 3].tolist()
            poses.append(pose_2d(at_x, at_y, yaw_rad))
        yaw_rad = wanted
        poses.append(pose_2d(float(x), float(y), yaw_rad))
    return np.stack(poses)
