"""Camera poses that show a scene: at places spread over its free floor, turning all around."""

from __future__ import annotations

import numpy as np

from onemap_shared.geometry import F64, pose_2d
from onemap_simulator.physics.collision import CollisionMap
from onemap_simulator.rendering.rgbd_camera import CameraParams
from onemap_simulator.scene.scene import Scene

CLEARANCE_M = 0.4  # from walls and furniture: closer, an image shows a patch of one thing
MIN_CLEARANCE_M = 0.25  # in narrow scenes; a little more than a robot's radius
HEADINGS = 8  # at each place: 45 degrees apart, of a view of 79


def tour_poses(scene: Scene, camera: CameraParams, places: int) -> list[F64]:
    """Poses T_map_camera (4, 4): ``places`` places with HEADINGS each, without chance.

    The first place is the reachable floor nearest to the scene's start; each further one is the
    floor that is farthest from all before it. ValueError without floor that can be reached.
    """
    return [
        pose_2d(x, y, 2 * np.pi * heading / HEADINGS) @ camera.mount
        for x, y in tour_places(scene, camera.height_m, places).tolist()
        for heading in range(HEADINGS)
    ]


def tour_places(scene: Scene, height_m: float, count: int) -> F64:
    """Up to ``count`` places (n, 2) in metres; fewer on a floor with fewer cells."""
    collision = CollisionMap.of(scene, height_m)
    x, y = scene.start[:2]
    for clearance_m in (CLEARANCE_M, MIN_CLEARANCE_M):
        reachable = collision.reachable_cells(x, y, clearance_m)
        if reachable.any():
            break
    else:
        raise ValueError(f"scene {scene.name}: no free floor around its start ({x:.2f}, {y:.2f})")
    floor = collision.grid.centres(np.argwhere(reachable))
    chosen = [int(np.linalg.norm(floor - (x, y), axis=1).argmin())]
    apart = np.linalg.norm(floor - floor[chosen[0]], axis=1)
    while len(chosen) < min(count, len(floor)):
        chosen.append(int(apart.argmax()))
        apart = np.minimum(apart, np.linalg.norm(floor - floor[chosen[-1]], axis=1))
    return floor[chosen]
