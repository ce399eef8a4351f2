"""Tiles: where in memory a cell of an unbounded map lies.

The map is cut into tiles of 64 x 64 cells, allocated when a cell in them is first observed. A
tile has a number, and its cells are consecutive in every per-cell array ("rows"):
row = number * 4096 + (ix mod 64) * 64 + (iy mod 64). A directory over the bounding box of all
tiles maps tile coordinates to numbers. It is on the host, where tiles are allocated, with a copy on
the device, where frames look up their rows.
"""

from __future__ import annotations

from copy import copy

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from onemap_mapper import jit
from onemap_mapper.jit import compiled
from onemap_mapper.params import MapParams
from onemap_mapper.transfers import CPU, to_device, to_host
from onemap_shared.geometry import I64
from onemap_shared.grid import GridSpec, GridTooLarge
from onemap_shared.messages import TILE_CELLS


@compiled
def tile_rows(cells: I64, directory: I64, origin: I64, side: int) -> I64:
    """Rows (n,) of world cells (n, 2), as ``rows_by_torch``; -1: no tile.

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

    def __init__(self, params: MapParams, device: torch.device = CPU) -> None:
        self.cell_size_m = params.cell_size_m
        self.count = 0
        self._device = device
        self._compiled = jit.usable(wanted=params.compiled, device=device)
        self._max_tiles = max(1, int(params.max_extent_m / (params.cell_size_m * SIDE)))
        self._origin = np.zeros(2, np.int64)  # tile coordinates of the directory's [0, 0]
        self._directory = np.full((0, 0), NO_ROW, np.int64)
        self._on_device = torch.full((0, 0), NO_ROW, dtype=torch.int64, device=device)

    def copy(self) -> TileIndex:
        """An index on the host that does not grow with this one."""
        made = copy(self)
        made._directory = self._directory.copy()
        made._device, made._on_device = CPU, torch.from_numpy(made._directory)
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
        if self._compiled:
            return tile_rows(np.ascontiguousarray(cells), self._directory, self._origin, SIDE)
        directory = torch.from_numpy(self._directory)
        rows: I64 = rows_by_torch(torch.from_numpy(cells), directory, self._origin).numpy()
        return rows

    def rows_on_device(self, cells: Tensor) -> Tensor:
        """As ``rows``, of cells on the device."""
        if self._compiled:
            return torch.from_numpy(self.rows(cells.numpy()))
        return rows_by_torch(cells, self._on_device, self._origin)

    def check(self, cells: I64) -> None:
        """Raise ``MapTooLarge`` if world cells (n, 2) do not fit; allocates nothing."""
        self._extended(cells // SIDE)

    def allocate(self, cells: Tensor) -> Tensor:
        """Rows (n,) of world cells (n, 2) on the device, in tiles that are added where missing.

        The host learns which tiles they lie in. Raises ``MapTooLarge`` before any change.
        """
        if len(cells) == 0:
            return self.rows_on_device(cells)
        if self._compiled and bool((rows := self.rows_on_device(cells)).min() != NO_ROW):
            return rows
        tiles = cells // SIDE
        low, high = to_host(torch.stack([tiles.amin(dim=0), tiles.amax(dim=0)]))
        self._grow_directory(np.stack([low, high]))
        (x, y), (nx, ny) = low.tolist(), (high - low + 1).tolist()
        touched = torch.zeros(nx * ny, dtype=torch.bool, device=tiles.device)
        touched[(tiles[:, 0] - x) * ny + tiles[:, 1] - y] = True
        self._number(np.argwhere(to_host(touched).reshape(nx, ny)) + low)
        return self.rows_on_device(cells)

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

    def _number(self, tiles: I64) -> None:
        """Give numbers to those of distinct tiles (n, 2) that have none, in their order."""
        place = tiles - self._origin
        new = tuple(place[self._directory[tuple(place.T)] == NO_ROW].T)
        self._directory[new] = np.arange(self.count, self.count + len(new[0]))
        self.count += len(new[0])
        if len(new[0]):
            self._on_device = to_device(self._directory, self._device)

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


def rows_by_torch(cells: Tensor, directory: Tensor, origin: I64) -> Tensor:
    """Rows (n,) of world cells (n, 2) by a directory (nx, ny) whose [0, 0] is tile ``origin``."""
    (x0, y0), (nx, ny) = origin.tolist(), directory.shape
    if directory.numel() == 0:
        return torch.full((len(cells),), NO_ROW, dtype=torch.int64, device=cells.device)
    tiles = cells // SIDE
    x, y = tiles[:, 0] - x0, tiles[:, 1] - y0
    inside = (x >= 0) & (x < nx) & (y >= 0) & (y < ny)
    number = torch.where(inside, directory[x.clamp(0, nx - 1), y.clamp(0, ny - 1)], NO_ROW)
    within = (cells[:, 0] % SIDE) * SIDE + cells[:, 1] % SIDE
    return torch.where(number >= 0, number * AREA + within, NO_ROW)


class TileLayer:
    """One per-cell array (rows, ...) on the device of the map that grows with the tiles."""

    def __init__(
        self,
        dtype: torch.dtype,
        fill: int,
        depth: tuple[int, ...] = (),
        device: torch.device = CPU,
    ) -> None:
        self._fill = fill
        self._values = torch.full((0, *depth), fill, dtype=dtype, device=device)
        self._rows = 0

    def copy(self) -> TileLayer:
        """A layer that does not change with this one, without what is reserved for growth."""
        made = copy(self)
        made._values = self.values.clone()
        return made

    @property
    def values(self) -> Tensor:
        """The array of all allocated rows, on the device; writing to it changes the layer."""
        return self._values[: self._rows]

    @property
    def nbytes(self) -> int:
        return self._values.nbytes

    def grow(self, tiles: int) -> None:
        """Make room for this many tiles."""
        rows = tiles * AREA
        if rows > len(self._values):
            reserve = max(rows, len(self._values) * 3 // 2)
            larger = self._values.new_full((reserve, *self._values.shape[1:]), self._fill)
            larger[: self._rows] = self.values
            self._values = larger
        self._rows = max(self._rows, rows)


@compiled
def mark_rows(changed_at: I64, tile_changed_at: I64, rows: I64, number: int) -> None:
    """Write the number of a change to rows (n,), and to their tiles."""
    for k in range(len(rows)):
        changed_at[rows[k]] = tile_changed_at[rows[k] // AREA] = number


class ChangeLog:
    """When each cell of a map last changed in what a view of it shows, on the map's device.

    Changes are counted; each cell keeps the number of its newest one, and each tile the newest of
    its cells. So what changed since is found by looking at the tiles that did, not at the map.
    """

    def __init__(self, device: torch.device = CPU, *, compiled: bool = False) -> None:
        self._compiled = jit.usable(wanted=compiled, device=device)
        self.number = 0  # of the newest change
        self._everything_at = 0  # number of the newest change of all cells at once
        self._changed_at = TileLayer(torch.int64, 0, (), device)
        self._tile_changed_at = torch.zeros(0, dtype=torch.int64, device=device)

    @property
    def nbytes(self) -> int:
        return self._changed_at.nbytes + self._tile_changed_at.nbytes

    def grow(self, tiles: int) -> None:
        """Make room for this many tiles."""
        self._changed_at.grow(tiles)
        new = tiles - len(self._tile_changed_at)
        if new > 0:
            none = self._tile_changed_at.new_zeros(new)
            self._tile_changed_at = torch.cat([self._tile_changed_at, none])

    def mark(self, rows: Tensor) -> None:
        """Cells changed, by rows (n,)."""
        self.number += 1
        changed_at, tile_changed_at = self._changed_at.values, self._tile_changed_at
        if self._compiled:
            mark_rows(changed_at.numpy(), tile_changed_at.numpy(), rows.numpy(), self.number)
            return
        changed_at[rows] = self.number
        tile_changed_at[rows // AREA] = self.number

    def mark_everything(self) -> None:
        """All cells changed, or may have: what was known of them is of no use."""
        self.number += 1
        self._everything_at = self.number

    def covers(self, number: int) -> bool:
        """Whether ``rows_since`` can tell what changed since this change."""
        return self._everything_at <= number <= self.number

    def rows_since(self, number: int) -> Tensor:
        """Ascending rows (n,), on the device, of the cells that changed after this change."""
        tiles = torch.nonzero(self._tile_changed_at > number).squeeze(1)
        changed = self._changed_at.values.view(-1, AREA)[tiles] > number
        owner, within = torch.nonzero(changed, as_tuple=True)
        return tiles[owner] * AREA + within
