"""Map window, costmap and cost-to-go of one planning step, computed once for all that follows."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from math import inf, isfinite, radians, tan

import numpy as np

from onemap_planner.motion.motions import Drive, Pose2d
from onemap_planner.motion.path import CostToGo, cost_to_go_from, smooth_path
from onemap_planner.world.appeared import NOTHING, Appeared
from onemap_planner.world.candidates import CONSENSUS, Consensus
from onemap_planner.world.costmap import (
    MAP_ALONE,
    BesideMap,
    Costmap,
    CostmapParams,
    build_costmap,
    optimistic,
)
from onemap_planner.world.description import Description
from onemap_planner.world.distances import distance_cells
from onemap_planner.world.map_view import MapView, PlanningView, map_view_around
from onemap_shared.geometry import F64, I64, Bool
from onemap_shared.messages import CameraView, Occupancy
from onemap_shared.places import NO_ZONES, Zones

APPROACH_NEAREST_M = 0.7  # metres from the object's surface; nearer, it fills the image
# Metres tried when nothing nearer can be reached; success is 1.5 m (paper), and what the map takes
# for the surface may lie two cells before it.
APPROACH_LAST_RESORT_M = 1.25
# Metres from which what detector and map agree on is confirmed if the robot fits nowhere nearer, as
# before a bathtub behind a washbasin: success (paper).
APPROACH_LIMIT_M = 1.5
LEAST_BAND_M = 0.2  # that its height leaves of a band: two cells of the default size
SURROUNDINGS_M = 1.0  # radius of the circle of `known_fraction_around`


# Of a robot whose mapper has not told its own: the simulator's, 79 by 63 degrees, 12 down.
USUAL_CAMERA = CameraView(height_m=1.0, down_deg=43.0, up_deg=20.0, across_deg=79.0)


@dataclass(frozen=True, slots=True)
class Bands:
    """Distances from a target's surface to look at it from, by its height."""

    farthest_m: float = 1.1
    camera: CameraView = USUAL_CAMERA

    def at(self, height_m: float) -> tuple[tuple[float, float], ...]:
        """Nearest and farthest of each band, in the order in which they are tried, for a target
        at this height, NaN if it is not known: as usual, the last resort, and up to the limit.

        Nearer than where the camera has that height in its image, it looks over the target, or
        under it: such places are left out, but for the farthest ones.
        """
        shown_m = 0.0
        if isfinite(height_m):
            below_m = self.camera.height_m - height_m
            reach_deg = self.camera.down_deg if below_m > 0 else self.camera.up_deg
            shown_m = abs(below_m) / tan(radians(reach_deg)) if reach_deg > 0 else inf
        return tuple(
            (max(APPROACH_NEAREST_M, min(shown_m, farthest_m - LEAST_BAND_M)), farthest_m)
            for farthest_m in (self.farthest_m, APPROACH_LAST_RESORT_M, APPROACH_LIMIT_M)
        )


@dataclass(frozen=True)
class PlanningContext:
    """What the map offers from the pose of the robot; params: those of the costmap.

    whole: whether all of the known map is in it, or the part around the way to the goal only;
    appeared: what has just appeared on it; bands: from how far things are looked at;
    consensus: when detector and map agree; reached: the goal at which the robot's own navigation
    says it stands, None without one; zones: that it keeps out of; description: of the object,
    None if nothing is said of it.
    """

    pose: Pose2d
    map_view: MapView
    costmap: Costmap
    cost_to_go: CostToGo
    params: CostmapParams
    whole: bool = True
    appeared: Appeared = NOTHING
    bands: Bands = Bands()
    consensus: Consensus = CONSENSUS
    reached: Pose2d | None = None
    zones: Zones = NO_ZONES
    description: Description | None = None

    def believed(self, map_view: MapView, *, drawn: bool = False) -> MapView:
        """The map view with the joint belief in the object that is described."""
        if self.description is None:
            return map_view
        return self.description.believed(map_view, drawn=drawn)

    def drive_to(self, viewpoint_xy: tuple[float, float], look_xy: tuple[float, float]) -> Drive:
        """The smoothed optimal path to a reachable point (metres), facing ``look_xy`` there."""
        x, y = self.cell_at(viewpoint_xy).tolist()
        cells = smooth_path(self.costmap.cost, self.cost_to_go.path_to((x, y)))
        points = self.costmap.grid.centres(cells)
        if len(points) > 1:
            points = np.vstack([[self.pose.xy], points[1:]])
        return Drive(points, look_xy)

    @cached_property
    def optimistic(self) -> PlanningContext:
        """The context on the optimistic costmap, see there."""
        costmap = optimistic(self.costmap, self.map_view.floor_seen)
        return replace(self, costmap=costmap, cost_to_go=_cost_to_go(costmap, self.pose))

    @property
    def place(self) -> Bool | None:
        """Cells (nx, ny) of the places in one of which the object is, if the map shows them."""
        return None if self.description is None else self.description.place

    @cached_property
    def reachable(self) -> Bool:
        """Mask (nx, ny) of the cells of N that a path leads to."""
        mask: Bool = self.costmap.navigable & np.isfinite(self.cost_to_go.cost_m)
        return mask

    def cell_at(self, xy: tuple[float, float]) -> I64:
        """The cell (2,) of a point in metres, which may lie outside of the grid."""
        return self.costmap.grid.cells(np.asarray(xy))

    def xy_of(self, cell: I64) -> tuple[float, float]:
        """The centre of a cell (2,), metres."""
        x, y = self.costmap.grid.centres(cell)
        return float(x), float(y)

    def known_fraction_around(self) -> float:
        """Fraction of the circle of ``SURROUNDINGS_M`` around the robot that is known."""
        grid = self.map_view.grid
        away_m = distance_cells(grid, self.cell_at(self.pose.xy)) * grid.cell_size_m
        known = self.map_view.occupancy[away_m <= SURROUNDINGS_M] != Occupancy.UNKNOWN
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
    params: CostmapParams,
    beside: BesideMap = MAP_ALONE,
    *,
    before: Appeared = NOTHING,
    window_xy: F64 | None = None,
) -> PlanningContext:
    """The context at this pose.

    before: what had appeared on the view before this one; window_xy: see ``map_view_around``.
    """
    here = np.asarray(pose.xy)
    map_view = map_view_around(view, here, window_xy)
    appeared = before.with_view(map_view, here, view.stamp_ns * 1e-9)
    beside = replace(beside, appeared_xy=appeared.xy)
    costmap = build_costmap(map_view, here, params, beside)
    return PlanningContext(
        pose,
        map_view,
        costmap,
        _cost_to_go(costmap, pose),
        params,
        whole=window_xy is None,
        appeared=appeared,
        zones=beside.zones,
    )


def _cost_to_go(costmap: Costmap, pose: Pose2d) -> CostToGo:
    x, y = costmap.grid.cells(np.asarray(pose.xy)).tolist()
    return cost_to_go_from(costmap.cost, (x, y), cell_size_m=costmap.grid.cell_size_m)
