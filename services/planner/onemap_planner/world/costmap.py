"""Costmap: the navigable map N (cells for the robot's centre), costs and clearances."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import ClassVar, NamedTuple

import cv2
import numpy as np
from pydantic import Field, PositiveFloat

from onemap_planner.world.distances import distance_cells, distances_m, distances_to_edge_m
from onemap_planner.world.keep_out import KeepOut
from onemap_planner.world.map_view import CONNECTIVITY_8, MapView
from onemap_shared.geometry import F32, F64, I64, Bool
from onemap_shared.grid import GridSpec
from onemap_shared.jit import compiled
from onemap_shared.messages import Occupancy
from onemap_shared.params import Params
from onemap_shared.places import NO_ZONES, Zones

IMPASSABLE = -1.0  # MCP_Geometric's mark for cells that no path enters
RETURN_FACTOR = 2.0  # outside N, on the own trail or out of a trap: dearer than any way through N
LEAVE_FACTOR = 200.0  # out of a keep-out zone: the shortest way, wherever else it wants to go
HERE: I64 = np.zeros((1, 2), np.int64)
NEIGHBOURHOOD: I64 = np.argwhere(CONNECTIVITY_8) - 1
CLEAR_M = 0.5  # metres of clearance from which on a robot need not slow down
# Cost of a metre of unknown floor, in metres of known floor, when a way is planned as if it were
# free: a known way is preferred if it is at most half as long again.
UNKNOWN_COST = 1.5
BLOCKED_COST = 20.0  # where something stands that was not there once: dearer than any way around
LOOKED_INTO_M = 0.5  # around a place that was looked into, whose floor was not seen
# Metres around the robot's way within which unknown floor tells nothing: a camera at 1 m sees the
# floor from 1.1 m on, but what stands there it saw above it.
BLIND_RADIUS_M = 1.2
ROUNDING_M = 1e-6
RECENT_POINTS = 10  # of the trail, a metre: were they a way back, the robot could creep forwards


class CostmapParams(Params):
    """How the robot's size turns occupancy into the navigable map and its costs."""

    radius_m: PositiveFloat = Field(
        default=0.2, description="Robot's radius seen from above, metres."
    )

    # Metres kept from obstacles besides the radius: half a map cell.
    margin_m: ClassVar[float] = 0.05
    # Metres by which the footprint may reach over unknown cells. 0.17 of 0.2: the centre stays on
    # known floor; with 0 a door that was seen in part is closed.
    unknown_overlap_m: ClassVar[float] = 0.17
    # Metres beyond the least clearance from which on more is no better: half a wide door in all.
    inflation_m: ClassVar[float] = 0.3
    # Extra cost per metre at the least clearance; 3 keeps to the middle of doors.
    inflation_weight: ClassVar[float] = 3.0
    # Extra cost per metre on the border of what no camera saw, less with distance: the robot creeps
    # where its body comes over that.
    unseen_weight: ClassVar[float] = 6.0
    # Metres around a robot outside the navigable map through which it may leave: a level camera at
    # 1 m sees the floor only from about that far.
    escape_radius_m: ClassVar[float] = 1.2
    # Metres around the place where the search began in which assumed floor is a blind spot: the
    # camera saw floor beyond it. A wider one might hide a stair.
    blind_m: ClassVar[float] = 1.2
    # Metres from floor that was seen, up to which such a robot may cross unknown floor, at the
    # speed of driving backwards: where the robot was put down, its camera missed a ring about that
    # wide.
    escape_unknown_m: ClassVar[float] = 0.5
    # Metres around a drop in which floor that no camera saw counts as missing too: wider than what
    # the footprint may reach over unknown cells.
    beside_drop_m: ClassVar[float] = 0.4
    # Widest gap of unknown floor, metres, that is crossed, creeping, after it was looked into in
    # vain and floor was seen beyond it: narrower than a stair. 0: none.
    gap_m: ClassVar[float] = 0.7
    # Square metres: a navigable pocket smaller than this is left by escaping; nothing worth finding
    # fits in it.
    escape_below_m2: ClassVar[float] = 1.0

    @property
    def dearest(self) -> float:
        """The most that a metre through N costs, in metres of effort."""
        return 1.0 + self.inflation_weight + self.unseen_weight

    @property
    def min_clearance_m(self) -> float:
        """Least distance from the robot's centre to an obstacle, metres."""
        return self.radius_m + self.margin_m


