"""Goals at frontiers, at regions of the map and at uncertain detections."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
from scipy import ndimage

from onemap_planner.motion.path import CostToGo, line_is_clear
from onemap_planner.policy.context import PlanningContext
from onemap_planner.policy.goals import Goal, GoalKind, GoalParams, GoalUtility
from onemap_planner.policy.viewpoints import (
    SightTarget,
    first_visible,
    least_occluded,
    reachable,
    viewpoints_around,
)
from onemap_planner.world.candidates import ObjectCandidate
from onemap_planner.world.costmap import Costmap
from onemap_planner.world.frontier import Frontier
from onemap_planner.world.map_view import WorldCells
from onemap_planner.world.regions import SimilarRegion
from onemap_shared.geometry import F64, I64
from onemap_shared.grid import GridSpec

MAX_FRONTIER_CELLS = 5  # lines of sight tried per frontier, from its middle outwards


def frontier_goals(
    frontiers: tuple[Frontier, ...], costmap: Costmap, cost_to_go: CostToGo, *, params: GoalParams
) -> list[Goal]:
    """A goal for each frontier with a reachable viewpoint."""
    reachable_mask = reachable(costmap, cost_to_go)
    if not reachable_mask.any():
        return []
    size = costmap.grid.cell_size_m
    away, nearest = ndimage.distance_transform_edt(~reachable_mask, return_indices=True)
    visible: list[tuple[Frontier, I64]] = []
    for frontier in frontiers:
        cells = frontier.cells
        near = away[cells[:, 0], cells[:, 1]] * size <= params.viewpoint_within_m
        viewpoint = _frontier_viewpoint(cells[near], nearest, costmap)
        if viewpoint is not None:
            visible.append((frontier, viewpoint))
    ways_m = cost_to_go.lengths_m(np.array([cell for _, cell in visible]).reshape(-1, 2))
    return [
        _frontier_goal(frontier, viewpoint, travel_m, costmap.grid, params)
        for (frontier, viewpoint), travel_m in zip(visible, ways_m.tolist(), strict=True)
    ]


def _frontier_goal(
    frontier: Frontier,
    viewpoint: I64,
    travel_m: float,
    grid: GridSpec,
    params: GoalParams,
) -> Goal:
    length_m = len(frontier.cells) * grid.cell_size_m
    utility = GoalUtility.of(frontier.score, travel_m, params, length_m=length_m)
    what = "unknown space" if frontier.unknown else "a place seen only from afar"
    reason = (
        f"frontier: {what} {travel_m:.1f} m away, similarity {frontier.score:.2f} expected beyond"
    )
    look_xy = _pair(frontier.beyond_xy)
    viewpoint_xy, cells = _pair(grid.centres(viewpoint)), _world_cells(frontier.cells, grid)
    return Goal(GoalKind.FRONTIER, viewpoint_xy, look_xy, utility, reason, cells)


def region_goals(
    regions: tuple[SimilarRegion, ...],
    costmap: Costmap,
    cost_to_go: CostToGo,
    *,
    tried_xy: F64,
    params: GoalParams,
) -> list[Goal]:
    """A goal for each region that has a viewpoint not tried before (T, 2), metres."""
    goals = []
    band_m = (params.view_nearest_m, params.view_farthest_m)
    tried = costmap.grid.cells(tried_xy)
    for region in regions:
        target = SightTarget(region.cells)
        around = viewpoints_around(target, costmap, cost_to_go, band_m=band_m, tried=tried)
        viewpoint = first_visible(around)
        if viewpoint is None:
            viewpoint = least_occluded(around)
        if viewpoint is None:
            continue
        utility = GoalUtility.of(region.score, _travel_m(cost_to_go, viewpoint), params)
        reason = f"region: similarity {region.score:.2f} on the map, {utility.travel_m:.1f} m away"
        cells = _world_cells(region.cells, costmap.grid)
        look_xy = _pair(region.peak_xy)
        goals.append(
            Goal(GoalKind.REGION, _xy(costmap, viewpoint), look_xy, utility, reason, cells)
        )
    return goals


def detection_goals(
    candidates: Iterable[tuple[ObjectCandidate, float]],
    context: PlanningContext,
    *,
    viewpoint_of: Callable[[ObjectCandidate], tuple[float, float] | None],
    params: GoalParams,
) -> list[Goal]:
    """A closer look at each candidate that is not sure enough to be approached.

    candidates: each with its score, in units of similarity. viewpoint_of: from where to look at
    one, metres, if there is such a place.
    """
    goals = []
    for candidate, score in candidates:
        viewpoint_xy = viewpoint_of(candidate)
        if viewpoint_xy is None:
            continue
        cell = context.costmap.grid.cells(np.asarray(viewpoint_xy))
        utility = GoalUtility.of(score, _travel_m(context.cost_to_go, cell), params)
        kind = "similarity" if candidate.supported else "the map does not agree, probability"
        reason = (
            f"detection: seen {candidate.sightings} times, {kind} {score:.2f}, "
            f"a closer look {utility.travel_m:.1f} m away"
        )
        there = candidate.xyz[:2]
        goals.append(
            Goal(GoalKind.DETECTION, viewpoint_xy, there, utility, reason, candidate.cells)
        )
    return goals


def _frontier_viewpoint(cells: I64, nearest: I64, costmap: Costmap) -> I64 | None:
    """The reachable cell nearest to the middle of the frontier and in sight of it."""
    if len(cells) == 0:
        return None
    away = np.hypot(*(cells - cells.mean(axis=0)).T)
    for cell in cells[np.argsort(away, kind="stable")][:MAX_FRONTIER_CELLS]:
        viewpoint: I64 = nearest[:, cell[0], cell[1]].astype(np.int64)
        if line_is_clear(~costmap.occupied, viewpoint, cell):
            return viewpoint
    return None


def _travel_m(cost_to_go: CostToGo, cell: I64) -> float:
    """Metres of path: its cost would make a way along a wall count up to fourfold."""
    return float(cost_to_go.lengths_m(cell[None])[0])


def _world_cells(cells: I64, grid: GridSpec) -> WorldCells:
    """World cells of grid indices (K, 2)."""
    return frozenset(map(tuple, (cells + np.asarray(grid.origin_cell)).tolist()))


def _xy(costmap: Costmap, cell: I64) -> tuple[float, float]:
    return _pair(costmap.grid.centres(cell))


def _pair(xy: F64) -> tuple[float, float]:
    return float(xy[0]), float(xy[1])
