"""What the planner does once before it joins its robot: compile."""

from __future__ import annotations

import numpy as np

from onemap_planner.motion.collision_monitor import ControlTimes, monitored
from onemap_planner.motion.motions import Pose2d
from onemap_planner.motion.pure_pursuit import DriveParams
from onemap_planner.policy.context import build_context
from onemap_planner.policy.goals import frontier_goals
from onemap_planner.world.costmap import BesideMap, CostmapParams
from onemap_planner.world.frontiers import find_frontiers
from onemap_shared.geometry import Velocity2d
from onemap_shared.grid import GridSpec
from onemap_shared.messages import Layer, Occupancy, SearchView

COMPILATION_S = 10.0  # on two cores; only said, nothing ends after it
ROOM, WALL = 40, 5  # cells from side to side, and of unknown space around
TRAIL_XY = np.array([[2.0, 2.0], [2.1, 2.0]])


def warm_up() -> None:
    """Plan ways to the borders of a small room."""
    grid = GridSpec(0.1, (0, 0), (ROOM, ROOM))
    occupancy = np.full(grid.shape, Occupancy.UNKNOWN, np.uint8)
    occupancy[WALL:-WALL, WALL:-WALL] = Occupancy.FREE
    occupancy[WALL, WALL:-WALL] = Occupancy.OCCUPIED
    known = occupancy != Occupancy.UNKNOWN
    explored = known & (np.arange(ROOM) < ROOM // 2)[:, None]
    layers = (Layer.OBSERVED * known + Layer.EXPLORED * explored).astype(np.uint8)
    similarity = np.where(layers > 0, 0.3, np.nan).astype(np.float32)
    view = SearchView("", 1, 1, 0, grid, occupancy, layers, similarity)
    pose = Pose2d(2.0, 2.0, 0.0)
    context = build_context(pose, view, CostmapParams(), BesideMap(TRAIL_XY))
    for goal in frontier_goals(find_frontiers(context.map_view, context.costmap), context):
        context.drive_to(goal.viewpoint_xy, goal.look_xy)
    turns = Velocity2d(0.3, 0.1)
    monitored(turns, turns, pose, context.costmap, DriveParams(), times=ControlTimes(0.05))


if __name__ == "__main__":  # make, deploy/systemd/install.sh and the image's build call it
    warm_up()
    print("a way was planned")