@dataclass(frozen=True, slots=True)
class Costmap:
    """All arrays (nx, ny) on ``grid``.

    occupied bool; free bool: known to be free floor; navigable bool: N; cost float64: metres
    of effort per metre driven, >= 1, negative where impassable (passable besides N: the
    robot's own trail, and its surroundings while it has to escape); clearance_m float32: to
    the nearest obstacle's edge, infinity without any; near_trail bool: within
    ``BLIND_RADIUS_M`` of where the robot's centre has been; returning bool: the robot's way until
    a metre ago, which it may drive back slowly; unseen bool: neither occupied nor floor that a
    camera saw or the robot's disc covered, and not blind; blind bool: assumed floor around the
    place where the search began, below the camera's image, until the robot ran into something
    there; creeping bool: the robot's disc there comes over unseen floor, so that it creeps;
    appeared bool: occupied since a moment ago, by somebody who may come nearer; closed bool:
    around places that were looked into in vain again and again. params: the robot's
    size. keep_out: zones that no path enters and that hide nothing; None without any. drops bool:
    of the occupied, where there is no floor, or beside that none that was seen: no part of the
    robot comes over them, however slowly.
    """

    grid: GridSpec
    occupied: Bool
    drops: Bool
    free: Bool
    navigable: Bool
    cost: F64
    clearance_m: F32
    near_trail: Bool
    returning: Bool
    unseen: Bool
    blind: Bool
    creeping: Bool
    appeared: Bool
    closed: Bool
    params: CostmapParams
    keep_out: KeepOut | None = None

    @property
    def passable(self) -> Bool:
        """Mask (nx, ny) of the cells that a path may enter."""
        mask: Bool = self.cost > 0
        return mask


def no_points() -> F64:
    """No points, (0, 2) metres."""
    return np.zeros((0, 2))


@dataclass(frozen=True, slots=True, eq=False)
class BesideMap:
    """What a costmap takes in beside the map; points are metres in the map frame.

    trail_xy (K, 2): where the robot's centre has been, so that the floor there is free even if no
    camera saw it, but for the last metre: else the robot's own steps would make way into the
    unknown; obstacles_xy (B, 2): virtual obstacles, which the robot ran into and no map shows;
    zones: that it keeps out of; appeared_xy (N, 2): where somebody has just appeared;
    looked_into_xy (L, 2): where the robot looked for floor and saw none; closed_xy (C, 2): where it
    did so too often.
    """

    trail_xy: F64 = field(default_factory=no_points)
    obstacles_xy: F64 = field(default_factory=no_points)
    zones: Zones = NO_ZONES
    appeared_xy: F64 = field(default_factory=no_points)
    looked_into_xy: F64 = field(default_factory=no_points)
    closed_xy: F64 = field(default_factory=no_points)


MAP_ALONE = BesideMap()


def build_costmap(
    map_view: MapView, robot_xy: F64, params: CostmapParams, beside: BesideMap = MAP_ALONE
) -> Costmap:
    """The costmap of a map view, for a robot at ``robot_xy`` (2,), metres, inside its grid."""
    grid, size, radius_m = map_view.grid, map_view.grid.cell_size_m, params.radius_m
    robot, trail_xy = grid.cells(robot_xy), beside.trail_xy
    earlier_xy = trail_xy[:-RECENT_POINTS]
    # What is known: obstacles, floor, floor that was assumed, and what is missing of it.
    seen_free = map_view.occupancy == Occupancy.FREE
    driven = _disc(grid, earlier_xy, radius_m)
    covered = _disc(grid, earlier_xy, radius_m - size)  # as a whole, wherever in its cell it was
    occupied = (map_view.occupancy == Occupancy.OCCUPIED) | _mark(grid, beside.obstacles_xy)
    unseen = ~(covered | occupied | (seen_free & ~map_view.assumed))
    beside_m = distances_m(map_view.drops, size, params.beside_drop_m)
    drops = map_view.drops | (unseen & (beside_m <= params.beside_drop_m))
    occupied |= drops
    free = (seen_free | driven) & ~occupied
    unseen &= ~drops
    blind = _blind_spot(unseen & seen_free & map_view.assumed, beside, robot_xy, grid, params)
    unseen &= ~blind
    # Inflation: N, and what a metre through it costs.
    clearance_m = distances_to_edge_m(occupied, size)
    unseen_m = distances_to_edge_m(unseen, size, params.min_clearance_m)
    navigable = free & (clearance_m >= params.min_clearance_m)
    navigable &= ~_near_unknown(free | occupied, size, params)
    cost = _effort(navigable, clearance_m, unseen_m, _Effort.of(params))
    # Besides N: the way that the robot came, and out of a pocket that it is in.
    drop_m = distances_m(drops, size, radius_m + size) - size / 2
    on_floor = drop_m >= min(radius_m, float(drop_m[tuple(robot)]))
    wide_enough = (clearance_m >= radius_m / 2) & on_floor
    cost[_beside(grid, trail_xy) & ~navigable & wide_enough] = RETURN_FACTOR * params.dearest
    if _component_m2(navigable, robot, map_view.cell_area_m2) < params.escape_below_m2:
        way_out = _escape_cells(robot, map_view, occupied, free, params) & (cost < 0) & on_floor
        cost[way_out] = _escape_cost(clearance_m[way_out], size, params)
    # Narrow gaps whose floor no look showed.
    hidden = _around(grid, beside.looked_into_xy, LOOKED_INTO_M) & ~(free | occupied) & (cost < 0)
    hidden &= clearance_m >= params.min_clearance_m
    if hidden.any():
        gaps = _gaps(hidden, cost > 0, navigable, robot, params.gap_m / size)
        cost[gaps] = RETURN_FACTOR * params.dearest
    # Keep-out zones.
    keep_out = KeepOut.of(beside.zones, grid, cost > 0, params.min_clearance_m)
    if keep_out is not None:
        ways_out = keep_out.ways_out(robot, cost > 0)
        cost[keep_out.closed] = IMPASSABLE
        cost[ways_out] = LEAVE_FACTOR * params.dearest
        navigable &= ~keep_out.closed
        clearance_m = np.minimum(clearance_m, keep_out.clearance_m)
    here_xy = np.vstack([trail_xy, robot_xy])
    return Costmap(
        grid=grid,
        occupied=occupied,
        drops=drops,
        free=free,
        navigable=navigable,
        cost=cost,
        clearance_m=clearance_m.astype(np.float32),
        near_trail=_around(grid, here_xy, BLIND_RADIUS_M),
        returning=_beside(grid, earlier_xy) & wide_enough,
        unseen=unseen,
        blind=blind,
        creeping=unseen_m < radius_m,
        appeared=occupied & _mark(grid, beside.appeared_xy),
        closed=_around(grid, beside.closed_xy, LOOKED_INTO_M),
        params=params,
        keep_out=keep_out,
    )


