"""Scores against a slow implementation of the softmax."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from onemap_perception.text.embeddings import scores, uncalibrated_queries
from onemap_shared.geometry import F32
from onemap_shared.messages import TextEmbeddings


def unit_rows(rng: np.random.Generator, count: int) -> F32:
    rows: F32 = rng.normal(size=(count, 4)).astype(np.float32)
    rows /= np.linalg.norm(rows, axis=1, keepdims=True)
    return rows


def slow_scores(features: F32, queries: TextEmbeddings) -> np.ndarray:
    result = np.zeros((len(features), len(queries.texts)))
    for p, feature in enumerate(features.astype(np.float64)):
        for n, embedding in enumerate(queries.embeddings):
            own = np.exp(queries.temperature * (feature @ embedding))
            others = [
                np.exp(queries.temperature * (feature @ word))
                for word, competes in zip(queries.neutral, queries.neutral_mask[n], strict=True)
                if competes
            ]
            result[p, n] = own / (own + sum(others))
    return result


@given(seed=st.integers(0, 2**16))
def test_scores_agree_with_the_slow_implementation(seed: int) -> None:
    rng = np.random.default_rng(seed)
    features = unit_rows(rng, 5)
    queries = TextEmbeddings(
        encoder_id="e",
        text_space="s",
        texts=("x", "y", "z"),
        embeddings=unit_rows(rng, 3),
        neutral=unit_rows(rng, 6),
        neutral_mask=rng.integers(0, 2, (3, 6)).astype(np.uint8),
        temperature=12.0,
    )
    fast = scores(features, queries)
    np.testing.assert_allclose(fast, slow_scores(features, queries), rtol=1e-3, atol=1e-6)
    assert ((fast >= 0) & (fast <= 1)).all()


def test_without_calibration_the_score_is_the_cosine() -> None:
    queries = uncalibrated_queries(
        ["x"], np.eye(4, dtype=np.float32)[:1], encoder_id="e", text_space="s", floor=0.3
    )
    features = np.array([[1, 0, 0, 0], [-1, 0, 0, 0], [0, 1, 0, 0]], np.float32)
    np.testing.assert_allclose(scores(features, queries)[:, 0], [1, 0, 0.5])
    assert (queries.texts, queries.floor) == (("x",), 0.3)
