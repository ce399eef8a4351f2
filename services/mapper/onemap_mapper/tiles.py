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

from onemap_mapper.params import GridParams
from onemap_shared.geometry import I64
from onemap_shared.grid import GridSpec, GridTooLarge
from onemap_shared.messages import TILE_CELLS

SIDE = TILE_CELLS  # 6.4 m at 0.1 m, so a room has a few tiles and a flat a few dozen
AREA = SIDE * SIDE
NO_ROW = -1


class MapTooLarge(GridTooLarge):
    """The cells exceed the configured extent: most likely a jump of the pose."""


class TileIndex:
    """The tiles of one map, numbered in order of allocation."""

    def __init__(self, params: GridParams) -> None:
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
        """Bytes of the directory."""
        return self._directory.nbytes

    def rows(self, cells: I64) -> I64:
        """Rows (n,) of world cells (n, 2), ``NO_ROW`` where there is no tile."""
        place = cells // SIDE - self._origin
        inside = ((place >= 0) & (place < self._directory.shape)).all(axis=1)
        rows = np.full(len(cells), NO_ROW, np.int64)
        within = cells % SIDE
        number = self._directory[tuple(place[inside].T)]
        rows[inside] = np.where(
            number >= 0, number * AREA + within[inside, 0] * SIDE + within[inside, 1], NO_ROW
        )
        return rows

    def check(self, cells: I64) -> None:
        """Raise ``MapTooLarge`` if world cells (n, 2) do not fit; allocates nothing."""
        self._extended(cells // SIDE)

    def allocate(self, cells: I64) -> I64:
        """Rows (n,) of world cells (n, 2); tiles that are missing are added.

        Raises ``MapTooLarge`` before anything has changed.
        """
        if len(cells) == 0:
            return np.zeros(0, np.int64)
        self._grow_directory(cells // SIDE)
        place = cells // SIDE - self._origin
        wanted = np.zeros(self._directory.shape, bool)
        wanted[tuple(place.T)] = True
        missing = np.nonzero(wanted & (self._directory == NO_ROW))
        self._directory[missing] = np.arange(self.count, self.count + len(missing[0]))
        self.count += len(missing[0])
        return self.rows(cells)

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
        """Bytes held, with those reserved for growth."""
        return self._values.nbytes

    def grow(self, tiles: int) -> None:
        """Make room for this many tiles."""
        rows = tiles * AREA
        if rows > len(self._values):
            reserve = max(rows, len(self._values) * 3 // 2)
            larger = np.full((reserve, *self._values.shape[1:]), self._fill, self._values.dtype)
            larger[: self._rows] = self.values
            self._values = larger
        self._rows = max(self._rows, rows)
