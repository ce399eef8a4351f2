"""Whether a thing is found, not here, or was not looked for everywhere yet.

Reachable is the known free floor connected with the robot's place, and what stands within
``SURFACE_M`` of it. Of that, the explored cells were looked at. The rest, and the unknown cells in
sight from the borders of that floor, were not: what lies beyond them nobody knows.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from cachetools import LRUCache
from scipy import ndimage

from onemap_mapper.belief.version import MapVersion
from onemap_shared.geometry import F32, F64, I64, U8, Bool
from onemap_shared.grid import GridSpec, area_mask
from onemap_shared.messages import Layer, MapVerdict, Occupancy, Verdict
from onemap_shared.sight import EIGHT_NEIGHBOURS, in_sight

# Share of the reachable area that was looked at from which what was not found is not here: a camera
# that has seen all floor of an apartment reaches 0.89 to 0.95, the rest is behind furniture.
LOOKED_SHARE = 0.85
FRONTIER_VIEW_M = 3.0  # unknown area in sight from a border up to here counts as not looked at
FRONTIER_MIN_M2 = 1.0  # of it make a frontier: a door shows 5 and more, a pocket by a chair 0.3
SURFACE_M = 0.3  # from the floor in front of it: the depth of a shelf's front
MIN_BORDER_M = 0.4  # shorter borders are gaps that the robot cannot pass


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
    reach = round(FRONTIER_VIEW_M / cell_m)
    padded = np.pad(occupancy, reach, constant_values=Occupancy.UNKNOWN)
    frontiers, unseen_m2, beyond = _frontiers(padded, np.pad(floor, reach), cell_m)
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


def _frontiers(occupancy: U8, floor: Bool, cell_m: float) -> tuple[I64, F64, Bool]:
    """Middles (n, 2) of the borders to the unknown, the area in sight of each, and these cells.

    The grid (nx, ny) is padded by the distance that counts as in sight.

    Borders from which less than ``FRONTIER_MIN_M2`` of it is in sight are left out: pockets behind
    furniture and the camera's blind spots.
    """
    unknown = occupancy == Occupancy.UNKNOWN
    border = floor & ndimage.binary_dilation(unknown)
    parts, _ = ndimage.label(border, EIGHT_NEIGHBOURS)
    reach = round(FRONTIER_VIEW_M / cell_m)
    middles, areas_m2, beyond = [], [], np.zeros_like(floor)
    for number, box in enumerate(ndimage.find_objects(parts), 1):
        cells = np.argwhere(parts[box] == number) + [side.start for side in box]
        for middle in _middles(cells, cell_m):
            around = tuple(slice(int(i) - reach, int(i) + reach + 1) for i in middle)
            hidden = in_sight(occupancy[around]) & unknown[around]
            area_m2 = float(hidden.sum()) * cell_m**2
            if area_m2 >= FRONTIER_MIN_M2:
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


HINT_M = 1.5  # around a frontier, whose likeness to the object says what may be beyond
VIEW_SCALE_M2 = 5.0  # of unknown area in sight for 63 percent of its worth: a door shows 5 and more
WORTH_PER_M = 0.04  # that a frontier loses per metre to it, as in a search


def judge(
    best_score: float,
    coverage: FloorCoverage,
    *,
    worths: F64,
    found_score: float,
    may_be: bool = False,
) -> MapVerdict:
    """The verdict about an object of which the best region that is as described has this score.

    worths (n,): of looking behind each frontier of the coverage; may_be: of another region not all
    that is said of it was checked.
    """
    if best_score >= found_score:
        verdict = Verdict.FOUND
    elif coverage.share >= LOOKED_SHARE and not may_be:
        verdict = Verdict.NOT_HERE
    else:
        verdict = Verdict.NOT_LOOKED_YET
    frontier_m: tuple[float, ...] = ()
    if len(worths):
        x_m, y_m = coverage.frontiers_m[int(worths.argmax())]
        frontier_m = (float(x_m), float(y_m))
    return MapVerdict(
        verdict,
        looked_m2=coverage.looked_m2,
        not_looked_m2=coverage.not_looked_m2,
        frontiers=len(worths),
        frontier_m=frontier_m,
    )


def frontier_worths(
    coverage: FloorCoverage, cosines: F32, grid: GridSpec, *, robot_xy_m: tuple[float, ...]
) -> F64:
    """What looking behind each frontier (n,) is worth.

    More unknown area in sight, surroundings more like the object and a shorter way, as the crow
    flies, make it worth more. cosines (nx, ny): of the object, NaN where nothing was observed.
    """
    observed = np.sort(cosines[np.isfinite(cosines)])
    worths = 1.0 - np.exp(-coverage.unseen_m2 / VIEW_SCALE_M2)
    reach = round(HINT_M / grid.cell_size_m)
    for index, place in enumerate(coverage.frontiers_m):
        x, y = grid.cells(place)
        around = cosines[max(x - reach, 0) : x + reach + 1, max(y - reach, 0) : y + reach + 1]
        if np.isfinite(around).any():
            rank = np.searchsorted(observed, np.nanmean(around)) / len(observed)
            worths[index] *= 0.5 + rank
        if robot_xy_m:
            worths[index] -= WORTH_PER_M * np.linalg.norm(place - np.asarray(robot_xy_m))
    return worths


KEPT_S = 1.0  # in which a robot drives half a metre
MAX_AREAS = 32

Clock = Callable[[], float]


class CoverageCache:
    """The coverage of one map by area. Not thread-safe; ``clock_s``: seconds, monotonic."""

    def __init__(self, clock_s: Clock) -> None:
        self._clock_s = clock_s
        self._kept: LRUCache[tuple[float, ...], tuple[float, FloorCoverage]] = LRUCache(MAX_AREAS)

    def coverage(
        self, version: MapVersion, area_m: tuple[float, ...], robot_xy_m: tuple[float, ...]
    ) -> FloorCoverage:
        """The coverage of an area, of this version or of one of the last second."""
        made_s, kept = self._kept.get(area_m, (0.0, None))
        if kept is not None and self._clock_s() - made_s < KEPT_S:
            return kept
        grid = version.grid
        found = floor_coverage(
            version.occupancy_grid(),
            version.layers(),
            grid,
            robot_xy_m=robot_xy_m,
            area=area_mask(grid, area_m),
        )
        self._kept[area_m] = (self._clock_s(), found)
        return found
