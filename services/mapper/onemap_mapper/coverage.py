"""How much of the reachable area was looked at, and where the rest begins.

Reachable is the known free floor connected with the robot's place, and what stands within
``SURFACE_M`` of it. Of that, the explored cells were looked at. The rest, and the unknown cells in
sight from the borders of that floor, were not: what lies beyond them nobody knows.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from onemap_mapper.params import VerdictParams
from onemap_shared.geometry import F64, I64, U8, Bool
from onemap_shared.grid import GridSpec
from onemap_shared.messages import Layer, Occupancy

SURFACE_M = 0.3  # from the floor in front of it: the depth of a shelf's front
MIN_BORDER_M = 0.4  # shorter borders are gaps that the robot cannot pass
RAYS = 72  # 5 degrees: 0.26 m apart at 3 m, so that a door is three rays wide
EIGHT_NEIGHBOURS = np.ones((3, 3), bool)


@dataclass(frozen=True, slots=True)
class FloorCoverage:
    """What was looked at of the reachable area, square metres.

    frontiers_m (n, 2) x, y in metres of the middles of the borders behind which nobody looked, and
    unseen_m2 (n,) the unknown area in sight from each. reachable (nx, ny): the reachable floor.
    """

    looked_m2: float
    not_looked_m2: float
    frontiers_m: F64
    unseen_m2: F64
    reachable: Bool

    @property
    def share(self) -> float:
        """Share of the area that was looked at, 0 to 1; 0 if there is none."""
        total_m2 = self.looked_m2 + self.not_looked_m2
        return self.looked_m2 / total_m2 if total_m2 > 0 else 0.0


def floor_coverage(
    occupancy: U8,
    layers: U8,
    grid: GridSpec,
    *,
    robot_xy_m: tuple[float, ...],
    area: Bool | None,
    params: VerdictParams,
) -> FloorCoverage:
    """The coverage of a map, occupancy and layers (nx, ny), of which only ``area`` (nx, ny) counts.

    robot_xy_m: x, y in metres, empty: unknown; then the largest floor counts as reachable.
    """
    cell_m = grid.cell_size_m
    floor = reachable_floor(occupancy, grid, robot_xy_m)
    near = ndimage.binary_dilation(floor, EIGHT_NEIGHBOURS, round(SURFACE_M / cell_m))
    seen = (layers & Layer.OBSERVED > 0) | (occupancy == Occupancy.OCCUPIED)
    counted = floor | (near & seen & (occupancy != Occupancy.FREE))
    looked = counted & (layers & Layer.EXPLORED > 0)
    reach = round(params.frontier_view_m / cell_m)
    padded = np.pad(occupancy, reach, constant_values=Occupancy.UNKNOWN)
    frontiers, unseen_m2, beyond = _frontiers(padded, np.pad(floor, reach), cell_m, params)
    inside = np.ones(grid.shape, bool) if area is None else area
    padded_area = np.pad(inside, reach, constant_values=area is None)
    chosen = padded_area[tuple(frontiers.T)]
    not_looked = (counted & ~looked & inside).sum() + (beyond & padded_area).sum()
    return FloorCoverage(
        looked_m2=float((looked & inside).sum()) * cell_m**2,
        not_looked_m2=float(not_looked) * cell_m**2,
        frontiers_m=grid.centres(frontiers[chosen] - reach),
        unseen_m2=unseen_m2[chosen],
        reachable=floor,
    )


def reachable_floor(occupancy: U8, grid: GridSpec, robot_xy_m: tuple[float, ...]) -> Bool:
    """Free cells (nx, ny) connected with the one nearest to the robot, or the largest part."""
    free: Bool = occupancy == Occupancy.FREE
    if not free.any():
        return free
    parts, _ = ndimage.label(free, EIGHT_NEIGHBOURS)
    if robot_xy_m:
        chosen = parts[_nearest(free, grid, robot_xy_m)]
    else:
        chosen = np.bincount(parts[free]).argmax()
    floor: Bool = parts == chosen
    return floor


def _nearest(free: Bool, grid: GridSpec, xy_m: tuple[float, ...]) -> tuple[int, int]:
    """The free cell nearest to a place; there must be one."""
    place = grid.cells(np.asarray(xy_m))
    if grid.contains(place) and free[tuple(place)]:
        return int(place[0]), int(place[1])
    cells = np.argwhere(free)
    x, y = cells[((cells - place) ** 2).sum(axis=1).argmin()]
    return int(x), int(y)


def _frontiers(
    occupancy: U8, floor: Bool, cell_m: float, params: VerdictParams
) -> tuple[I64, F64, Bool]:
    """Middles (n, 2) of the borders to the unknown, the area in sight of each, and these cells.

    The grid (nx, ny) is padded by the distance that counts as in sight.

    Borders from which less than ``frontier_min_m2`` of it is in sight are left out: pockets behind
    furniture and the camera's blind spots.
    """
    unknown = occupancy == Occupancy.UNKNOWN
    border = floor & ndimage.binary_dilation(unknown)
    parts, _ = ndimage.label(border, EIGHT_NEIGHBOURS)
    reach = round(params.frontier_view_m / cell_m)
    middles, areas_m2, beyond = [], [], np.zeros_like(floor)
    for number, box in enumerate(ndimage.find_objects(parts), 1):
        cells = np.argwhere(parts[box] == number) + [side.start for side in box]
        for middle in _middles(cells, cell_m):
            around = tuple(slice(int(i) - reach, int(i) + reach + 1) for i in middle)
            hidden = in_sight(occupancy[around]) & unknown[around]
            area_m2 = float(hidden.sum()) * cell_m**2
            if area_m2 >= params.frontier_min_m2:
                middles.append(middle)
                areas_m2.append(area_m2)
                beyond[around] |= hidden
    return np.array(middles, np.int64).reshape(-1, 2), np.array(areas_m2), beyond


def _middles(cells: I64, cell_m: float) -> list[I64]:
    """Cells in the middle of pieces of a border (K, 2) of at most 2 m; none of a short one."""
    extent = np.ptp(cells, axis=0) + 1
    if extent.max() * cell_m < MIN_BORDER_M:
        return []
    along = cells[np.argsort(cells[:, int(extent.argmax())], kind="stable")]
    pieces = np.array_split(along, int(np.ceil(len(cells) * cell_m / 2.0)))
    return [p[np.linalg.norm(p - p.mean(axis=0), axis=1).argmin()] for p in pieces]


def in_sight(occupancy: U8) -> Bool:
    """Cells (2 r + 1, 2 r + 1) within r of the middle one that no occupied cell hides from it."""
    reach = len(occupancy) // 2
    angles = 2 * np.pi * np.arange(RAYS) / RAYS
    directions = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    steps = np.arange(1, reach + 1)
    x, y = np.moveaxis(reach + np.rint(directions[:, None] * steps[:, None]).astype(int), -1, 0)
    clear = ~np.maximum.accumulate(occupancy[x, y] == Occupancy.OCCUPIED, axis=1)
    seen = np.zeros(occupancy.shape, bool)
    seen[x[clear], y[clear]] = True
    closed: Bool = ndimage.binary_closing(seen, EIGHT_NEIGHBOURS)  # gaps between rays
    return closed
