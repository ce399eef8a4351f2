"""Everything one thought derives from map and pose before it decides."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from onemap_planner.motion.path import Reach, reach_from, smooth
from onemap_planner.motion.progress import blocks_xy
from onemap_planner.motion.pure_pursuit import Drive, Pose
from onemap_planner.policy.params import Rules
from onemap_planner.policy.state import Mind
from onemap_planner.world.costmap import Terrain, build_terrain
from onemap_planner.world.map_view import Belief, belief_around
from onemap_shared.geometry import I64
from onemap_shared.messages import Occupancy, SearchView

AROUND_M = 1.0  # radius of what counts as the robot's surroundings


@dataclass(frozen=True, slots=True)
class Situation:
    """Map, navigable terrain and ways from where the robot stands."""

    pose: Pose
    belief: Belief
    terrain: Terrain
    reach: Reach

    def drive_to(self, stand_xy: tuple[float, float], look_xy: tuple[float, float]) -> Drive:
        """The smoothed optimal path to a reachable place."""
        grid = self.terrain.grid
        cell = grid.cells(np.asarray(stand_xy))
        cells = smooth(self.terrain, self.reach.path_to((int(cell[0]), int(cell[1]))))
        points = grid.centres(cells)
        if len(points) > 1:
            points = np.vstack([[self.pose.xy], points[1:]])
        return Drive(points, look_xy)

    def cells_of(self, world_cells: frozenset[tuple[int, int]]) -> I64:
        """Grid indices (K, 2) of world cells, those outside the window left out."""
        cells = np.array(sorted(world_cells), np.int64).reshape(-1, 2)
        cells = cells - np.asarray(self.belief.grid.origin_cell)
        inside: I64 = cells[self.belief.grid.contains(cells)]
        return inside

    def known_around(self) -> float:
        """Part of the cells within ``AROUND_M`` of the robot that are known."""
        grid = self.belief.grid
        x, y = np.ogrid[: grid.shape[0], : grid.shape[1]]
        here = grid.cells(np.asarray(self.pose.xy))
        around = np.hypot(x - here[0], y - here[1]) * grid.cell_size_m <= AROUND_M
        known = self.belief.occupancy[around] != Occupancy.UNKNOWN
        circle = np.pi * (AROUND_M / grid.cell_size_m) ** 2  # the window may cut the mask
        return float(known.sum() / circle)

    def known_m2(self) -> float:
        """Known area in square metres."""
        known = int((self.belief.occupancy != Occupancy.UNKNOWN).sum())
        return known * self.belief.cell_area_m2


def take_in(mind: Mind, pose: Pose, view: SearchView, rules: Rules) -> Situation:
    """The situation at this pose, with what the mind knows of the floor."""
    belief = belief_around(view, np.asarray(pose.xy))
    blocks = blocks_xy(mind.footing) if mind.footing else np.zeros((0, 2))
    terrain = build_terrain(
        belief,
        robot_xy=np.asarray(pose.xy),
        trail_xy=np.array(mind.trail, dtype=np.float64).reshape(-1, 2),
        blocked_xy=blocks,
        rules=rules.terrain,
    )
    here = belief.grid.cells(np.asarray(pose.xy))
    return Situation(pose, belief, terrain, reach_from(terrain, (int(here[0]), int(here[1]))))
