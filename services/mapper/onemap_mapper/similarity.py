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
from onemap_shared.geometry import F32
from onemap_shared.messages import TextEmbeddings

MAX_TEXTS = 32  # whose scores are kept; 1 MB each for a map of 250,000 cells


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
    norms = torch.linalg.vector_norm(features, dim=1, keepdim=True)
    cosines = features @ query.concepts.T / norms.clamp(min=1e-12)
    if not query.calibrated:
        halves: Tensor = (1.0 + cosines[:, 0]) / 2.0
        return halves.clamp(0.0, 1.0)
    return torch.softmax(query.temperature * cosines, dim=1)[:, 0]


class ScoreCache:
    """Scores of one map for the most recent texts; only changed cells are computed again.

    Not thread-safe: the caller holds the lock of the map.
    """

    def __init__(self) -> None:
        self._entries: LRUCache[str, tuple[TextQuery, int, F32]] = LRUCache(MAX_TEXTS)

    def scores(self, query: TextQuery, store: CellStore, revision: int) -> F32:
        """Scores (count,) float32 of all slots at this revision of the map."""
        cached = self._entries.get(query.text)
        current = np.zeros(store.count, np.float32)
        stale = np.arange(store.count)
        if cached is not None and cached[0] is query:
            _, cached_at, values = cached
            current[: len(values)] = values
            stale = np.nonzero(store.changed_at > cached_at)[0]
        for chosen, features in store.chunks(stale):
            current[stale[chosen]] = scores(features, query).cpu().numpy()
        self._entries[query.text] = (query, revision, current)
        return current
