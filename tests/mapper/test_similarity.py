"""Scores as the encoder defines them, and the cache that computes only what changed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays as hypothesis_arrays

from onemap_mapper.belief.cells import CellStore
from onemap_mapper.query.similarity import (
    CellScores,
    ScoreCache,
    TextQuery,
    against,
    rank_limits,
    ranks,
    scores_of,
    text_query,
)
from onemap_shared.geometry import F32, I64
from onemap_shared.messages import RANKS, TextEmbeddings, ranked

CPU = torch.device("cpu")


def unit_cosines(features: torch.Tensor, words: torch.Tensor) -> torch.Tensor:
    """Cosines (n, m) of cell features (n, D) of any length with unit rows (m, D)."""
    return torch.nn.functional.normalize(features, dim=1) @ words.T


def scores(features: torch.Tensor, query: TextQuery) -> torch.Tensor:
    return scores_of(unit_cosines(features, all_concepts(query)), query)


def all_concepts(query: TextQuery) -> torch.Tensor:
    """The text and the words that compete with it."""
    if query.neutral is None or query.excluded is None:
        return query.concepts
    return torch.cat([query.concepts[:1], query.neutral[query.excluded == 0]])


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


def test_only_changed_cells_are_computed_again(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(0)
    store, cache = CellStore(8, device=CPU, dtype=torch.float32), ScoreCache()
    query = text_query(embeddings(rng, 3), 0, CPU)
    read = reads(monkeypatch)
    for revision, slots in enumerate(([0, 1, 2, 3], [1, 4]), start=1):
        store.new_slots(np.zeros((max(slots) + 1 - store.count, 2), np.int64))
        features = torch.from_numpy(unit(rng, len(slots), 8))
        store.fuse(np.array(slots), features, np.ones(len(slots), np.float32), revision=revision)
        cached = cache.scores_of_all([query], store, revision)[0].scores
        everything = unit_cosines(store.features(np.arange(store.count)), all_concepts(query))
        np.testing.assert_allclose(cached, scores_of(everything, query), atol=1e-6)
    assert read == [4, 4, 2, 2]  # the text, the words that compete
    cache.scores_of_all([query], store, 2)
    assert sum(read) == 12


def reads(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """How many rows of features were read, each time that some were, from now on."""
    read: list[int] = []
    chunks, products = CellStore.chunks, CellStore.products

    def counted_chunks(store: CellStore, slots: I64) -> Iterator[tuple[I64, torch.Tensor]]:
        if len(slots):
            read.append(len(slots))
        return chunks(store, slots)

    def counted_products(store: CellStore, slots: I64, vectors: torch.Tensor) -> torch.Tensor:
        read.append(len(slots))
        return products(store, slots, vectors)

    monkeypatch.setattr(CellStore, "chunks", counted_chunks)
    monkeypatch.setattr(CellStore, "products", counted_products)
    return read


@given(seed=st.integers(0, 2**16), dtype=st.sampled_from([torch.float32, torch.float16]))
@settings(max_examples=30, deadline=None)
def test_texts_asked_together_score_as_one_by_one(seed: int, dtype: torch.dtype) -> None:
    """Some of them were asked before, and the map has changed since."""
    rng = np.random.default_rng(seed)
    store, together = CellStore(8, device=CPU, dtype=dtype), ScoreCache()
    reply = embeddings(rng, int(rng.integers(0, 5)))
    queries = [text_query(reply, text, CPU) for text in range(2)]
    for revision in range(1, 4):
        store.new_slots(np.zeros((3, 2), np.int64))
        some = np.flatnonzero(rng.random(store.count) < 0.7)
        features = torch.from_numpy(unit(rng, len(some), 8)).reshape(-1, 8)
        store.fuse(some, features, np.ones(len(some), np.float32), revision=revision)
        asked = [queries[k] for k in rng.permutation(2)[: rng.integers(1, 3)]]
        found = together.scores_of_all(asked, store, revision)
        table = store.features(np.arange(store.count))
        for query, each in zip(asked, found, strict=True):
            np.testing.assert_allclose(each.scores, scores(table, query), atol=2e-5)


@pytest.mark.parametrize("texts", [1, 2, 3, 40])
@pytest.mark.parametrize("dtype", [torch.float32, torch.float16])
@pytest.mark.parametrize("compiled", [False, True])
def test_products_are_those_of_the_whole_table(
    dtype: torch.dtype, texts: int, compiled: bool
) -> None:
    rng = np.random.default_rng(0)
    store = CellStore(8, device=CPU, dtype=dtype, compiled=compiled)
    slots = store.new_slots(np.zeros((5000, 2), np.int64))
    store.fuse(slots, torch.from_numpy(unit(rng, 5000, 8)), np.ones(5000, np.float32), revision=1)
    vectors = torch.from_numpy(unit(rng, texts, 8))
    for chosen in (slots, slots[::7], slots[4000:4200]):
        expected = vectors @ store.features(chosen).T
        torch.testing.assert_close(store.products(chosen, vectors), expected, rtol=0, atol=1e-6)


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


@given(seed=st.integers(0, 2**16), temperature=st.floats(1, 200))
@settings(max_examples=40, deadline=None)
def test_words_that_do_not_compete_are_taken_out_of_the_sum(seed: int, temperature: float) -> None:
    """A text may be one of the words; cells may look like what does not compete, and no other."""
    rng = np.random.default_rng(seed)
    store, cache = CellStore(8, device=CPU, dtype=torch.float32), ScoreCache()
    reply = embeddings(rng, 6, temperature)
    text = torch.from_numpy(np.where(rng.random(2) < 0.5, reply.neutral[:2].T, unit(rng, 8, 2)).T)
    mask = np.ones((2, 6), np.uint8)
    mask[0, 0] = mask[1, 1] = mask[1, 2] = 0
    features = np.concatenate([unit(rng, 5, 8), reply.neutral, reply.neutral[:3] + 1e-3])
    slots = store.new_slots(np.zeros((len(features), 2), np.int64))
    store.fuse(slots, torch.from_numpy(features), np.ones(len(features), np.float32), revision=1)
    reply = replace(reply, embeddings=text.numpy().copy(), neutral_mask=mask)
    queries = [text_query(reply, k, CPU) for k in range(2)]
    for query, found in zip(queries, cache.scores_of_all(queries, store, 1), strict=True):
        expected = scores(store.features(slots), query)
        np.testing.assert_allclose(found.scores, expected, atol=5e-4)


def test_a_floor_is_fitted_to_the_map_and_again_when_it_has_grown() -> None:
    """One in twenty of the control words reaches it; what they are is slow but obvious here."""
    rng = np.random.default_rng(3)
    store, cache = CellStore(8, device=CPU, dtype=torch.float32), ScoreCache()
    reply = replace(embeddings(rng, 30), controls=20)
    query = text_query(reply, 0, CPU)

    def expected() -> float:
        cosines = unit_cosines(store.features(np.arange(store.count)), torch.tensor(reply.neutral))
        shares = torch.softmax(reply.temperature * cosines, dim=1)[:, 10:].numpy()
        return float(np.quantile(np.sort(shares, axis=0)[-3:].mean(axis=0), 0.95))

    def fuse(features: F32, revision: int) -> float:
        slots, sure = (
            store.new_slots(np.zeros((len(features), 2), np.int64)),
            np.ones(len(features), np.float32),
        )
        store.fuse(slots, torch.from_numpy(features), sure, revision=revision)
        return cache.floor(query, store, revision)

    first = fuse(unit(rng, 100, 8), 1)
    assert first == pytest.approx(expected(), abs=1e-4)
    assert fuse(reply.neutral[10:], 2) == first != pytest.approx(expected(), abs=1e-3)
    assert fuse(unit(rng, 10, 8), 3) == pytest.approx(expected(), abs=1e-4)
    assert fuse(reply.neutral[10:], 103) == pytest.approx(expected(), abs=1e-4)
    assert cache.floor(text_query(replace(reply, floor=0.25), 0, CPU), store, 103) == 0.25


def cell_scores(features: np.ndarray, concepts: np.ndarray, temperature: float) -> CellScores:
    query = TextQuery("a text", torch.from_numpy(concepts), temperature)
    cosine = unit_cosines(torch.from_numpy(features), query.concepts)
    return CellScores(query, 1, scores_of(cosine, query).numpy(), cosine[:, 0].numpy())


@given(seed=st.integers(0, 2**16), temperature=st.floats(1, 60))
@settings(max_examples=40, deadline=None)
def test_negatives_compete_as_neutral_words_do(seed: int, temperature: float) -> None:
    rng = np.random.default_rng(seed)
    features, text, neutral, negatives = (unit(rng, n, 8) for n in (6, 1, 3, 2))
    own = cell_scores(features, np.concatenate([text, neutral]), temperature)
    others = [cell_scores(features, np.stack([n, text[0]]), temperature) for n in negatives]
    together = cell_scores(features, np.concatenate([text, neutral, negatives]), temperature)
    np.testing.assert_allclose(against(own, others).scores, together.scores, atol=1e-5)


@given(
    seed=st.integers(0, 2**16),
    count=st.one_of(st.integers(1, 600), st.sampled_from([4095, 4096, 8191, 8192, 20_000])),
    digits=st.integers(1, 7),
)
@settings(max_examples=30, deadline=None)
def test_limits_give_the_ranks(seed: int, count: int, digits: int) -> None:
    """Few digits make many values equal."""
    values = np.random.default_rng(seed).uniform(-1, 1, count).round(digits).astype(np.float32)
    limits = rank_limits(values)
    assert limits.shape == (RANKS - 1,)
    assert (np.diff(limits[np.isfinite(limits)]) >= 0).all()
    np.testing.assert_array_equal(ranked(values, limits), ranks(values))
