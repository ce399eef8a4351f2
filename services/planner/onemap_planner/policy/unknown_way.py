"""The way to a place through unknown floor, and the frontier that it crosses first.

The way is planned as if unknown floor were free (the free-space assumption, Koenig and Smirnov
1996), so that it finds the door to another room. The robot drives only its known part; what it
sees there replaces the assumption at the next step.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from onemap_planner.motion.path import CostToGo, cost_to_go_from_any
from onemap_planner.policy.context import PlanningContext
from onemap_planner.world.costmap import IMPASSABLE, distance_cells
from onemap_shared.geometry import F64, I64, Bool
from onemap_shared.messages import Occupancy

PAD_CELLS = 10  # unknown cells around the map, so that a way may lead around what is known
LOOK_AHEAD_M = 0.5  # the robot faces the way this far beyond the last known cell
SAME_WAY_M = 0.1  # cells whose way is at most this much longer lie on the best one


@dataclass(frozen=True, slots=True)
class FrontierOnWay:
    """Where a way leaves the known floor.

    cell (2,): the last known one; ahead (2,): on the way beyond it, inside the grid; left_m: cost
    of the rest of the way.
    """

    cell: I64
    ahead: I64
    left_m: float


def frontier_on_way(
    xy: tuple[float, float],
    context: PlanningContext,
    closed: Bool,
    *,
    within_m: float,
    unknown_cost: float,
) -> FrontierOnWay | None:
    """The frontier on the cheapest way to ``within_m`` of a place (metres).

    None if no way leads there, or if it leads over known floor only. closed (nx, ny): floor that
    the robot could not see into, impassable unless it is known to be free.
    """
    way = _way_from(np.asarray(xy), context, closed, within_m, unknown_cost)
    if way is None:
        return None
    grid = context.costmap.grid
    left_m = way.cost_m[PAD_CELLS:-PAD_CELLS, PAD_CELLS:-PAD_CELLS]
    total_m = np.where(_candidates(context), context.cost_to_go.cost_m + left_m, np.inf)
    if not np.isfinite(total_m).any():
        return None
    on_way = total_m <= total_m.min() + SAME_WAY_M
    cell = np.array(np.unravel_index(np.argmin(np.where(on_way, left_m, np.inf)), left_m.shape))
    if left_m[tuple(cell)] == 0:
        return None
    padded = cell + PAD_CELLS
    steps = way.path_to((int(padded[0]), int(padded[1])))[::-1] - PAD_CELLS
    ahead = steps[min(int(LOOK_AHEAD_M / grid.cell_size_m), len(steps) - 1)]
    inside = np.clip(ahead, 0, np.array(grid.shape) - 1)
    return FrontierOnWay(cell, inside, float(left_m[tuple(cell)]))


def visit_counts(context: PlanningContext, visited_xy: F64, radius_m: float) -> I64:
    """(nx, ny): how many of the points (V, 2), metres, lie within the radius of each cell."""
    grid = context.costmap.grid
    counts = np.zeros(grid.shape, np.int64)
    for cell in grid.cells(visited_xy.reshape(-1, 2)):
        counts += distance_cells(grid, cell) * grid.cell_size_m <= radius_m
    return counts


def _candidates(context: PlanningContext) -> Bool:
    """Mask (nx, ny) of where the known part of a way may end.

    Reachable floor that the camera saw, and where the robot stands. Floor that is free only
    because the robot stands on it would let it creep into the unknown.
    """
    mask: Bool = context.costmap.navigable & (context.map_view.occupancy == Occupancy.FREE)
    mask[tuple(context.costmap.grid.cells(np.asarray(context.pose.xy)))] = True
    return mask


def _way_from(
    xy: F64, context: PlanningContext, closed: Bool, within_m: float, unknown_cost: float
) -> CostToGo | None:
    """Costs and ways (nx + 2 pad, ny + 2 pad) from the place; None if nothing leads there."""
    costmap = context.costmap
    unknown = ~costmap.navigable & ~costmap.occupied & ~closed
    unknown &= costmap.clearance_m >= context.params.min_clearance_m
    cost = np.where(unknown, unknown_cost, IMPASSABLE)
    cost = np.where(costmap.passable, costmap.cost, cost)
    cost[closed & ~_candidates(context)] = IMPASSABLE  # the robot's own trail too
    cost = np.pad(cost, PAD_CELLS, constant_values=unknown_cost)
    ends = _ends(xy, context, cost > 0, within_m)
    if len(ends) == 0:
        return None
    return cost_to_go_from_any(cost, ends, cell_size_m=costmap.grid.cell_size_m)


def _ends(xy: F64, context: PlanningContext, passable: Bool, within_m: float) -> I64:
    """Cells (N, 2) of the padded grid: the place's own if it is passable, else the nearest ones.

    None farther than ``within_m``; but a place beyond the padding stands for the nearest cell of
    its rim.
    """
    grid = context.costmap.grid
    place = np.asarray(grid.cells(xy)) + PAD_CELLS
    nearest = np.clip(place, 0, np.array(passable.shape) - 1)
    if passable[tuple(nearest)]:
        return nearest[None]
    cells = np.argwhere(passable)
    away_m = np.hypot(*(cells - place).T) * grid.cell_size_m
    ends: I64 = cells[away_m <= min(float(away_m.min()) + grid.cell_size_m, within_m)]
    return ends
