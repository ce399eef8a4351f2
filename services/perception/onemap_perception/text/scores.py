"""Scores of features for texts: a softmax over cosines, or the cosine itself."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from onemap_shared.geometry import F32
from onemap_shared.messages import TextEmbeddings


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