def _blind_spot(
    assumed: Bool, beside: BesideMap, robot_xy: F64, grid: GridSpec, params: CostmapParams
) -> Bool:
    """Which of the assumed cells (nx, ny) lie below the image where the robot set out; none once it
    ran into something there."""
    start_xy = np.vstack([beside.trail_xy, robot_xy])[0]
    ran_into_m = np.hypot(*(beside.obstacles_xy - start_xy).T).min(initial=np.inf)
    if ran_into_m <= params.blind_m + params.radius_m:
        return np.zeros_like(assumed)
    blind: Bool = assumed.copy()
    if assumed.any():
        away = np.hypot(*(np.argwhere(assumed) - grid.cells(start_xy)).T)
        blind[assumed] = away * grid.cell_size_m <= params.blind_m
    return blind


def _gaps(hidden: Bool, passable: Bool, navigable: Bool, robot: I64, gap_cells: float) -> Bool:
    """Which of the hidden cells (nx, ny) lie in a gap of at most so many cells, between what the
    robot in the cell (2,) can reach and a part of N that it cannot."""
    _, parts = cv2.connectedComponents(passable.astype(np.uint8), connectivity=8)
    reached = passable & (parts == parts[tuple(robot)])
    across = distances_m(reached, 1.0) + distances_m(navigable & ~reached, 1.0) - 1.0
    gaps: Bool = hidden & (across <= gap_cells + ROUNDING_M)
    return gaps


def optimistic(costmap: Costmap, floor_seen: Bool) -> Costmap:
    """The costmap as if unknown floor were free, and as if what stands where floor was seen once
    (nx, ny) would go: dear. What was looked into in vain stays closed."""
    params, size = costmap.params, costmap.grid.cell_size_m
    room_m = distances_to_edge_m(costmap.occupied & ~floor_seen, size)
    once = (floor_seen | costmap.free) & (room_m >= params.min_clearance_m)
    unknown = ~costmap.occupied & (costmap.clearance_m >= params.min_clearance_m)
    cost = np.where(unknown, UNKNOWN_COST, np.where(once, BLOCKED_COST, IMPASSABLE))
    cost[costmap.closed] = IMPASSABLE
    if costmap.keep_out is not None:
        cost[costmap.keep_out.closed] = IMPASSABLE
    cost = np.where(costmap.passable, costmap.cost, cost)
    free = costmap.free | ~costmap.occupied
    return replace(costmap, free=free, navigable=cost > 0, cost=cost)


