"""Texts to unit vectors behind a prompt and a cache, and the scores of features for them."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from cachetools import LRUCache

from onemap_shared.geometry import F32
from onemap_shared.messages import TextEmbeddings

EmbedTexts = Callable[[Sequence[str]], F32]  # N texts to rows (N, D) float32


class CachedTextEncoder:
    """Embeds texts, filled into ``prompt`` (``{}`` in it), and keeps the newest rows.

    capacity: number of texts whose rows are kept. Of one thread at a time.
    """

    def __init__(self, embed: EmbedTexts, *, prompt: str, capacity: int) -> None:
        self._embed = embed
        self._prompt = prompt
        self._rows: LRUCache[str, F32] = LRUCache(capacity)

    def __call__(self, texts: Sequence[str]) -> F32:
        """Unit rows (N, D) float32 of N >= 1 texts; the new ones in one run of the tower."""
        rows = {text: self._rows[text] for text in texts if text in self._rows}
        new = [text for text in dict.fromkeys(texts) if text not in rows]
        if new:
            embedded = self._embed([self._prompt.format(text) for text in new])
            rows.update(zip(new, unit_rows(embedded), strict=True))
        self._rows.update({text: rows[text] for text in texts})
        return np.stack([rows[text] for text in texts])


def unit_rows(rows: F32) -> F32:
    """Rows (N, D) scaled to length one."""
    unit: F32 = (rows / np.linalg.norm(rows, axis=1, keepdims=True)).astype(np.float32)
    return unit


def scores(features: F32, queries: TextEmbeddings) -> F32:
    """Score of each feature (P, D), unit rows, for each text: (P, N) float32 in [0, 1].

    The text's share in a softmax of temperature * cosine over itself and the neutral words that
    compete with it; without neutral words (1 + cosine) / 2.
    """
    cosines = features @ queries.embeddings.T
    if len(queries.neutral) == 0:
        uncalibrated: F32 = (1 + cosines) / 2
        return uncalibrated
    temperature = np.float32(queries.temperature)
    own_logits = temperature * cosines
    neutral_logits = temperature * (features @ queries.neutral.T)
    highest = np.maximum(own_logits.max(axis=1), neutral_logits.max(axis=1))[:, None]
    own = np.exp(own_logits - highest)
    competing = np.exp(neutral_logits - highest) @ queries.neutral_mask.T.astype(np.float32)
    shares: F32 = own / (own + competing)
    return shares


def uncalibrated_queries(
    texts: Sequence[str], rows: F32, *, encoder_id: str, text_space: str, floor: float
) -> TextEmbeddings:
    """Queries of embeddings (N, D) without neutral words: their score is (1 + cosine) / 2."""
    return TextEmbeddings(
        encoder_id=encoder_id,
        text_space=text_space,
        texts=tuple(texts),
        embeddings=rows,
        neutral=np.zeros((0, rows.shape[1]), np.float32),
        neutral_mask=np.zeros((len(texts), 0), np.uint8),
        temperature=1.0,
        floor=floor,
    )
