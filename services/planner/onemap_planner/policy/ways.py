"""Options on the optimistic way: as if unknown floor were free, and what came lately would go.

Where such a way leaves the floor that the robot can drive on, it looks what is there. What it sees
is known floor from then on. A narrow gap that it looked into in vain is crossed, creeping; any
other place is closed after two looks, and the way leads elsewhere.
"""

from __future__ import annotations

import numpy as np

from onemap_planner.policy.context import PlanningContext
from onemap_planner.policy.goals import Goal, GoalKind, GoalUtility
from onemap_planner.policy.viewpoints import SightTarget, first_visible, viewpoints_around
from onemap_planner.sentences import OBSTACLE
from onemap_planner.world.costmap import BLOCKED_COST, LOOKED_INTO_M
from onemap_shared.geometry import F64, I64, Bool
from onemap_shared.messages import Occupancy

LOOK_AHEAD_M = 0.5  # the robot faces the way this far beyond the last known cell
# Metres from which floor is seen at more than 20 degrees from a camera at 1 m.
FLOOR_FARTHEST_M = 3.0


def option_on_way(
    end_xy: tuple[float, float],
    context: PlanningContext,
    looked_xy: F64,
    *,
    doing: str,
    score: float = 0.0,
) -> Goal | None:
    """The option where the optimistic way to a point, metres, leaves known floor.

    None if no way leads there, or known floor does. looked_xy (L, 2): metres, where the robot
    looked for floor before: the next time it looks from farther away, since its camera does not see
    the floor before its feet. doing, score: of the option; without a score only the way counts.
    """
    hopeful, grid = context.optimistic, context.costmap.grid
    end = context.cell_at(end_xy)
    if not hopeful.reachable[tuple(end)]:
        return None
    path = hopeful.cost_to_go.path_to((int(end[0]), int(end[1])))
    last = int(np.flatnonzero(_drivable(context)[tuple(path.T)])[-1])
    if last == len(path) - 1:
        return None
    ahead = path[min(last + int(LOOK_AHEAD_M / grid.cell_size_m), len(path) - 1)][None]
    obstacle, viewpoint = _obstacle(path[last + 1 :], context), path[last]
    target = obstacle if len(obstacle) else ahead
    x, y = grid.centres(target).mean(axis=0).tolist()
    looked = (np.hypot(*(looked_xy - (x, y)).T) <= LOOKED_INTO_M).any()
    if len(obstacle) or looked:
        band_m = (context.params.escape_radius_m, FLOOR_FARTHEST_M)
        seen_from = first_visible(viewpoints_around(SightTarget(target), context, band_m))
        viewpoint = viewpoint if seen_from is None else seen_from
    travel_m = hopeful.cost_to_go.length_m((int(end[0]), int(end[1])))
    utility = GoalUtility(score, travel_m)
    doing = OBSTACLE if len(obstacle) else doing
    return Goal(GoalKind.FRONTIER, context.xy_of(viewpoint), (x, y), utility, doing)


def end_near(
    xy: tuple[float, float], context: PlanningContext, within_m: float
) -> tuple[float, float] | None:
    """The end, metres, of the optimistic way to a place: as near to it as the way leads, None if
    that is farther than ``within_m``. A place beyond the grid stands for the nearest cell."""
    hopeful, grid = context.optimistic, context.costmap.grid
    cells = np.argwhere(hopeful.reachable)
    place = np.clip(context.cell_at(xy), 0, np.array(grid.shape) - 1)
    away_m = np.hypot(*(cells - place).T) * grid.cell_size_m
    near = cells[away_m <= min(away_m.min(initial=np.inf) + grid.cell_size_m, within_m)]
    if len(near) == 0:
        return None
    return context.xy_of(near[np.argmin(hopeful.cost_to_go.cost_m[tuple(near.T)])])


def _drivable(context: PlanningContext) -> Bool:
    """Mask (nx, ny) of the known floor that a way may lead over.

    Floor that is free only because the robot stands on it would let it creep into the unknown.
    """
    mask: Bool = context.reachable & (context.map_view.occupancy == Occupancy.FREE)
    mask[tuple(context.cell_at(context.pose.xy))] = True
    return mask


def _obstacle(path: I64, context: PlanningContext) -> I64:
    """Cells (K, 2) of what stands on the first part of a path (N, 2) that is not passable, where
    floor was seen once; none if it is unknown floor."""
    costmap = context.costmap
    blocked = context.optimistic.costmap.cost[tuple(path.T)] == BLOCKED_COST
    closed = path[: int(np.argmin([*blocked, False]))]
    occupied = np.argwhere(costmap.occupied & context.map_view.floor_seen)
    away = np.hypot(*(occupied[:, None] - closed[None]).transpose(2, 0, 1)).min(axis=1, initial=1e9)
    size = costmap.grid.cell_size_m
    obstacle: I64 = occupied[away * size <= context.params.min_clearance_m + size / 2]
    return obstacle
