"""When each cell of a map last changed in what a view of it shows.

Changes are counted, and each cell of the map's tiles keeps the number of its newest one, and each
tile the newest of its cells. So what changed since a number is found by looking at the tiles that
changed, whatever the size of the map.
"""

from __future__ import annotations

import numpy as np

from onemap_mapper.tiles import AREA, TileLayer
from onemap_shared.geometry import I64


class ChangeLog:
    """The changes of one map; rows are those of its ``TileIndex``."""

    def __init__(self) -> None:
        self.number = 0  # of the newest change
        self._everything_at = 0  # number of the newest change of all cells at once
        self._changed_at = TileLayer(np.int64, 0)
        self._tile_changed_at: I64 = np.zeros(0, np.int64)

    @property
    def nbytes(self) -> int:
        """Bytes held: 8 for each cell of a tile."""
        return self._changed_at.nbytes + self._tile_changed_at.nbytes

    def grow(self, tiles: int) -> None:
        """Make room for this many tiles."""
        self._changed_at.grow(tiles)
        new = tiles - len(self._tile_changed_at)
        if new > 0:
            self._tile_changed_at = np.pad(self._tile_changed_at, (0, new))

    def mark(self, rows: I64) -> None:
        """Cells changed, by rows (n,)."""
        self.number += 1
        self._changed_at.values[rows] = self.number
        self._tile_changed_at[rows // AREA] = self.number

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
