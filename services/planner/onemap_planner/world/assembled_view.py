"""A view of the map put together from the mapper's changes, tile by tile.

A state of it never changes: the next one shares the tiles that did not change with it, so that
taking in a reply costs what changed, whatever the size of the map.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from onemap_shared.geometry import F32, I64, U8, Bool
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
