"""Ways that something closes which may have gone: it is looked at before a search gives up.

Somebody who walked through a door when the camera last saw it stays on the map until the camera
sees through the place again. A wall hides the floor that it stands on; a passer-by does not, and
where the floor was seen once there may be a way.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy import ndimage

from onemap_planner.motion.path import cost_to_go_from
from onemap_planner.policy.context import PlanningContext
from onemap_planner.policy.goals import Goal, GoalKind, GoalUtility
from onemap_planner.policy.place_params import PlaceParams
from onemap_planner.policy.viewpoints import SightTarget, first_visible, viewpoints_around
from onemap_planner.world.components import components
from onemap_planner.world.costmap import IMPASSABLE, RETURN_FACTOR
from onemap_shared.geometry import F64, I64, Bool

LEAST_CLOSED_M2 = 1.0  # less floor out of reach is the rim of furniture


def looks_at_closed_ways(
    context: PlanningContext, tried_xy: F64, params: PlaceParams
) -> Iterator[Goal]:
    """Views of what closes the ways to floor that no path leads to, the largest part first.

    From where the camera sees the floor there, so that the map follows what it shows; tried_xy
    (T, 2): metres, where the robot looked from before.
    """
    parts = components(context.cut_off())
    size_m2 = context.map_view.cell_area_m2
    tried = context.costmap.grid.cells(tried_xy)
    for part in sorted(parts, key=len, reverse=True):
        if len(part) * size_m2 < LEAST_CLOSED_M2:
            return
        obstacle = _closing_obstacle(context, part)
        goal = _look_at(obstacle, context, tried, params) if len(obstacle) else None
        if goal is not None:
            yield goal


def _look_at(
    obstacle: I64, context: PlanningContext, tried: I64, params: PlaceParams
) -> Goal | None:
    """The nearest view of an obstacle's cells (K, 2), not from tried ones (T, 2); None without."""
    grid = context.costmap.grid
    around = viewpoints_around(
        SightTarget(obstacle),
        context.costmap,
        context.cost_to_go,
        band_m=(context.params.escape_radius_m, params.view_farthest_m),
        tried=tried,
    )
    cell = first_visible(around)
    if cell is None:
        return None
    (x, y), (look_x, look_y) = grid.centres(cell), grid.centres(obstacle).mean(axis=0)
    travel_m = float(context.cost_to_go.cost_m[tuple(cell)])
    return Goal(
        GoalKind.LOOK_AT,
        (float(x), float(y)),
        (float(look_x), float(look_y)),
        GoalUtility.of_place(travel_m),
        "what stands where floor was seen once, in the only way to the floor behind it",
    )


def _closing_obstacle(context: PlanningContext, beyond: I64) -> I64:
    """Cells (K, 2) of the first obstacle on the way to the cells (N, 2) beyond; empty if there is
    no way, over floor that was seen once."""
    costmap = context.costmap
    size = costmap.grid.cell_size_m
    here = costmap.grid.cells(np.asarray(context.pose.xy))
    cost = _cost_without_passers_by(context)
    way = cost_to_go_from(cost, (int(here[0]), int(here[1])), cell_size_m=size)
    nearest = beyond[np.argmin(way.cost_m[tuple(beyond.T)])]
    if not np.isfinite(way.cost_m[tuple(nearest)]):
        return beyond[:0]
    path = way.path_to((int(nearest[0]), int(nearest[1])))
    passable = costmap.passable[tuple(path.T)]
    first = int(np.argmin(passable))
    closed = path[first : first + max(int(np.argmax(passable[first:])), 1)]
    occupied = np.argwhere(costmap.occupied & context.map_view.floor_seen)
    away = np.hypot(*(occupied[:, None] - closed[None]).transpose(2, 0, 1)).min(axis=1, initial=1e9)
    obstacle: I64 = occupied[away * size <= context.params.min_clearance_m + size / 2]
    return obstacle


def _cost_without_passers_by(context: PlanningContext) -> F64:
    """Costs (nx, ny) as if nothing stood where floor was seen once; dear where something does."""
    costmap, size = context.costmap, context.costmap.grid.cell_size_m
    seen = context.map_view.floor_seen
    lasting: Bool = costmap.occupied & ~seen
    away_m = np.full(seen.shape, np.inf)
    if lasting.any():
        away_m = ndimage.distance_transform_edt(~lasting) * size - size / 2
    open_once = (seen | costmap.free) & (away_m >= context.params.min_clearance_m)
    dear = RETURN_FACTOR * context.params.dearest
    cost: F64 = np.where(
        costmap.passable, costmap.cost, np.where(open_once, dear, IMPASSABLE)
    ).astype(np.float64)
    return cost
