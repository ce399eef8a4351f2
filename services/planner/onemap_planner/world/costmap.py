"""Costmap: the navigable map N (cells for the robot's centre), costs and clearances.

And what has just appeared where the floor was free: somebody who walks about, most likely.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, PositiveFloat
from scipy import ndimage
from skimage.graph import MCP_Geometric

from onemap_planner.world.map_view import CONNECTIVITY_8, MapView
from onemap_shared.geometry import F32, F64, I64, Bool
from onemap_shared.grid import GridSpec, onto
from onemap_shared.messages import Occupancy
from onemap_shared.params import Params
from onemap_shared.places import NO_ZONES, Zones

IMPASSABLE = -1.0  # MCP_Geometric's mark for cells that no path enters
RETURN_FACTOR = 2.0  # outside N, on the own trail or out of a trap: dearer than any way through N
LEAVE_FACTOR = (
    200.0  # out of a keep-out zone: the shortest way, wherever else the robot wants to go
)
HERE: I64 = np.zeros((1, 2), np.int64)
NEIGHBOURHOOD: I64 = np.argwhere(CONNECTIVITY_8) - 1
CLEAR_M = 0.5  # metres of clearance from which on a robot need not slow down
# Metres around the robot's way within which unknown floor tells nothing: a camera at 1 m sees the
# floor from 1.1 m on, but what stands there it saw above it.
BLIND_RADIUS_M = 1.2
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
    # Widest gap of unknown floor, metres, that a search crosses, creeping, when nothing else is
    # left and floor was seen beyond it: narrower than a stair. 0: none.
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

    @property
    def clear_m(self) -> float:
        """Metres of clearance from which on more changes neither cost nor speed."""
        return max(self.min_clearance_m + self.inflation_m, CLEAR_M)


ROUNDING_M = 1e-6


@dataclass(frozen=True, slots=True, eq=False)
class KeepOut:
    """Keep-out zones around a costmap: lethal for paths and commands, but no obstacle to sight.

    cells_xy (n, 2): centres, metres, of the cells that a zone covers, also in part and beyond the
    grid; closed (nx, ny) bool: the robot's centre is nearer to one than paths lead; way_out_m
    (nx, ny) float64: from there to where paths lead, 0 outside and infinity without a way.
    """

    grid: GridSpec
    cells_xy: F64
    closed: Bool
    way_out_m: F64

    def distances_m(self, points: F64, within_m: float) -> F64:
        """Distances (n,) of points (n, 2), metres, to the nearest zone; infinity if none is within
        a distance of the first one."""
        near = (np.abs(self.cells_xy - points[0]) <= within_m + self.grid.cell_size_m).all(axis=1)
        apart = np.abs(points[:, None] - self.cells_xy[near][None]) - self.grid.cell_size_m / 2
        away = np.linalg.norm(np.maximum(apart, 0.0), axis=2)
        nearest: F64 = away.min(axis=1, initial=np.inf)
        return nearest

    def allows(self, here: F64, points: F64, radius_m: float, reach_m: float) -> bool:
        """Whether a disc at ``here`` (2,) may take a path of points (n, 2) and ``reach_m`` metres.

        No part of it comes into a zone. A disc that already reaches into one comes no nearer to it,
        and inside it no farther from the way out.
        """
        away_m = self.distances_m(np.vstack([here, points]), reach_m + radius_m)
        if (away_m[1:] < min(radius_m, away_m[0]) - ROUNDING_M).any():
            return False
        if away_m[0] >= radius_m - ROUNDING_M:
            return True
        cells = self.grid.cells(np.vstack([here, points]))
        way_m = self.way_out_m[tuple(np.clip(cells, 0, np.subtract(self.grid.shape, 1)).T)]
        return bool(((way_m[1:] <= way_m[0]) | (away_m[1:] >= radius_m)).all())


@dataclass(frozen=True, slots=True)
class Costmap:
    """All arrays (nx, ny) on ``grid``.

    occupied bool; free bool: known to be free floor; navigable bool: N; cost float64: metres
    of effort per metre driven, >= 1, negative where impassable (passable besides N: the
    robot's own trail, and its surroundings while it has to escape); clearance_m float32: to
    the nearest obstacle's edge, infinity beyond ``clear_m``; near_trail bool: within
    ``BLIND_RADIUS_M`` of where the robot's centre has been; returning bool: the robot's way until
    a metre ago, which it may drive back slowly; unseen bool: neither occupied nor floor that a
    camera saw or the robot's disc covered, and not blind; blind bool: assumed floor around the
    place where the search began, below the camera's image, until the robot ran into something
    there; creeping bool: the robot's disc there comes over unseen floor, so that it creeps;
    appeared bool: occupied since a moment ago, by somebody who may come nearer. params: the robot's
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
    params: CostmapParams
    keep_out: KeepOut | None = None

    @property
    def passable(self) -> Bool:
        """Mask (nx, ny) of the cells that a path may enter."""
        mask: Bool = self.cost > 0
        return mask

    @property
    def crossable(self) -> Bool:
        """Mask (nx, ny) of the unknown cells that a path may enter all the same, slowly."""
        mask: Bool = self.passable & ~self.free & ~self.occupied
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
    zones: that it keeps out of; appeared_xy (N, 2): where somebody has just appeared.
    """

    trail_xy: F64 = field(default_factory=no_points)
    obstacles_xy: F64 = field(default_factory=no_points)
    zones: Zones = NO_ZONES
    appeared_xy: F64 = field(default_factory=no_points)


MAP_ALONE = BesideMap()


def build_costmap(
    map_view: MapView, robot_xy: F64, params: CostmapParams, beside: BesideMap = MAP_ALONE
) -> Costmap:
    """The costmap of a map view, for a robot at ``robot_xy`` (2,), metres, inside its grid."""
    grid, size = map_view.grid, map_view.grid.cell_size_m
    trail_xy, obstacles_xy = beside.trail_xy, beside.obstacles_xy
    earlier_xy = trail_xy[:-RECENT_POINTS]
    driven_m = distances_m(_mark(grid, earlier_xy), size, params.radius_m)
    driven = driven_m <= params.radius_m
    covered = driven_m <= params.radius_m - size  # as a whole, wherever in its cell it drove
    seen_free = map_view.occupancy == Occupancy.FREE
    occupied = (map_view.occupancy == Occupancy.OCCUPIED) | _mark(grid, obstacles_xy)
    unseen = ~(covered | occupied | (seen_free & ~map_view.assumed))
    beside_m = distances_m(map_view.drops, size, params.beside_drop_m)
    drops = map_view.drops | (unseen & (beside_m <= params.beside_drop_m))
    occupied |= drops
    unseen &= ~drops
    free = (seen_free | driven) & ~occupied
    start_xy = np.vstack([trail_xy, robot_xy])[0]
    ran_into_m = np.hypot(*(obstacles_xy - start_xy).T).min(initial=np.inf)
    blind = unseen & seen_free & map_view.assumed
    from_start = np.hypot(*(np.argwhere(blind) - grid.cells(start_xy)).T)
    blind[blind] = from_start * size <= params.blind_m
    blind &= ran_into_m > params.blind_m + params.radius_m
    unseen &= ~blind
    clearance_m = _clearance_m(occupied, size, params.clear_m)
    unseen_m = _clearance_m(unseen, size, params.min_clearance_m)

    navigable = free & (clearance_m >= params.min_clearance_m)
    navigable &= ~_near_unknown(free | occupied, size, params)
    cost = np.full(grid.shape, IMPASSABLE)
    cost[navigable] = _effort(clearance_m[navigable], unseen_m[navigable], params)
    wide_enough = clearance_m >= params.radius_m / 2  # for the way that the robot came
    robot = grid.cells(robot_xy)
    drop_m = _clearance_m(drops, size, params.radius_m)
    on_floor = drop_m >= min(params.radius_m, float(drop_m[tuple(robot)]))
    wide_enough &= on_floor
    cost[_beside(grid, trail_xy) & ~navigable & wide_enough] = RETURN_FACTOR * params.dearest
    if _component_m2(navigable, robot, map_view.cell_area_m2) < params.escape_below_m2:
        way_out = _escape_cells(robot, map_view, occupied, free, params) & (cost < 0) & on_floor
        cost[way_out] = _escape_cost(clearance_m[way_out], size, params)

    trail_m = distances_m(_mark(grid, np.vstack([trail_xy, robot_xy])), size, BLIND_RADIUS_M)
    costmap = Costmap(
        grid=grid,
        occupied=occupied,
        drops=drops,
        free=free,
        navigable=navigable,
        cost=cost,
        clearance_m=clearance_m.astype(np.float32),
        near_trail=trail_m <= BLIND_RADIUS_M + ROUNDING_M,
        returning=_beside(grid, earlier_xy) & wide_enough,
        unseen=unseen,
        blind=blind,
        creeping=unseen_m < params.radius_m,
        appeared=occupied & _mark(grid, beside.appeared_xy),
        params=params,
    )
    return _without_zones(costmap, beside.zones, robot)


def _without_zones(costmap: Costmap, zones: Zones, robot_cell: I64) -> Costmap:
    """The costmap without the keep-out zones, and the floor beside them.

    Paths keep ``margin_m`` more from them than from obstacles, since nothing there may be touched.
    A robot in a cell (2,) that is nearer may leave: no path leads farther in.
    """
    params, grid, size = costmap.params, costmap.grid, costmap.grid.cell_size_m
    pad = int(np.ceil((params.min_clearance_m + params.margin_m) / size)) + 1
    (x, y), (nx, ny) = grid.origin_cell, grid.shape
    mask = zones.mask(GridSpec(size, (x - pad, y - pad), (nx + 2 * pad, ny + 2 * pad)))
    if not mask.any():
        return costmap
    cells_xy = grid.centres(np.argwhere(mask) - pad)
    away_m = _clearance_m(mask, size, params.clear_m + params.margin_m)[pad:-pad, pad:-pad]
    away_m = away_m - params.margin_m
    closed = away_m < params.min_clearance_m
    cost = np.where(closed, IMPASSABLE, costmap.cost)
    way_out_m = np.where(closed, np.inf, 0.0)
    robot = (int(robot_cell[0]), int(robot_cell[1]))
    if closed[robot]:
        way_out_m = _ways_out_m(costmap.passable, closed, size)
        parts, _ = ndimage.label(closed, CONNECTIVITY_8)
        out = (parts == parts[robot]) & costmap.passable & np.isfinite(way_out_m)
        out &= way_out_m <= way_out_m[robot]
        out[robot] = True
        cost[out] = LEAVE_FACTOR * params.dearest
    return replace(
        costmap,
        navigable=costmap.navigable & ~closed,
        cost=cost,
        clearance_m=np.minimum(costmap.clearance_m, away_m).astype(np.float32),
        keep_out=KeepOut(grid, cells_xy, closed, way_out_m),
    )


def _ways_out_m(passable: Bool, closed: Bool, cell_size_m: float) -> F64:
    """(nx, ny): metres from each closed cell to one that is not, infinity without a way."""
    ends = np.argwhere(passable & ~closed)
    if len(ends) == 0:
        return np.where(closed, np.inf, 0.0)
    paths = MCP_Geometric(np.where(passable, 1.0, IMPASSABLE), fully_connected=True)
    lengths, _ = paths.find_costs(ends.tolist())
    return np.where(closed, lengths * cell_size_m, 0.0)


def with_gaps(costmap: Costmap, reached: Bool) -> Costmap:
    """The costmap with narrow gaps of unknown floor opened, before parts of N without a way.

    reached (nx, ny): what a path leads to. A gap is at most ``gap_m`` wide between it
    and another part of N, and nothing that was seen stands in it. It is as dear as the own trail.
    """
    params, size = costmap.params, costmap.grid.cell_size_m
    within = params.gap_m / size + 1.0
    across = distances_m(reached, 1.0, within)
    across += distances_m(costmap.navigable & ~reached, 1.0, within)
    gap = ~(costmap.free | costmap.occupied) & (costmap.clearance_m >= params.min_clearance_m)
    gap &= (across - 1.0) * size <= params.gap_m + 1e-6
    cost = np.where(gap & (costmap.cost < 0), RETURN_FACTOR * params.dearest, costmap.cost)
    return replace(costmap, cost=cost)


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
    seen_m = distances_m(map_view.occupancy == Occupancy.FREE, size, params.escape_unknown_m)
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


def _effort(clearance_m: F64, unseen_m: F64, params: CostmapParams) -> F64:
    """Metres of effort per metre (n,), from the distances (n,) to obstacles and unseen cells."""
    needed = params.min_clearance_m
    enough = needed + params.inflation_m
    proximity = np.clip((enough - clearance_m) / (enough - needed), 0.0, 1.0)
    exposed = np.clip(1.0 - unseen_m / needed, 0.0, 1.0)
    effort: F64 = 1.0 + params.inflation_weight * proximity**2 + params.unseen_weight * exposed
    return effort


def _near_unknown(known: Bool, cell_size_m: float, params: CostmapParams) -> Bool:
    """Mask (nx, ny): the footprint there would reach too far over cells that are not known."""
    keep = (params.radius_m - params.unknown_overlap_m) / cell_size_m + 0.5
    if keep <= 1:
        return np.zeros_like(known)
    near: Bool = distances_m(~known, 1.0, keep) < keep
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


def _beside(grid: GridSpec, points_xy: F64) -> Bool:
    """Mask (nx, ny) of the cells that hold a point, and of their eight neighbours."""
    return _mark(grid, points_xy, NEIGHBOURHOOD)


def distances_m(mask: Bool, cell_size_m: float, within_m: float, *, less_m: float = 0.0) -> F64:
    """(nx, ny): metres, less ``less_m``, to the centre of the nearest true cell.

    Infinity where that is more than ``within_m``: a transform of all distances takes several times
    as long, and nobody asks how far away something is that is far.
    """
    reach = int(np.ceil((within_m + less_m) / cell_size_m))
    none = reach * reach + 1  # squares of cells are whole numbers, and there are few
    table_m = np.sqrt(np.arange(none + 1.0)) * cell_size_m - less_m
    table_m[none] = np.inf
    box = _box_around(mask, reach)
    squares = np.where(mask[box], 0, none).astype(np.uint16 if 2 * none < 2**16 else np.int64)
    squares = _least_around(_least_around(squares, reach).T, reach).T
    around_m: F64 = table_m.take(squares, mode="clip")
    if around_m.shape == mask.shape:
        return around_m
    away_m = np.full(mask.shape, np.inf)
    away_m[box] = around_m
    return away_m


def _least_around(squares: NDArray[np.integer], reach: int) -> NDArray[np.integer]:
    """The least of each value and those up to ``reach`` steps away along the first axis, to which
    the squares of the steps are added."""
    least: NDArray[np.integer] = squares.copy(order="K")
    for step in range(1, min(reach + 1, len(squares))):
        farther = squares + squares.dtype.type(step * step)
        np.minimum(least[step:], farther[:-step], out=least[step:])
        np.minimum(least[:-step], farther[step:], out=least[:-step])
    return least


def _box_around(mask: Bool, reach: int) -> tuple[slice, slice]:
    """The smallest part of the grid with all cells within ``reach`` of a true one."""
    x, y = (np.flatnonzero(mask.any(axis=axis)).tolist() for axis in (1, 0))
    if not x:
        return slice(0), slice(0)
    return (
        slice(max(x[0] - reach, 0), x[-1] + reach + 1),
        slice(max(y[0] - reach, 0), y[-1] + reach + 1),
    )


def _clearance_m(mask: Bool, cell_size_m: float, within_m: float) -> F64:
    """(nx, ny): metres to the nearest true cell's edge, infinity if it is beyond ``within_m``."""
    return distances_m(mask, cell_size_m, within_m, less_m=cell_size_m / 2)


def distance_cells(grid: GridSpec, cell: I64) -> F64:
    """(nx, ny): distance in cells from the centre of ``cell`` (2,)."""
    x, y = np.ogrid[: grid.shape[0], : grid.shape[1]]
    distance: F64 = np.hypot(x - cell[0], y - cell[1])
    return distance


def _component_m2(navigable: Bool, robot: I64, cell_area_m2: float) -> float:
    """Area of the component of N around the robot; 0 if the robot is outside N."""
    if not navigable[tuple(robot)]:
        return 0.0
    parts, _ = ndimage.label(navigable, CONNECTIVITY_8)
    return float((parts == parts[tuple(robot)]).sum() * cell_area_m2)


LASTS_S = 1.0  # then it stands: four views at 4 Hz, in each of which a walker is in other cells
AROUND_M = 2.5  # of the robot: a walker's metre and the robot's way to a stop are less

NEVER = float("-inf")


@dataclass(frozen=True, slots=True, eq=False)
class Appeared:
    """What the last view showed around the robot.

    Arrays (nx, ny) on ``grid``. free bool: floor that a camera saw; since_s float64: when a cell
    that was free became occupied, minus infinity elsewhere.
    """

    grid: GridSpec
    free: Bool
    since_s: F64

    @property
    def xy(self) -> F64:
        """Centres (n, 2) in metres of the cells in which something has appeared."""
        return self.grid.centres(np.argwhere(self.since_s > NEVER))

    def after(self, map_view: MapView, robot_xy: F64, seen_s: float) -> Appeared:
        """With another view of the map, and the robot (2,) metres elsewhere.

        seen_s: when the newest frame in the view was taken: what stands there for a while must
        have been seen to stand.
        """
        grid = _around(map_view.grid, robot_xy)
        occupied = onto(grid, map_view.grid, map_view.occupancy == Occupancy.OCCUPIED)
        seen = (map_view.occupancy == Occupancy.FREE) & ~map_view.assumed
        since_s = onto(grid, self.grid, self.since_s, NEVER)
        since_s[onto(grid, self.grid, self.free)] = seen_s
        since_s[~occupied | (np.abs(seen_s - since_s) > LASTS_S)] = NEVER
        return Appeared(grid, onto(grid, map_view.grid, seen), since_s)


NOTHING = Appeared(GridSpec(0.1, (0, 0), (0, 0)), np.zeros((0, 0), bool), np.zeros((0, 0)))


def _around(grid: GridSpec, robot_xy: F64) -> GridSpec:
    """The grid of the cells around the robot, on the same raster."""
    reach = int(np.ceil(AROUND_M / grid.cell_size_m))
    x, y = (int(index) for index in grid.cells(robot_xy) + np.asarray(grid.origin_cell) - reach)
    return GridSpec(grid.cell_size_m, (x, y), (2 * reach + 1, 2 * reach + 1))
