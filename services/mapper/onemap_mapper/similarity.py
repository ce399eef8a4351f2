"""Similarity of each observed cell to a text.

The cosine of text and cell feature becomes a score as the encoder's calibration defines: the
probability of the text against the neutral words that compete with it, or (1 + cosine) / 2 for
an encoder without calibration.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from cachetools import LRUCache
from torch import Tensor

from onemap_mapper.cell_store import CellStore
from onemap_mapper.neutral_cosines import MAX_CELLS, NeutralCosines, shares, unit_cosines
from onemap_shared.geometry import F32, I64, U8
from onemap_shared.messages import TextEmbeddings

MAX_TEXTS = 32  # whose scores are kept; 2 MB each for a map of 250,000 cells
RANKED_CELLS = 4096  # a rank among so many is right to a percent or two


@dataclass(frozen=True, slots=True)
class TextQuery:
    """One embedded text. concepts (1 + m, D) float32 unit rows: the text, then competing words.

    neutral (M, D): all words that may compete; excluded (M,): 0 for those m, -inf for the others.
    Both are None if the query does not say.
    min_score: a best score below this means that the map holds no such thing, 0 = not calibrated;
    nearest: words of the encoder next to a text that it does not contain.
    """

    text: str
    concepts: Tensor
    temperature: float
    min_score: float = 0.0
    nearest: tuple[str, ...] = ()
    neutral: Tensor | None = None
    excluded: Tensor | None = None

    @property
    def calibrated(self) -> bool:
        """Whether scores are probabilities."""
        return len(self.concepts) > 1


def text_query(embeddings: TextEmbeddings, index: int, device: torch.device) -> TextQuery:
    """The query of one of the texts of a reply from perception."""
    competing = embeddings.neutral[embeddings.neutral_mask[index] > 0]
    concepts = np.concatenate([embeddings.embeddings[index : index + 1], competing])
    return TextQuery(
        embeddings.texts[index],
        torch.from_numpy(concepts).to(device),
        embeddings.temperature,
        embeddings.floor,
        embeddings.nearest[index] if embeddings.nearest else (),
        torch.tensor(embeddings.neutral, device=device),
        torch.tensor(np.where(embeddings.neutral_mask[index] > 0, 0.0, -np.inf)).float().to(device),
    )


def scores(features: Tensor, query: TextQuery) -> Tensor:
    """Scores (n,) float32 in [0, 1] of cell features (n, D) float32, of any length."""
    return scores_of(cosines(features, query), query)


def cosines(features: Tensor, query: TextQuery) -> Tensor:
    """Cosines (n, 1 + m) of cell features (n, D) with the text and its competing words."""
    return unit_cosines(features, query.concepts)


def scores_of(cosine: Tensor, query: TextQuery) -> Tensor:
    """Scores (n,) float32 of cosines (n, 1 + m)."""
    if not query.calibrated:
        halves: Tensor = (1.0 + cosine[:, 0]) / 2.0
        return halves.clamp(0.0, 1.0)
    shares: Tensor = torch.softmax(query.temperature * cosine, dim=1)[:, 0]
    return shares


def ranks(values: F32) -> U8:
    """Rank (n,) of each value among all: 1 for the lowest, 255 for the highest; ties are equal.

    What a score cannot tell where it is 0 almost everywhere, its rank can: which of the cells
    that do not show the object are most like it.
    """
    if values.size == 0:
        return np.zeros(0, np.uint8)
    ordered = np.sort(values[:: max(1, values.size // RANKED_CELLS)])
    below = np.searchsorted(ordered, values, side="left")
    share = below / max(len(ordered) - 1, 1)
    return (1 + np.minimum(share, 1.0) * 254).astype(np.uint8)


@dataclass(frozen=True, slots=True)
class CellScores:
    """Scores and cosines, (count,) float32 each, of one query at a revision of the map."""

    query: TextQuery
    revision: int
    scores: F32
    cosines: F32


class ScoreCache:
    """Scores of one map for the most recent texts; only changed cells are computed again.

    Not thread-safe: the caller holds the lock of the map.
    """

    def __init__(self) -> None:
        self._entries: LRUCache[str, CellScores] = LRUCache(MAX_TEXTS)
        self._neutral: NeutralCosines | None = None

    def scores(self, query: TextQuery, store: CellStore, revision: int) -> F32:
        """Scores (count,) float32 of all slots at this revision of the map."""
        return self.cell_scores(query, store, revision).scores

    def cell_scores(self, query: TextQuery, store: CellStore, revision: int) -> CellScores:
        """Scores and cosines of all slots at this revision of the map."""
        cached = self._entries.get(query.text)
        both = np.zeros((2, store.count), np.float32)
        stale = np.arange(store.count)
        if cached is not None and cached.query is query:
            kept = min(len(cached.scores), store.count)  # a corrected map may have fewer cells
            both[0, :kept] = cached.scores[:kept]
            both[1, :kept] = cached.cosines[:kept]
            stale = np.nonzero(store.changed_at > cached.revision)[0]
        neutral = self._neutral_cosines(query, store, revision) if len(stale) else None
        for chosen, features in store.chunks(stale):
            slots = stale[chosen]
            if neutral is None or query.excluded is None:
                cosine = cosines(features, query)
                own, values = cosine[:, 0], scores_of(cosine, query)
            else:
                own = unit_cosines(features, query.concepts[:1])[:, 0]
                values = shares(own, _rows(neutral, slots), query.excluded, query.temperature)
            both[0, slots], both[1, slots] = values.cpu().numpy(), own.cpu().numpy()
        current = CellScores(query, revision, both[0], both[1])
        self._entries[query.text] = current
        return current

    def _neutral_cosines(self, query: TextQuery, store: CellStore, revision: int) -> Tensor | None:
        """Cosines (count, M) of all slots with the query's neutral words; None: not kept."""
        words = query.neutral
        if words is None or not query.calibrated or store.count > MAX_CELLS:
            return None
        if self._neutral is None or not torch.equal(self._neutral.words, words):
            self._neutral = NeutralCosines(words)
        return self._neutral.of(store, revision)


def _rows(table: Tensor, slots: I64) -> Tensor:
    """Rows of a table at ascending slots; consecutive ones are not copied."""
    first, last = int(slots[0]), int(slots[-1])
    together = last - first + 1 == len(slots)
    return table[first : last + 1] if together else table[torch.from_numpy(slots)]
