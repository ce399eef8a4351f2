"""What the words that compete with a text weigh in each cell.

A text's score is its share in a softmax over itself and those words. Their part in it, the
logarithm of the sum of their exponentials, does not depend on the text: it is computed once for
each change of a cell, and kept for each set of competing words.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import torch
from cachetools import LRUCache
from torch import Tensor

from onemap_mapper.feature_table import CellFeatures
from onemap_mapper.slot_values import SlotValues
from onemap_shared.geometry import I64

LEAST_NORM = 1e-12  # shorter features have no direction: their cosines are 0
NOTHING_KNOWN = (-1, 0)  # before any revision, of no cell
MAX_SETS = 32  # of competing words: most texts of an encoder share one; 4 bytes per cell each


class NeutralSums:
    """log(sum(exp(temperature cosine))) (count,) float32 of all slots of one map, per set of words.

    words (m, D) float32 unit rows: all that may compete.
    """

    def __init__(self, words: Tensor, temperature: float) -> None:
        self.words, self.temperature = words, temperature
        self._sums: LRUCache[bytes, tuple[Tensor, SlotValues]] = LRUCache(MAX_SETS)  # with excluded
        self._revision, self._count = -1, 0

    def fits(self, words: Tensor, temperature: float) -> bool:
        """Whether these sums are those of these words at this temperature."""
        return self.temperature == temperature and torch.equal(self.words, words)

    def known(self, excluded: Tensor) -> tuple[int, int]:
        """Of which revision, and of how many first slots, there are sums; -1 and 0: of none."""
        kept = _key(excluded) in self._sums
        return (self._revision, self._count) if kept else NOTHING_KNOWN

    def of(self, store: CellFeatures, revision: int, excluded: Tensor) -> Tensor:
        """The sums at this revision of the map; only changed cells are computed again.

        They are valid until the next call.
        excluded (m,): 0 for words that compete, -inf for those that do not.
        """
        if revision != self._revision or store.count != self._count:
            self._update(store)
            self._revision, self._count = revision, store.count
        key = _key(excluded)
        if key not in self._sums:
            sums = SlotValues(1, self.words.device)
            sums.resize(store.count)
            self._fill({key: (excluded, sums)}, store, np.arange(store.count))
            self._sums[key] = (excluded, sums)
        return self._sums[key][1].values[0]

    def _update(self, store: CellFeatures) -> None:
        """Follow the map: grow or shrink with it, and compute what changed."""
        if not self._sums:
            return
        stale = store.changed_since(self._revision, self._count)
        for _, sums in self._sums.values():
            sums.resize(store.count)
        self._fill(self._sums, store, stale)

    def _fill(
        self, sets: Mapping[bytes, tuple[Tensor, SlotValues]], store: CellFeatures, slots: I64
    ) -> None:
        """Compute the sums of these slots for these sets of words."""
        for chosen, features in store.chunks(slots):
            weighed = self.temperature * unit_cosines(features, self.words)
            index = torch.from_numpy(slots[chosen]).to(weighed.device)
            for excluded, sums in sets.values():
                sums.values[0, index] = torch.logsumexp(weighed + excluded, dim=1)


def _key(excluded: Tensor) -> bytes:
    return excluded.cpu().numpy().tobytes()


def unit_cosines(features: Tensor, words: Tensor) -> Tensor:
    """Cosines (n, m) of cell features (n, D) of any length with unit rows (m, D)."""
    norms = torch.linalg.vector_norm(features, dim=1, keepdim=True)
    cosine: Tensor = features @ words.T / norms.clamp(min=LEAST_NORM)
    return cosine


def shares(own: Tensor, sums: Tensor, temperature: float) -> Tensor:
    """Softmax shares (n,) of a text's cosines (n,) against the sums (n,) of competing words."""
    share: Tensor = torch.sigmoid(temperature * own - sums)
    return share
