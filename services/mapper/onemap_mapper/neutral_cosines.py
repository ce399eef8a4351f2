"""Cosines of a map's cells with the words that compete with every text.

All texts of an encoder compete with the same words: their cosines are computed once for each
change of a cell, not once for each text that is asked for.
"""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor

from onemap_mapper.cell_store import CellStore

MAX_CELLS = 100_000  # 40 MB for the 103 words of mini; for more cells each text computes its own


class NeutralCosines:
    """Cosines (count, m) float32 of all slots of one map with the words (m, D), unit rows."""

    def __init__(self, words: Tensor) -> None:
        self.words = words
        self._table = torch.zeros((0, len(words)), dtype=torch.float32, device=words.device)
        self._revision = -1

    def of(self, store: CellStore, revision: int) -> Tensor:
        """The cosines at this revision of the map; only changed cells are computed again."""
        if revision != self._revision or len(self._table) != store.count:
            self._update(store)
            self._revision = revision
        return self._table

    def _update(self, store: CellStore) -> None:
        kept = min(len(self._table), store.count)  # a corrected map may have fewer cells
        table = self._table.new_zeros((store.count, len(self.words)))
        table[:kept] = self._table[:kept]
        stale = np.nonzero((store.changed_at > self._revision) | (np.arange(store.count) >= kept))
        for chosen, features in store.chunks(stale[0]):
            table[torch.from_numpy(stale[0][chosen])] = unit_cosines(features, self.words)
        self._table = table


def unit_cosines(features: Tensor, words: Tensor) -> Tensor:
    """Cosines (n, m) of cell features (n, D) of any length with unit rows (m, D)."""
    norms = torch.linalg.vector_norm(features, dim=1, keepdim=True)
    cosine: Tensor = features @ words.T / norms.clamp(min=1e-12)
    return cosine


def shares(own: Tensor, neutral: Tensor, excluded: Tensor, temperature: float) -> Tensor:
    """Softmax shares (n,) of a text's cosines (n,) against those of neutral words (n, m).

    excluded (m,): 0 for words that compete with the text, -inf for those that do not.
    """
    rest = torch.logsumexp(temperature * neutral + excluded, dim=1)
    share: Tensor = torch.sigmoid(temperature * own - rest)
    return share
