"""Rows of world cells in the memory of a map, through the directory of its tiles."""

from __future__ import annotations

import numpy as np

from onemap_mapper.kernels.jit import compiled
from onemap_shared.geometry import I64


@compiled
def tile_rows(cells: I64, directory: I64, origin: I64, side: int) -> I64:  # pragma: no cover
    """Rows (n,) of world cells (n, 2), as ``tiles.rows_by_torch``; -1: no tile.

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