def _escape_cells(
    robot: I64, map_view: MapView, occupied: Bool, free: Bool, params: CostmapParams
) -> Bool:
    """Mask (nx, ny): where a robot outside N, at the cell ``robot`` (2,), may leave its pocket.

    Around it, and not further from seen floor than its camera missed of the floor when it was put
    down; what its own body covers counts as free.
    """
    grid, size = map_view.grid, map_view.grid.cell_size_m
    distance_m = distance_cells(grid, robot) * size
    body = distance_m <= params.radius_m
    seen_m = distances_m(map_view.occupancy == Occupancy.FREE, size)
    enterable = (~occupied | body) & (free | body | (seen_m <= params.escape_unknown_m))
    cells: Bool = (distance_m <= params.escape_radius_m) & enterable
    return cells


def _escape_cost(clearance_m: F64, cell_size_m: float, params: CostmapParams) -> F64:
    """Metres of effort per metre (n,) outside N, from the distances (n,) to obstacles."""
    needed, outside = params.min_clearance_m, RETURN_FACTOR * params.dearest
    lack = np.clip((needed - clearance_m) / needed, 0.0, 2.0)
    touching = clearance_m < params.radius_m - cell_size_m / 2  # the monitor may not allow it
    cost: F64 = outside * (1.0 + 4.0 * lack + touching)
    return cost


class _Effort(NamedTuple):
    """Metres of clearance that are needed, and that are enough; weights, see ``CostmapParams``."""

    needed_m: float
    enough_m: float
    inflation: float
    unseen: float

    @classmethod
    def of(cls, params: CostmapParams) -> _Effort:
        needed_m = params.min_clearance_m
        enough_m = needed_m + params.inflation_m
        return cls(needed_m, enough_m, params.inflation_weight, params.unseen_weight)


@compiled
def _effort(navigable: Bool, clearance_m: F64, unseen_m: F64, params: _Effort) -> F64:
    """Metres of effort per metre (nx, ny) through N, from the distances to obstacles and unseen
    cells; ``IMPASSABLE`` elsewhere."""
    cost = np.full(navigable.shape, IMPASSABLE)
    band_m = params.enough_m - params.needed_m
    for x in range(navigable.shape[0]):
        for y in range(navigable.shape[1]):
            if navigable[x, y]:
                near = min(max((params.enough_m - clearance_m[x, y]) / band_m, 0.0), 1.0)
                exposed = min(max(1.0 - unseen_m[x, y] / params.needed_m, 0.0), 1.0)
                cost[x, y] = 1.0 + params.inflation * near**2 + params.unseen * exposed
    return cost


def _near_unknown(known: Bool, cell_size_m: float, params: CostmapParams) -> Bool:
    """Mask (nx, ny): the footprint there would reach too far over cells that are not known."""
    keep = (params.radius_m - params.unknown_overlap_m) / cell_size_m + 0.5
    if keep <= 1:
        return np.zeros_like(known)
    near: Bool = distances_m(~known, 1.0) < keep
    return near


def _mark(grid: GridSpec, points_xy: F64, around: I64 = HERE) -> Bool:
    """Mask (nx, ny) of the cells that hold a point, or lie ``around`` (K, 2) one; points outside
    the grid are left out."""
    mask = np.zeros(grid.shape, bool)
    cells = grid.cells(points_xy.reshape(-1, 2))
    cells = (cells[grid.contains(cells)][:, None] + around).reshape(-1, 2)
    cells = cells[grid.contains(cells)]
    mask[cells[:, 0], cells[:, 1]] = True
    return mask


def _disc(grid: GridSpec, points_xy: F64, within_m: float) -> Bool:
    """As ``_around``, for a few cells around each point."""
    reach = max(int((within_m + ROUNDING_M) / grid.cell_size_m), 0)
    around = np.argwhere(np.ones((2 * reach + 1, 2 * reach + 1))) - reach
    near = np.hypot(*around.T) * grid.cell_size_m <= within_m + ROUNDING_M
    return _mark(grid, points_xy, around[near])


def _around(grid: GridSpec, points_xy: F64, within_m: float) -> Bool:
    """Mask (nx, ny) of the cells within a distance of the cell of a point."""
    if len(points_xy) == 0:
        return np.zeros(grid.shape, bool)
    away_m = distances_m(_mark(grid, points_xy), grid.cell_size_m, within_m)
    near: Bool = away_m <= within_m + ROUNDING_M
    return near


def _beside(grid: GridSpec, points_xy: F64) -> Bool:
    """Mask (nx, ny) of the cells that hold a point, and of their eight neighbours."""
    return _mark(grid, points_xy, NEIGHBOURHOOD)


def _component_m2(navigable: Bool, robot: I64, cell_area_m2: float) -> float:
    """Area of the component of N around the robot; 0 if the robot is outside N."""
    if not navigable[tuple(robot)]:
        return 0.0
    _, parts = cv2.connectedComponents(navigable.astype(np.uint8), connectivity=8)
    return float((parts == parts[tuple(robot)]).sum() * cell_area_m2)
