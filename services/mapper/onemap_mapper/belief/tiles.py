"""Tiles: where in memory a cell of an unbounded map lies.

The map is cut into tiles of 64 x 64 cells, allocated when a cell in them is first observed. A
tile has a number, and its cells are consecutive in every per-cell array ("rows"):
row = number * 4096 + (ix mod 64) * 64 + (iy mod 64). A directory over the bounding box of all
tiles maps tile coordinates to numbers.
"""

from __future__ import annotations

from copy import copy

import numpy as np
from numpy.typing import DTypeLike, NDArray

from onemap_mapper.params import MapParams
from onemap_shared.geometry import I64
from onemap_shared.grid import GridSpec, GridTooLarge
from onemap_shared.jit import compiled
from onemap_shared.messages import TILE_CELLS


@compiled
def tile_rows(cells: I64, directory: I64, origin: I64, side: int) -> I64:
    """Rows (n,) of world cells (n, 2), -1: no tile.

    directory (nx, ny): the number of each tile, -1 = none; origin (2,): tile of its [0, 0]; side:
    cells along the edge of a tile.
    """
    rows = np.empty(len(cells), np.int64)
    for k in range(len(cells)):
        x, y = cells[k, 0] // side, cells[k, 1] // side
        i, j = x - origin[0], y - origin[1]
        number = np.int64(-1)
        if i >= 0 and j >= 0 and i < directory.shape[0] and j < directory.shape[1]:
            number = directory[i, j]
        within = (cells[k, 0] - x * side) * side + cells[k, 1] - y * side
        rows[k] = number * side * side + within if number >= 0 else -1
    return rows


SIDE = TILE_CELLS  # 6.4 m at 0.1 m, so a room has a few tiles and a flat a few dozen
AREA = SIDE * SIDE
NO_ROW = -1


class MapTooLarge(GridTooLarge):
    """The cells exceed the configured extent: most likely a jump of the pose."""


