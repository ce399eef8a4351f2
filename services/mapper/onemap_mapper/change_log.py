"""When each cell of a map last changed in what a view of it shows.

Changes are counted, and each cell of the map's tiles keeps the number of its newest one, and each
tile the newest of its cells. So what changed since a number is found by looking at the tiles that
changed, whatever the size of the map.
"""

from __future__ import annotations

import torch
from torch import Tensor

from onemap_mapper.tiles import AREA, TileLayer
from onemap_mapper.transfers import CPU


class ChangeLog:
    """The changes of one map, on its device; rows are those of its ``TileIndex``."""

    def __init__(self, device: torch.device = CPU) -> None:
        self.number = 0  # of the newest change
        self._everything_at = 0  # number of the newest change of all cells at once
        self._changed_at = TileLayer(torch.int64, 0, (), device)
        self._tile_changed_at = torch.zeros(0, dtype=torch.int64, device=device)

    @property
    def nbytes(self) -> int:
        """Bytes held: 8 for each cell of a tile."""
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
        self._changed_at.values[rows] = self.number
        self._tile_changed_at[rows // AREA] = self.number

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
