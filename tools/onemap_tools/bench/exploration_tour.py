"""A drive that shows a scene little by little: from place to place along the floor."""

from __future__ import annotations

import numpy as np

from onemap_shared.geometry import F64, I64, Bool, pose_2d
from onemap_simulator.ground_truth.shortest_paths import ShortestPaths
from onemap_simulator.physics.collision import CollisionMap
from onemap_simulator.rendering.rgbd_camera import CameraParams
from onemap_simulator.scene.scene import Scene

CELL_SIZE_M = 0.1
ROBOT_RADIUS_M = 0.2
CLEARANCE_M = 0.4  # of a place, from walls and furniture: closer, an image shows a patch of one
SPACING_M = 2.2  # no floor is farther from all places
HEADINGS = 6  # at each place: 60 degrees apart, of a view of 79
STEP_M = 0.5  # of way between two images


def exploration_poses(scene: Scene, camera: CameraParams) -> list[F64]:
    """Poses T_map_camera (4, 4) of a drive that shows all of the floor that a robot can reach.

    From the scene's start always to the nearest place that is left, by the shortest path, with an
    image every ``STEP_M`` and ``HEADINGS`` of them at each place. ValueError without free floor.
    """
    collision = CollisionMap.of(scene, camera.height_m, CELL_SIZE_M)
    x, y = scene.start[:2]
    reachable = collision.reachable_cells(x, y, ROBOT_RADIUS_M)
    if not reachable.any():
        raise ValueError(f"scene {scene.name}: no free floor around its start ({x:.2f}, {y:.2f})")
    left = tour_cells(
        reachable, collision.clearance >= CLEARANCE_M, collision.grid.cells(np.array([x, y]))
    )
    here, bodies = left.pop(0), []
    while True:
        x, y = collision.grid.centres(here)
        bodies += [(x, y, 2 * np.pi * k / HEADINGS) for k in range(HEADINGS)]
        if not left:
            return [pose_2d(*body) @ camera.mount for body in bodies]
        goals = np.zeros(reachable.shape, bool)
        goals[tuple(np.array(left).T)] = True
        path = ShortestPaths.to(goals, reachable).cells_from(here)
        bodies += _along(collision.grid.centres(path))
        here = path[-1]
        left = [cell for cell in left if not np.array_equal(cell, here)]


def tour_cells(reachable: Bool, roomy: Bool, start: I64) -> list[I64]:
    """Cells (2,) of the floor, the first the nearest to ``start``, each the farthest from the rest.

    Among the roomy cells, if there are any, until no floor is farther than ``SPACING_M``.
    """
    floor = np.argwhere(reachable & roomy if (reachable & roomy).any() else reachable)
    chosen = [int(np.linalg.norm(floor - start, axis=1).argmin())]
    apart = np.linalg.norm(floor - floor[chosen[0]], axis=1)
    while apart.max() * CELL_SIZE_M > SPACING_M:
        chosen.append(int(apart.argmax()))
        apart = np.minimum(apart, np.linalg.norm(floor - floor[chosen[-1]], axis=1))
    return [floor[index] for index in chosen]


def _along(points: F64) -> list[tuple[float, float, float]]:
    """x, y, yaw every ``STEP_M`` along points (N, 2), looking to where a metre of way leads."""
    way_m = np.append(0.0, np.linalg.norm(np.diff(points, axis=0), axis=1).cumsum())
    poses = []
    for at_m in np.arange(STEP_M, way_m[-1], STEP_M):
        here, ahead = (
            np.array([np.interp(m, way_m, points[:, k]) for k in range(2)])
            for m in (at_m, min(at_m + 1.0, way_m[-1]))
        )
        yaw = float(np.arctan2(*(ahead - here)[::-1]))
        poses.append((float(here[0]), float(here[1]), yaw))
    return poses