class TileIndex:
    """The tiles of one map, numbered in order of allocation."""

    def __init__(self, params: MapParams) -> None:
        self.cell_size_m = params.cell_size_m
        self.count = 0
        self._max_tiles = max(1, int(params.max_extent_m / (params.cell_size_m * SIDE)))
        self._origin = np.zeros(2, np.int64)  # tile coordinates of the directory's [0, 0]
        self._directory = np.full((0, 0), NO_ROW, np.int64)

    def copy(self) -> TileIndex:
        """An index that does not grow with this one."""
        made = copy(self)
        made._directory = self._directory.copy()
        return made

    @property
    def grid(self) -> GridSpec:
        """The bounding box of all tiles."""
        shape = np.array(self._directory.shape) * SIDE
        origin = self._origin * SIDE
        return GridSpec(
            self.cell_size_m, (int(origin[0]), int(origin[1])), (int(shape[0]), int(shape[1]))
        )

    @property
    def nbytes(self) -> int:
        return self._directory.nbytes

    def rows(self, cells: I64) -> I64:
        """Rows (n,) of world cells (n, 2), ``NO_ROW`` where there is no tile."""
        return tile_rows(np.ascontiguousarray(cells), self._directory, self._origin, SIDE)

    def check(self, cells: I64) -> None:
        """Raise ``MapTooLarge`` if world cells (n, 2) do not fit; allocates nothing."""
        self._extended(cells // SIDE)

    def allocate(self, cells: I64) -> I64:
        """Rows (n,) of world cells (n, 2), in tiles that are added where missing.

        Raises ``MapTooLarge`` before any change.
        """
        rows = self.rows(cells)
        if (missing := cells[rows == NO_ROW]).size:
            tiles = np.unique(missing // SIDE, axis=0)
            self._grow_directory(tiles)
            self._directory[tuple((tiles - self._origin).T)] = self.count + np.arange(len(tiles))
            self.count += len(tiles)
            rows = self.rows(cells)
        return rows

    def cells(self, rows: I64) -> I64:
        """World cells (n, 2) of rows (n,), the inverse of ``rows``."""
        within = np.stack([rows % AREA // SIDE, rows % SIDE], axis=1)
        cells: I64 = self.places()[rows // AREA] * SIDE + within
        return cells

    def places(self) -> I64:
        """Where each tile lies: world cell // 64 (count, 2), by its number."""
        found = np.argwhere(self._directory != NO_ROW)
        tiles = np.empty((self.count, 2), np.int64)
        tiles[self._directory[tuple(found.T)]] = found + self._origin
        return tiles

    def to_dense(self, values: NDArray, fill: float) -> NDArray:
        """The per-row array (count * 4096,) as a dense one over ``grid``; ``fill`` elsewhere."""
        tiles = np.full((self.count + 1, SIDE, SIDE), fill, values.dtype)
        tiles[: self.count] = values.reshape(self.count, SIDE, SIDE)
        dense = tiles[self._directory]  # NO_ROW, -1, selects the last, empty tile
        nx, ny = self.grid.shape
        joined: NDArray = dense.transpose(0, 2, 1, 3).reshape(nx, ny)
        return joined

    def _extended(self, tiles: I64) -> tuple[I64, I64]:
        """Origin (2,) and shape (2,) of the directory with these tiles (n, 2), n > 0."""
        low, high = tiles.min(axis=0), tiles.max(axis=0) + 1
        if self.count:
            low = np.minimum(low, self._origin)
            high = np.maximum(high, self._origin + self._directory.shape)
        shape = high - low
        if shape.max() > self._max_tiles:
            size_m = self._max_tiles * SIDE * self.cell_size_m
            raise MapTooLarge(
                f"the frame would stretch the map beyond {size_m:.0f} m: did the pose jump?"
            )
        return low, shape

    def _grow_directory(self, tiles: I64) -> None:
        low, shape = self._extended(tiles)
        if self.count and tuple(shape) == self._directory.shape:
            return
        wider = np.full(tuple(shape), NO_ROW, np.int64)
        if self.count:
            shift = self._origin - low
            nx, ny = self._directory.shape
            wider[shift[0] : shift[0] + nx, shift[1] : shift[1] + ny] = self._directory
        self._origin, self._directory = low, wider


class TileLayer:
    """One per-cell array (rows, ...) that grows with the tiles."""

    def __init__(self, dtype: DTypeLike, fill: int, depth: tuple[int, ...] = ()) -> None:
        self._fill = fill
        self._values: NDArray = np.full((0, *depth), fill, dtype)
        self._rows = 0

    def copy(self) -> TileLayer:
        """A layer that does not change with this one, without what is reserved for growth."""
        made = copy(self)
        made._values = self.values.copy()
        return made

    @property
    def values(self) -> NDArray:
        """The array of all allocated rows; writing to it changes the layer."""
        return self._values[: self._rows]

    @property
    def nbytes(self) -> int:
        return self._values.nbytes

    def grow(self, tiles: int) -> None:
        """Make room for this many tiles."""
        rows, (reserved, *depth) = tiles * AREA, self._values.shape
        if rows > reserved:
            reserved = max(rows, reserved * 3 // 2)
            larger = np.full((reserved, *depth), self._fill, self._values.dtype)
            larger[: self._rows] = self.values
            self._values = larger
        self._rows = max(self._rows, rows)


@compiled
def mark_rows(changed_at: I64, tile_changed_at: I64, rows: I64, number: int) -> None:
    """Write the number of a change to rows (n,), and to their tiles."""
    for k in range(len(rows)):
        changed_at[rows[k]] = tile_changed_at[rows[k] // AREA] = number


class ChangeLog:
    """When each cell of a map last changed in what a view of it shows.

    Changes are counted; each cell keeps the number of its newest one, and each tile the newest of
    its cells. So what changed since is found by looking at the tiles that did, not at the map.
    """

    def __init__(self) -> None:
        self.number = 0  # of the newest change
        self._everything_at = 0  # number of the newest change of all cells at once
        self._changed_at = TileLayer(np.int64, 0)
        self._tile_changed_at = np.zeros(0, np.int64)

    @property
    def nbytes(self) -> int:
        return self._changed_at.nbytes + self._tile_changed_at.nbytes

    def grow(self, tiles: int) -> None:
        """Make room for this many tiles."""
        self._changed_at.grow(tiles)
        new = tiles - len(self._tile_changed_at)
        if new > 0:
            self._tile_changed_at = np.append(self._tile_changed_at, np.zeros(new, np.int64))

    def mark(self, rows: I64) -> None:
        """Cells changed, by rows (n,)."""
        self.number += 1
        mark_rows(self._changed_at.values, self._tile_changed_at, rows, self.number)

    def mark_everything(self) -> None:
        """All cells changed, or may have: what was known of them is of no use."""
        self.number += 1
        self._everything_at = self.number

    def covers(self, number: int) -> bool:
        """Whether ``rows_since`` can tell what changed since this change."""
        return self._everything_at <= number <= self.number

    def rows_since(self, number: int) -> I64:
        """Ascending rows (n,) of the cells that changed after this change."""
        tiles = np.flatnonzero(self._tile_changed_at > number)
        changed = self._changed_at.values.reshape(-1, AREA)[tiles] > number
        owner, within = np.nonzero(changed)
        rows: I64 = tiles[owner] * AREA + within
        return rows
