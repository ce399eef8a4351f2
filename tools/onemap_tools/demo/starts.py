"""Where further robots of a demo start: on the same floor, far from one another."""

from __future__ import annotations

from math import atan2

import numpy as np

from onemap_simulator.physics.collision import CollisionMap
from onemap_simulator.physics.robot import RobotParams
from onemap_simulator.scene.scene import Scene

Start = tuple[float, float, float]  # x, y in metres and yaw in radians, in the scene's frame

CELL_SIZE_M = 0.05
ROOMY_M = 0.3  # between the body and obstacles, where the floor has it
MARGIN_M = 0.1  # the same where it has not: a robot can turn and leave
MIN_APART_M = 1.0  # between the middles of two robots


def further_starts(scene: Scene, robot: RobotParams, count: int) -> tuple[Start, ...]:
    """Starts of ``count`` robots beside the one at the scene's start, which they face.

    Each is as far from those before as the floor reaches. ValueError if it does not hold so many
    robots ``MIN_APART_M`` apart.
    """
    collision = CollisionMap.of(scene, robot.height_m, CELL_SIZE_M)
    x_m, y_m, _ = scene.start
    reachable = collision.reachable_cells(x_m, y_m, robot.radius_m)
    starts: list[Start] = []
    for margin_m in (ROOMY_M, MARGIN_M):
        wide = reachable & (collision.clearance >= robot.radius_m + margin_m)
        places = collision.grid.centres(np.argwhere(wide))
        away = np.linalg.norm(places - (x_m, y_m), axis=1)
        starts = []
        while len(starts) < count and len(places) and away.max() >= MIN_APART_M:
            x, y = (float(value) for value in places[int(away.argmax())])
            starts.append((x, y, atan2(y_m - y, x_m - x)))
            away = np.minimum(away, np.linalg.norm(places - (x, y), axis=1))
        if len(starts) == count:
            return tuple(starts)
    raise ValueError(
        f"{scene.name} has room for {len(starts) + 1} robots that start {MIN_APART_M:g} m apart, "
        f"not for {count + 1}"
    )
