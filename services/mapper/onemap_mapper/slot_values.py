"""Numbers for each slot of a map, which grow with it in place."""

from __future__ import annotations

import torch
from torch import Tensor

RESERVE = 1.5  # times what is needed, so that growing by a frame's cells rarely copies


class SlotValues:
    """``rows`` float32 numbers for each slot, 0 for new ones."""

    def __init__(self, rows: int, device: torch.device) -> None:
        self._held = torch.zeros((rows, 0), device=device)
        self._count = 0

    @property
    def count(self) -> int:
        """Slots."""
        return self._count

    @property
    def values(self) -> Tensor:
        """The numbers (rows, count), not copied: writing to them changes these."""
        return self._held[:, : self._count]

    def resize(self, count: int) -> None:
        """Make it this many slots; a corrected map may have fewer than before."""
        if count > self._held.shape[1]:
            reserved = int(count * RESERVE) if self._count else count
            held = self._held.new_zeros((len(self._held), reserved))
            held[:, : self._count] = self.values
            self._held = held
        self._held[:, self._count : count] = 0.0
        self._count = count
