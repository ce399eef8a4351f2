"""Map window, costmap and cost-to-go of one planning step, computed once for all that follows."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from onemap_planner.motion.motions import Drive, Pose2d
from onemap_planner.motion.path import CostToGo, cost_to_go_from, smooth_path
from onemap_planner.world.costmap import (
    NOTHING,
    Appeared,
    Costmap,
    CostmapParams,
    build_costmap,
    distance_cells,
    with_appeared,
    with_gaps,
)
from onemap_planner.world.map_view import MapView, PlanningView, map_view_around
from onemap_shared.geometry import F64, Bool
from onemap_shared.messages import Coverage, Occupancy

SURROUNDINGS_M = 1.0  # radius of the circle of `known_fraction_around`


@dataclass(frozen=True, slots=True)
class PlanningContext:
    """What the map offers from the pose of the robot; params: those of the costmap.

    whole: whether all of the known map is in it, or the part around the way to the goal only;
    appeared: what has just appeared on it.
    """

    pose: Pose2d
    map_view: MapView
    costmap: Costmap
    cost_to_go: CostToGo
    params: CostmapParams
    whole: bool = True
    appeared: Appeared = NOTHING

    def drive_to(self, viewpoint_xy: tuple[float, float], look_xy: tuple[float, float]) -> Drive:
        """The smoothed optimal path to a reachable point (metres), facing ``look_xy`` there."""
        grid = self.costmap.grid
        cell = grid.cells(np.asarray(viewpoint_xy))
        cells = smooth_path(
            self.costmap.cost, self.cost_to_go.path_to((int(cell[0]), int(cell[1])))
        )
        points = grid.centres(cells)
        if len(points) > 1:
            points = np.vstack([[self.pose.xy], points[1:]])
        return Drive(points, look_xy)

    def known_fraction_around(self) -> float:
        """Fraction of the circle of ``SURROUNDINGS_M`` around the robot that is known."""
        grid = self.map_view.grid
        here = grid.cells(np.asarray(self.pose.xy))
        around = distance_cells(grid, here) * grid.cell_size_m <= SURROUNDINGS_M
        known = self.map_view.occupancy[around] != Occupancy.UNKNOWN
        circle = np.pi * (SURROUNDINGS_M / grid.cell_size_m) ** 2  # the window may cut the mask
        return float(known.sum() / circle)

    def cut_off(self) -> Bool:
        """Mask (nx, ny) of the free floor with room for the robot that no path leads to."""
        mask: Bool = self.costmap.navigable & ~np.isfinite(self.cost_to_go.cost_m)
        return mask

    def unreachable_m2(self) -> float:
        """Area of ``cut_off`` in square metres."""
        return float(self.cut_off().sum()) * self.map_view.cell_area_m2


def build_context(
    pose: Pose2d,
    view: PlanningView,
    *,
    trail: tuple[tuple[float, float], ...],
    obstacles_xy: F64,
    params: CostmapParams,
    window_xy: F64 | None = None,
) -> PlanningContext:
    """The context at this pose.

    trail: where the robot has been, metres; obstacles_xy (B, 2): virtual obstacles, metres;
    window_xy: see ``map_view_around``.
    """
    map_view = map_view_around(view, np.asarray(pose.xy), window_xy)
    costmap = build_costmap(
        map_view,
        robot_xy=np.asarray(pose.xy),
        trail_xy=np.array(trail, dtype=np.float64).reshape(-1, 2),
        obstacles_xy=obstacles_xy,
        params=params,
    )
    cost_to_go = _cost_to_go(costmap, pose)
    return PlanningContext(pose, map_view, costmap, cost_to_go, params, window_xy is None)


def with_change(context: PlanningContext, before: Appeared, seen_s: float) -> PlanningContext:
    """The context that knows what has appeared since the view ``before`` it, of ``seen_s``."""
    appeared = before.after(context.map_view, np.asarray(context.pose.xy), seen_s)
    costmap = with_appeared(context.costmap, appeared.xy)
    return replace(context, costmap=costmap, appeared=appeared)


def across_gaps(context: PlanningContext) -> PlanningContext:
    """The context in which paths also cross narrow gaps of unknown floor, see ``with_gaps``."""
    costmap = with_gaps(context.costmap, np.isfinite(context.cost_to_go.cost_m))
    return replace(context, costmap=costmap, cost_to_go=_cost_to_go(costmap, context.pose))


def _cost_to_go(costmap: Costmap, pose: Pose2d) -> CostToGo:
    here = costmap.grid.cells(np.asarray(pose.xy))
    size = costmap.grid.cell_size_m
    return cost_to_go_from(costmap.cost, (int(here[0]), int(here[1])), cell_size_m=size)


def coverage_of(context: PlanningContext) -> Coverage:
    """The coverage of the map as it is now."""
    map_view = context.map_view
    free = map_view.occupancy == Occupancy.FREE
    similarity = np.nan_to_num(map_view.similarity, nan=-1.0)
    best = np.unravel_index(int(np.argmax(similarity)), similarity.shape)
    score = float(similarity[best])
    x, y = map_view.grid.centres(np.array(best))
    return Coverage(
        explored_m2=float((free & map_view.explored).sum()) * map_view.cell_area_m2,
        free_m2=float(free.sum()) * map_view.cell_area_m2,
        unreachable_m2=context.unreachable_m2(),
        best_match_m=(float(x), float(y)) if score >= 0 else (),
        best_score=max(score, 0.0),
    )
