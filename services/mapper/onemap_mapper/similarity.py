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
from onemap_shared.geometry import F32, U8
from onemap_shared.messages import TextEmbeddings

MAX_TEXTS = 32  # whose scores are kept; 2 MB each for a map of 250,000 cells
RANKED_CELLS = 4096  # a rank among so many is right to a percent or two


@dataclass(frozen=True, slots=True)
class TextQuery:
    """One embedded text. concepts (1 + m, D) float32 unit rows: the text, then competing words.

    min_score: a best score below this means that the map holds no such thing, 0 = not calibrated;
    nearest: words of the encoder next to a text that it does not contain.
    """

    text: str
    concepts: Tensor
    temperature: float
    min_score: float = 0.0
    nearest: tuple[str, ...] = ()

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
    )


def scores(features: Tensor, query: TextQuery) -> Tensor:
    """Scores (n,) float32 in [0, 1] of cell features (n, D) float32, of any length."""
    return scores_of(cosines(features, query), query)


def cosines(features: Tensor, query: TextQuery) -> Tensor:
    """Cosines (n, 1 + m) of cell features (n, D) with the text and its competing words."""
    norms = torch.linalg.vector_norm(features, dim=1, keepdim=True)
    cosine: Tensor = features @ query.concepts.T / norms.clamp(min=1e-12)
    return cosine


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
        for chosen, features in store.chunks(stale):
            cosine = cosines(features, query)
            both[0, stale[chosen]] = scores_of(cosine, query).cpu().numpy()
            both[1, stale[chosen]] = cosine[:, 0].cpu().numpy()
        current = CellScores(query, revision, both[0], both[1])
        self._entries[query.text] = current
        return current
