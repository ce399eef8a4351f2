"""Everything one thought derives from map and pose before it decides."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from onemap_planner.motion.motions import Drive, Pose2d
from onemap_planner.motion.path import CostToGo, cost_to_go_from, smooth_path
from onemap_planner.policy.params import PlannerParams
from onemap_planner.policy.state import PlannerState
from onemap_planner.world.costmap import Costmap, build_costmap
from onemap_planner.world.map_view import MapView, map_view_around
from onemap_shared.messages import Occupancy, SearchView

AROUND_M = 1.0  # radius of what counts as the robot's surroundings


@dataclass(frozen=True, slots=True)
class PlanningContext:
    """Map, navigable terrain and ways from where the robot stands."""

    pose: Pose2d
    map_view: MapView
    costmap: Costmap
    cost_to_go: CostToGo

    def drive_to(self, viewpoint_xy: tuple[float, float], look_xy: tuple[float, float]) -> Drive:
        """The smoothed optimal path to a reachable place."""
        grid = self.costmap.grid
        cell = grid.cells(np.asarray(viewpoint_xy))
        cells = smooth_path(
            self.costmap.cost, self.cost_to_go.path_to((int(cell[0]), int(cell[1])))
        )
        points = grid.centres(cells)
        if len(points) > 1:
            points = np.vstack([[self.pose.xy], points[1:]])
        return Drive(points, look_xy)

    def known_around(self) -> float:
        """Part of the cells within ``AROUND_M`` of the robot that are known."""
        grid = self.map_view.grid
        x, y = np.ogrid[: grid.shape[0], : grid.shape[1]]
        here = grid.cells(np.asarray(self.pose.xy))
        around = np.hypot(x - here[0], y - here[1]) * grid.cell_size_m <= AROUND_M
        known = self.map_view.occupancy[around] != Occupancy.UNKNOWN
        circle = np.pi * (AROUND_M / grid.cell_size_m) ** 2  # the window may cut the mask
        return float(known.sum() / circle)

    def known_m2(self) -> float:
        """Known area in square metres."""
        known = int((self.map_view.occupancy != Occupancy.UNKNOWN).sum())
        return known * self.map_view.cell_area_m2


def build_context(
    state: PlannerState, pose: Pose2d, view: SearchView, params: PlannerParams
) -> PlanningContext:
    """The situation at this pose, with what the mind knows of the floor."""
    map_view = map_view_around(view, np.asarray(pose.xy))
    costmap = build_costmap(
        map_view,
        robot_xy=np.asarray(pose.xy),
        trail_xy=np.array(state.trail, dtype=np.float64).reshape(-1, 2),
        obstacles_xy=state.progress.obstacles_xy if state.progress else np.zeros((0, 2)),
        params=params.costmap,
    )
    here = map_view.grid.cells(np.asarray(pose.xy))
    cost_to_go = cost_to_go_from(
        costmap.cost, (int(here[0]), int(here[1])), cell_size_m=map_view.grid.cell_size_m
    )
    return PlanningContext(pose, map_view, costmap, cost_to_go)
