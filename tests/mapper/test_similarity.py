"""Scores as the encoder defines them, and the cache that computes only what changed."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays as hypothesis_arrays

from onemap_mapper import neutral_cosines, similarity
from onemap_mapper.cell_store import CellStore
from onemap_mapper.neutral_cosines import unit_cosines
from onemap_mapper.similarity import (
    ScoreCache,
    TextQuery,
    ranks,
    scores,
    scores_of,
    text_query,
)
from onemap_shared.geometry import F32
from onemap_shared.messages import TextEmbeddings

CPU = torch.device("cpu")


def unit(rng: np.random.Generator, *shape: int) -> np.ndarray:
    vectors = rng.normal(size=shape).astype(np.float32)
    result: np.ndarray = vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
    return result


def embeddings(
    rng: np.random.Generator, neutrals: int, temperature: float = 20.0
) -> TextEmbeddings:
    mask = rng.integers(0, 2, (2, neutrals)).astype(np.uint8)
    return TextEmbeddings(
        "e", "s", ("sofa", "cup"), unit(rng, 2, 8), unit(rng, neutrals, 8), mask, temperature
    )


@given(seed=st.integers(0, 2**16), neutrals=st.integers(0, 5), temperature=st.floats(1, 300))
@settings(max_examples=40, deadline=None)
def test_scores_are_those_of_the_message(seed: int, neutrals: int, temperature: float) -> None:
    rng = np.random.default_rng(seed)
    reply = embeddings(rng, neutrals, temperature)
    features = rng.normal(size=(6, 8)).astype(np.float32) * rng.uniform(0.1, 9, (6, 1))
    for text in range(2):
        fast = scores(torch.from_numpy(features.astype(np.float32)), text_query(reply, text, CPU))
        mask = reply.neutral_mask[text] > 0
        for cell, value in zip(features, fast.tolist(), strict=True):
            direction = cell / np.linalg.norm(cell)
            cosine = float(direction @ reply.embeddings[text])
            rivals = [float(direction @ neutral) for neutral in reply.neutral[mask]]
            expected = (1 + cosine) / 2
            if rivals:
                expected = 1 / (1 + sum(np.exp(temperature * (r - cosine)) for r in rivals))
            assert value == pytest.approx(expected, abs=2e-4)


def test_a_cell_without_a_feature_gets_a_score_too() -> None:
    query = text_query(embeddings(np.random.default_rng(0), 0), 0, CPU)
    assert scores(torch.zeros((1, 8)), query).tolist() == [0.5]


def test_only_changed_cells_are_computed_again(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(0)
    store, cache = CellStore(8, device=CPU, dtype=torch.float32), ScoreCache()
    query = text_query(embeddings(rng, 3), 0, CPU)
    computed: list[int] = []

    def counting(features: torch.Tensor, words: torch.Tensor) -> torch.Tensor:
        computed.append(len(features))
        return unit_cosines(features, words)

    monkeypatch.setattr(similarity, "unit_cosines", counting)
    monkeypatch.setattr(neutral_cosines, "unit_cosines", counting)
    for revision, slots in enumerate(([0, 1, 2, 3], [1, 4]), start=1):
        store.add(np.zeros((max(slots) + 1 - store.count, 2), np.int64))
        features = torch.from_numpy(unit(rng, len(slots), 8))
        store.fuse(np.array(slots), features, torch.ones(len(slots)), revision=revision)
        cached = cache.scores(query, store, revision)
        everything = unit_cosines(store.features(np.arange(store.count)), query.concepts)
        np.testing.assert_allclose(cached, scores_of(everything, query), atol=1e-6)
    assert computed == [4, 4, 2, 2]  # neutral words, then the text's own
    cache.scores(query, store, 2)
    assert computed == [4, 4, 2, 2]


@given(
    values=hypothesis_arrays(np.float32, st.integers(1, 300), elements=st.floats(-1, 1, width=16))
)
def test_ranks_keep_the_order_and_span_the_range(values: F32) -> None:
    rank = ranks(values)
    order = np.argsort(values, kind="stable")
    assert (np.diff(rank[order].astype(int)) >= 0).all()
    assert rank.min() == 1
    assert (rank[values == values.min()] == 1).all()
    top = rank[values == values.max()]
    assert (top == top[0]).all()
    if len(np.unique(values)) == len(values) > 1:
        assert top[0] == 255


def test_ranks_of_many_cells_are_those_of_a_sample() -> None:
    values = np.random.default_rng(0).random(50_000).astype(np.float32)
    np.testing.assert_allclose(ranks(values), 1 + values * 254, atol=8)


def test_nothing_has_no_ranks() -> None:
    assert ranks(np.zeros(0, np.float32)).shape == (0,)


def test_a_new_embedding_of_the_same_text_is_not_mixed_with_the_old() -> None:
    rng = np.random.default_rng(0)
    store, cache = CellStore(8, device=CPU, dtype=torch.float32), ScoreCache()
    slots = store.add(np.zeros((5, 2), np.int64))
    store.fuse(slots, torch.from_numpy(unit(rng, 5, 8)), torch.ones(5), revision=1)
    one, two = (text_query(embeddings(rng, 3), 0, CPU) for _ in range(2))
    cache.scores(one, store, 1)
    fresh = scores(store.features(slots), two)
    np.testing.assert_allclose(cache.scores(two, store, 1), fresh, atol=1e-6)


def test_the_cache_forgets_the_text_asked_longest_ago(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(similarity, "MAX_TEXTS", 2)
    rng = np.random.default_rng(0)
    store, cache = CellStore(8, device=CPU, dtype=torch.float32), ScoreCache()
    base = text_query(embeddings(rng, 2), 0, CPU)
    for text in ("a", "b", "c"):
        cache.scores(TextQuery(text, base.concepts, base.temperature), store, 0)
    assert list(cache._entries) == ["b", "c"]


def test_scores_stay_right_when_slots_were_removed() -> None:
    rng = np.random.default_rng(0)
    store, cache = CellStore(8, device=CPU, dtype=torch.float32), ScoreCache()
    slots = store.add(np.stack([np.arange(6), np.arange(6)], axis=1))
    store.fuse(slots, torch.from_numpy(unit(rng, 6, 8)), torch.ones(6), revision=1)
    query = text_query(embeddings(rng, 2), 0, CPU)
    before = cache.scores(query, store, 1)
    store.remove(np.array([1, 2]), revision=2)
    after = cache.scores(query, store, 2)
    np.testing.assert_allclose(after, before[store.cells[:, 0]], rtol=1e-6)


def test_the_words_that_compete_with_all_texts_are_compared_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    rng = np.random.default_rng(0)
    store, cache = CellStore(8, device=CPU, dtype=torch.float32), ScoreCache()
    slots = store.add(np.stack([np.arange(6), np.arange(6)], axis=1))
    store.fuse(slots, torch.from_numpy(unit(rng, 6, 8)), torch.ones(6), revision=1)
    reply = embeddings(rng, 40)
    widths: list[int] = []

    def counting(features: torch.Tensor, words: torch.Tensor) -> torch.Tensor:
        widths.append(len(words))
        return unit_cosines(features, words)

    monkeypatch.setattr(similarity, "unit_cosines", counting)
    monkeypatch.setattr(neutral_cosines, "unit_cosines", counting)
    for text in range(2):
        query = text_query(reply, text, CPU)
        cached = cache.scores(query, store, 1)
        np.testing.assert_allclose(cached, scores(store.features(slots), query), atol=1e-6)
    assert widths[:2] == [40, 1]
    assert widths.count(40) == 1


def test_a_map_of_many_cells_keeps_no_table(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(similarity, "MAX_CELLS", 5)
    rng = np.random.default_rng(0)
    store, cache = CellStore(8, device=CPU, dtype=torch.float32), ScoreCache()
    slots = store.add(np.stack([np.arange(6), np.arange(6)], axis=1))
    store.fuse(slots, torch.from_numpy(unit(rng, 6, 8)), torch.ones(6), revision=1)
    query = text_query(embeddings(rng, 3), 0, CPU)
    expected = scores(store.features(slots), query)
    np.testing.assert_allclose(cache.scores(query, store, 1), expected, atol=1e-6)
    assert cache._neutral is None
