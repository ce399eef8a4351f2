"""Distance to somebody who walks: the robot stands before they can have come to it.

As in speed and separation monitoring (ISO/TS 15066): what has just appeared on free floor may have
come nearer since the map saw it, and comes nearer until the robot stands.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from onemap_planner.motion.edge_distances import edge_distance
from onemap_planner.motion.motions import Pose2d
from onemap_planner.motion.pure_pursuit import DriveParams
from onemap_planner.world.costmap import Costmap
from onemap_shared.geometry import F64

NOT_WORSE_M = 1e-6  # rounding of distances


@dataclass(frozen=True, slots=True)
class Walkers:
    """Where somebody appeared, and how near the robot may come.

    cells_xy (n, 2): centres in metres; seen_s: age of what the map shows, seconds; here_m: from the
    robot's centre to the nearest cell: who is too near already does not hold it there.
    """

    cells_xy: F64
    cell_size_m: float
    radius_m: float
    speed_mps: float
    seen_s: float
    here_m: float

    @classmethod
    def of(cls, pose: Pose2d, costmap: Costmap, params: DriveParams, seen_s: float) -> Walkers:
        """Those of a costmap; nobody if ``walker_mps`` is 0."""
        cells = costmap.grid.centres(np.argwhere(costmap.appeared))
        cells = cells if params.walker_mps > 0 else cells[:0]
        size_m = costmap.grid.cell_size_m
        here_m = float(edge_distance(np.array([pose.xy]), cells, size_m)[0])
        return cls(cells, size_m, costmap.params.radius_m, params.walker_mps, seen_s, here_m)

    def allow(self, points: F64, step_s: float) -> bool:
        """Whether nobody can have come to the robot's disc on a path (N, 2), a point a step.

        Nor on one that leads away from who is near, however near.
        """
        if len(self.cells_xy) == 0:
            return True
        come_m = self.speed_mps * (self.seen_s + step_s * np.arange(1, len(points) + 1))
        away_m = edge_distance(points, self.cells_xy, self.cell_size_m)
        return bool((away_m >= np.minimum(self.radius_m + come_m, self.here_m - NOT_WORSE_M)).all())
