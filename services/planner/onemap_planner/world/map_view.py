"""The view of the map for one object: kept up to date tile by tile, and as layers in a window.

A state of the view never changes: the next one shares the tiles that did not change with it, so
that taking in a reply costs what changed, whatever the size of the map.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from onemap_shared.geometry import F32, F64, I64, U8, Bool
from onemap_shared.grid import GridSpec
from onemap_shared.messages import (
    NO_VIEW,
    TILE_CELLS,
    Layer,
    Occupancy,
    SearchView,
    ViewChanges,
    ViewKey,
    ranked,
)

CONNECTIVITY_8 = np.ones((3, 3), bool)  # diagonal neighbours are neighbours


def components(mask: Bool) -> list[I64]:
    """Cells (K, 2) of each 8-connected component of the mask (nx, ny), row by row."""
    labels, count = ndimage.label(mask, CONNECTIVITY_8)
    cells = np.argwhere(mask)
    label = labels[mask]
    sizes = np.bincount(label, minlength=count + 1)[1:]
    return np.split(cells[np.argsort(label, kind="stable")], np.cumsum(sizes))[:count]


SHAPE = (TILE_CELLS, TILE_CELLS)
SIMILARITY, COSINE, RIVAL = range(3)  # rows of the values of a message and of a tile
NO_LIMITS: F32 = np.zeros(0, np.float32)

Tile = tuple[int, int]  # world cell // 64 along x and y


class ChangesDoNotFit(ValueError):
    """Changes that lead on from another state than the one at hand: ask for everything."""


@dataclass(frozen=True, slots=True)
class ViewTile:
    """One tile (64, 64): occupancy and layers uint8, values (p, 64, 64), NaN where not observed.

    known_cells: free or occupied; known_box: lowest and one past the highest world cell, x0, y0,
    x1, y1, of those that anything is known of, empty without any.
    """

    occupancy: U8
    layers: U8
    values: F32
    known_cells: int
    known_box: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class AssembledView:
    """One state of a view, with the meaning of ``SearchView``; ``cropped`` makes parts of it."""

    text: str
    key: ViewKey
    revision: int
    sequence: int
    stamp_ns: int
    grid: GridSpec
    tiles: Mapping[Tile, ViewTile] = field(default_factory=dict)
    planes: int = 0  # of the values of its tiles
    rank_limits: F32 = field(default_factory=lambda: NO_LIMITS)
    calibrated: bool = True

    @property
    def known_occupancy_cells(self) -> int:
        """Cells that are free or occupied."""
        return sum(tile.known_cells for tile in self.tiles.values())

    def known_box(self) -> I64 | None:
        """First and one past the last index (2, 2) of the cells that anything is known of."""
        boxes = [tile.known_box for tile in self.tiles.values() if tile.known_box]
        if not boxes:
            return None
        x0, y0, x1, y1 = zip(*boxes, strict=True)  # lists: quicker than arrays of a few hundred
        box = np.array([[min(x0), min(y0)], [max(x1), max(y1)]])
        indices: I64 = box - np.asarray(self.grid.origin_cell)
        return indices

    def whole(self) -> SearchView:
        """The whole view, as the mapper replies to ``SearchViewRequest``."""
        return self.cropped(np.zeros(2, np.int64), np.array(self.grid.shape))

    def cropped(self, low: I64, high: I64) -> SearchView:
        """The part of the view from index ``low`` (2,) up to, without, ``high`` (2,)."""
        origin = np.asarray(low) + np.asarray(self.grid.origin_cell)
        nx, ny = (int(n) for n in np.maximum(np.asarray(high) - low, 0))
        grid = GridSpec(self.grid.cell_size_m, (int(origin[0]), int(origin[1])), (nx, ny))
        occupancy = np.full(grid.shape, Occupancy.UNKNOWN, np.uint8)
        layers = np.zeros(grid.shape, np.uint8)
        values = np.full((self.planes, nx, ny), np.nan, np.float32)
        for tile, into, out_of in _overlaps(grid):
            content = self.tiles.get(tile)
            if content is not None:
                occupancy[into] = content.occupancy[out_of]
                layers[into] = content.layers[out_of]
                values[:, into[0], into[1]] = content.values[:, out_of[0], out_of[1]]
        nothing = np.zeros((0, 0), np.float32)
        none = np.full(grid.shape if self.text else (0, 0), np.nan, np.float32)
        return SearchView(
            text=self.text,
            revision=self.revision,
            sequence=self.sequence,
            stamp_ns=self.stamp_ns,
            grid=grid,
            occupancy=occupancy,
            layers=layers,
            similarity=values[SIMILARITY] if self.planes else none,
            rival=values[RIVAL] if self.planes > RIVAL else nothing,
            guidance=self._guidance(values[COSINE]) if self.planes else nothing.astype(np.uint8),
            calibrated=self.calibrated,
        )

    def _guidance(self, cosines: F32) -> U8:
        """Rank of each cosine, 0 where it is NaN."""
        guidance: U8 = np.where(np.isnan(cosines), 0, ranked(cosines, self.rank_limits))
        return guidance.astype(np.uint8, copy=False)


def after(view: AssembledView | None, changes: ViewChanges) -> AssembledView:
    """The view with these changes. Raises ``ChangesDoNotFit`` if they lead on from another one."""
    tiles: dict[Tile, ViewTile] = {}
    if changes.base != NO_VIEW:
        if view is None or (view.key, view.text) != (changes.base, changes.text):
            raise ChangesDoNotFit("the changes of the map's view lead on from another view")
        if view.planes != len(changes.values) or not _holds(changes.grid, view.grid):
            raise ChangesDoNotFit("the changes of the map's view do not fit the view")
        tiles.update(view.tiles)
    for tile, changed, part in _parts(changes):
        tiles[tile] = _with_changes(tiles.get(tile), changed, part, tile)
    return AssembledView(
        changes.text,
        changes.key,
        changes.revision,
        changes.sequence,
        changes.stamp_ns,
        changes.grid,
        tiles,
        len(changes.values),
        changes.rank_limits,
        changes.calibrated,
    )


@dataclass(frozen=True, slots=True)
class _Part:
    """The changed cells (n,) of one tile, with values (p, m) of the observed ones."""

    occupancy: U8
    layers: U8
    values: F32


def _parts(changes: ViewChanges) -> Iterator[tuple[Tile, Bool, _Part]]:
    """Each tile with changes: where it is, which cells (64, 64) changed, and what they are."""
    bits = np.unpackbits(changes.cells, axis=1).astype(bool)
    ends = np.cumsum(bits.sum(axis=1))
    observed = np.append(0, np.cumsum((changes.layers & Layer.OBSERVED) > 0))
    first = 0
    for (x, y), mask, end in zip(changes.tiles.tolist(), bits, ends.tolist(), strict=True):
        values = changes.values[:, observed[first] : observed[end]]
        part = _Part(changes.occupancy[first:end], changes.layers[first:end], values)
        yield (x, y), mask.reshape(SHAPE), part
        first = end


def _with_changes(tile: ViewTile | None, changed: Bool, part: _Part, at: Tile) -> ViewTile:
    """A new tile with the changed cells (64, 64)."""
    if tile is None:
        occupancy = np.full(SHAPE, Occupancy.UNKNOWN, np.uint8)
        layers = np.zeros(SHAPE, np.uint8)
        values = np.full((len(part.values), *SHAPE), np.nan, np.float32)
    else:
        occupancy, layers, values = tile.occupancy.copy(), tile.layers.copy(), tile.values.copy()
    occupancy[changed] = part.occupancy
    layers[changed] = part.layers
    if len(values):
        values[:, changed] = np.nan
        values[:, changed & ((layers & Layer.OBSERVED) > 0)] = part.values
    known = (occupancy != Occupancy.UNKNOWN) | (layers > 0)
    return ViewTile(occupancy, layers, values, int(np.count_nonzero(occupancy)), _box(known, at))


def _box(known: Bool, at: Tile) -> tuple[int, ...]:
    """The box of the known cells (64, 64) of a tile, as in ``ViewTile``."""
    x, y = np.flatnonzero(known.any(axis=1)), np.flatnonzero(known.any(axis=0))
    if len(x) == 0:
        return ()
    first_x, first_y = at[0] * TILE_CELLS, at[1] * TILE_CELLS
    box = (first_x + x[0], first_y + y[0], first_x + x[-1] + 1, first_y + y[-1] + 1)
    return tuple(map(int, box))


def _holds(grid: GridSpec, smaller: GridSpec) -> bool:
    """Whether a grid holds all cells of another one of its cell size."""
    low, high = np.array(grid.origin_cell), np.add(grid.origin_cell, grid.shape)
    first, last = np.array(smaller.origin_cell), np.add(smaller.origin_cell, smaller.shape)
    inside = bool((low <= first).all() and (last <= high).all()) or 0 in smaller.shape
    return inside and grid.cell_size_m == smaller.cell_size_m


def _overlaps(grid: GridSpec) -> Iterator[tuple[Tile, tuple[slice, slice], tuple[slice, slice]]]:
    """Each tile that a grid touches: where it lies in the grid, and which part of it does."""
    ranges = [
        range(origin // TILE_CELLS, -(-(origin + n) // TILE_CELLS)) if n else range(0)
        for origin, n in zip(grid.origin_cell, grid.shape, strict=True)
    ]
    for x in ranges[0]:
        for y in ranges[1]:
            into, out_of = [], []
            for tile, origin, n in zip((x, y), grid.origin_cell, grid.shape, strict=True):
                first = tile * TILE_CELLS
                start, end = max(first, origin), min(first + TILE_CELLS, origin + n)
                into.append(slice(start - origin, end - origin))
                out_of.append(slice(start - first, end - first))
            yield (x, y), (into[0], into[1]), (out_of[0], out_of[1])


# Cells counted from the origin of the map frame: they mean the same place in every window.
WorldCells: TypeAlias = frozenset[tuple[int, int]]

BORDER_CELLS = 2  # unknown cells kept around the window, so that its rim can be a frontier

# The robot sees 10 m far, so it is in the map or near it. Further out its pose is wrong, and the
# window around both would fill the memory.
MAX_OUTSIDE_M = 50.0


PlanningView: TypeAlias = SearchView | AssembledView


@dataclass(frozen=True, slots=True)
class MapView:
    """The layers of a ``SearchView`` as masks, all (nx, ny) on ``grid``.

    occupancy uint8, values of ``Occupancy``; observed O, explored E, searched C bool; assumed
    bool: counts as free, but no camera saw it; floor_seen bool: the camera saw the floor there
    once, whatever stands there now;
    similarity float32 in [0, 1], NaN where not observed: the score, or for an encoder without
    calibration the place among the map's top tenth; margin float32: the score less that of the
    best name that competes with the object, infinity where none does, NaN where not observed;
    guidance float32 in [0, 1]: rank of the cell's cosine, NaN where not observed; calibrated:
    whether the score is a probability.
    """

    grid: GridSpec
    occupancy: U8
    observed: Bool
    explored: Bool
    searched: Bool
    assumed: Bool
    floor_seen: Bool
    similarity: F32
    margin: F32
    guidance: F32
    calibrated: bool = True

    @property
    def cell_area_m2(self) -> float:
        """Area of one cell in square metres."""
        return self.grid.cell_size_m**2

    def world_cells(self, cells: I64) -> WorldCells:
        """World cells of grid indices (K, 2)."""
        world = np.asarray(cells) + np.asarray(self.grid.origin_cell)
        return frozenset((int(ix), int(iy)) for ix, iy in world)

    def indices_of(self, world_cells: WorldCells) -> I64:
        """Grid indices (K, 2) of world cells, without those outside the grid."""
        cells = np.array(sorted(world_cells), np.int64).reshape(-1, 2)
        cells = cells - np.asarray(self.grid.origin_cell)
        inside: I64 = cells[self.grid.contains(cells)]
        return inside


def known_area_m2(view: PlanningView) -> float:
    """Known area in square metres."""
    if not isinstance(view, SearchView):
        return view.known_occupancy_cells * view.grid.cell_size_m**2
    known = int(np.count_nonzero(view.occupancy != Occupancy.UNKNOWN))
    return known * view.grid.cell_size_m**2


def outside_reason(view: PlanningView, robot_xy: tuple[float, float]) -> str:
    """Why a view cannot be used with a robot at this place, metres; empty if it can."""
    if view.grid.shape == (0, 0):
        return ""
    x_min, y_min, x_max, y_max = view.grid.bounds_m
    x, y = robot_xy
    outside_m = max(x_min - x, x - x_max, y_min - y, y - y_max)
    if outside_m <= MAX_OUTSIDE_M:
        return ""
    return (
        f"the robot's pose is {outside_m:.0f} m outside the map; the limit is "
        f"{MAX_OUTSIDE_M:g} m: correct the localisation or clear the map"
    )


def map_view_around(view: PlanningView, robot_xy: F64, window_xy: F64 | None = None) -> MapView:
    """The known part of the view, cropped or grown so that the robot (2,) metres is inside.

    window_xy (2, 2): lowest and highest x and y, metres, outside of which nothing is needed.
    Maps come in tiles with many unknown cells; planning time depends on the known area only.
    """
    robot = view.grid.cells(robot_xy)
    source = _needed_box(view, robot, window_xy)
    lower = np.minimum(source[0], robot) - BORDER_CELLS
    upper = np.maximum(source[1], robot + 1) + BORDER_CELLS
    grid = _grid_of(view.grid, lower, upper - lower)
    inside = _slices(source - lower)
    part = _cropped(view, source)

    occupancy = np.full(grid.shape, Occupancy.UNKNOWN, np.uint8)
    occupancy[inside] = part.occupancy
    layers = np.zeros(grid.shape, np.uint8)
    layers[inside] = part.layers
    similarity = np.full(grid.shape, np.nan, np.float32)
    if part.similarity.shape == part.grid.shape:
        similarity[inside] = part.similarity
    margin = np.full(grid.shape, np.inf, np.float32)
    if part.rival.shape == part.grid.shape:
        margin[inside] = similarity[inside] - np.nan_to_num(part.rival, nan=-np.inf)
    guidance = np.full(grid.shape, np.nan, np.float32)
    if part.guidance.shape == part.grid.shape:
        guidance[inside] = _ranks(part.guidance)
    return MapView(
        grid=grid,
        occupancy=occupancy,
        observed=(layers & Layer.OBSERVED) > 0,
        explored=(layers & Layer.EXPLORED) > 0,
        searched=(layers & Layer.SEARCHED) > 0,
        assumed=(layers & Layer.ASSUMED) > 0,
        floor_seen=(layers & Layer.FLOOR_SEEN) > 0,
        similarity=similarity if part.calibrated else _top_tenth(guidance),
        margin=margin,
        guidance=guidance,
        calibrated=part.calibrated,
    )


def _needed_box(view: PlanningView, robot: I64, window_xy: F64 | None) -> I64:
    """(2, 2): first and one-past-last index of what is known, and inside of the window if any."""
    box = _known_box(view, robot)
    if window_xy is None:
        return box
    low, high = view.grid.cells(window_xy)
    first = np.maximum(box[0], low)
    needed: I64 = np.stack([first, np.maximum(first, np.minimum(box[1], high + 1))])
    return needed


def _grid_of(grid: GridSpec, first: I64, shape: I64) -> GridSpec:
    """The grid of ``shape`` (2,) cells whose first one has the index ``first`` (2,) in ``grid``."""
    ix, iy = (int(index) for index in first + np.asarray(grid.origin_cell))
    nx, ny = (int(length) for length in shape)
    return GridSpec(grid.cell_size_m, (ix, iy), (nx, ny))


def _slices(box: I64) -> tuple[slice, ...]:
    """The index expression of a box (2, 2): first and one-past-last index."""
    return tuple(slice(int(first), int(end)) for first, end in zip(*box, strict=True))


def _ranks(guidance: U8) -> F32:
    """Ranks in [0, 1] from those of a message, 1 to 255; 0, not observed, becomes NaN."""
    ranks: F32 = np.where(guidance > 0, (guidance - np.float32(1.0)) / 254, np.nan)
    return ranks


def _top_tenth(guidance: F32) -> F32:
    """Similarity (nx, ny) by rank: 0 up to the 90th percentile of the map, 1 for its best cell.

    The cosines of an encoder without calibration lie close together, each encoder's elsewhere:
    no threshold on them holds for two encoders, but a rank does.
    """
    similarity: F32 = np.clip((guidance - np.float32(0.9)) / np.float32(0.1), 0.0, 1.0)
    return similarity


def _cropped(view: PlanningView, box: I64) -> SearchView:
    """The part of a view in a box (2, 2) of indices inside of it: first and one past the last."""
    if not isinstance(view, SearchView):
        return view.cropped(*box)
    out_of = _slices(box)
    grid = _grid_of(view.grid, box[0], box[1] - box[0])

    def part(layer: NDArray) -> NDArray:
        return layer[out_of] if layer.shape == view.grid.shape else layer

    return replace(
        view,
        grid=grid,
        occupancy=part(view.occupancy),
        layers=part(view.layers),
        similarity=part(view.similarity),
        rival=part(view.rival),
        guidance=part(view.guidance),
    )


def _known_box(view: PlanningView, robot: I64) -> I64:
    """(2, 2): first and one-past-last known index on both axes; empty at the robot if none is."""
    if not isinstance(view, SearchView):
        box = view.known_box()
        return np.stack([robot, robot]) if box is None else box
    known = (view.occupancy != Occupancy.UNKNOWN) | (view.layers > 0)
    if not known.any():
        return np.stack([robot, robot])
    box = np.zeros((2, 2), np.int64)
    for axis in (0, 1):
        filled = np.flatnonzero(known.any(axis=1 - axis))
        box[:, axis] = filled[0], filled[-1] + 1
    return box
