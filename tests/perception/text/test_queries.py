"""Queries of texts: competing words, expansion, aliases, suggestions; scores and the cache."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from onemap_perception.errors import UnknownWordError
from onemap_perception.text.embeddings import scores
from onemap_perception.text.queries import QueryEncoder, unit
from onemap_perception.text.vocabulary import Calibration, EmbeddingTable, ObjectClass, Vocabulary
from onemap_shared.geometry import F32
from onemap_shared.messages import TextEmbeddings

CALIBRATION = Calibration(
    temperature=12.0, expansion=1.0, sharpness=20.0, synonym=0.7, floor=0.2, placed=0.3
)
VOCABULARY = Vocabulary(
    prompt="a {}",
    classes=(
        ObjectClass("sofa", ("sofa", "couch"), ("settee",)),
        ObjectClass("lamp", ("lamp", "light"), ("lantern",), query_aliases=("glowworm", "harp")),
    ),
    neutral=("car",),
    common=("piano",),
)
VECTORS = {
    "sofa": (1.0, 0.2, 0.0, 0.0),
    "couch": (1.0, -0.2, 0.0, 0.0),
    "settee": (0.9, 0.0, 0.0, 0.4),
    "lamp": (0.0, 1.0, 0.1, 0.0),
    "light": (0.0, 1.0, -0.1, 0.0),
    "lantern": (0.1, 0.5, 0.3, 0.4),
    "car": (0.0, 0.0, 1.0, 0.0),
    "piano": (0.2, 0.1, 0.1, 1.0),
    "harp": (0.9, 0.1, 0.0, 0.0),
    "kite": (0.1, 0.0, 0.2, 1.0),
    "umbrella": (0.4, 0.0, 0.1, 1.0),
}


def encoder(*, raw: bool = False) -> QueryEncoder:
    rows = np.stack([unit(np.array(v, np.float32)) for v in VECTORS.values()])
    table = EmbeddingTable(tuple(VECTORS), rows)
    return QueryEncoder(VOCABULARY, table, CALIBRATION, raw=raw)


def ask(*words: str) -> TextEmbeddings:
    return encoder().queries(words, encoder_id="e", text_space="s")


def test_a_description_does_not_compete_with_the_classes_that_it_stands_for() -> None:
    words = {**VECTORS, "something to sit on": (0.6, 0.1, 0.6, 0.1)}
    rows = np.stack([unit(np.array(v, np.float32)) for v in words.values()])
    asked = QueryEncoder(VOCABULARY, EmbeddingTable(tuple(words), rows), CALIBRATION).queries(
        ["something to sit on", "The Couch", "harp", "umbrella", "Anything to sit on"],
        encoder_id="e",
        text_space="s",
    )
    described = ("sofa", "lamp")
    assert asked.stands_for == (described, ("sofa",), ("lamp",), ("sofa", "lamp"), described)
    np.testing.assert_array_equal(asked.embeddings[0], asked.embeddings[4])
    np.testing.assert_array_equal(asked.neutral_mask[0], [0, 0, 1])  # the car competes
    np.testing.assert_array_equal(asked.neutral_mask[3], [1, 1, 1])  # with a name all do
    assert asked.only(np.array([1])).stands_for == (("sofa",),)


def test_trained_words_stand_for_their_class() -> None:
    queries = ask("sofa", "The Couch", "lamp")
    np.testing.assert_allclose(queries.embeddings[0], queries.embeddings[1])
    np.testing.assert_allclose(queries.embeddings[0], [1, 0, 0, 0], atol=1e-6)
    assert queries.neutral_mask.tolist() == [[0, 1, 1], [0, 1, 1], [1, 0, 1]]
    assert queries.temperature == 12.0
    assert (queries.encoder_id, queries.text_space) == ("e", "s")


def test_other_words_lean_to_the_nearest_class_and_synonyms_do_not_compete() -> None:
    queries = ask("settee", "lantern", "umbrella")
    sofa = np.array([1, 0, 0, 0], np.float32)
    assert queries.embeddings[0] @ sofa > unit(np.array(VECTORS["settee"], np.float32)) @ sofa
    np.testing.assert_allclose(np.linalg.norm(queries.embeddings, axis=1), 1, rtol=1e-5)
    assert queries.neutral_mask[0].tolist() == [0, 1, 1]
    assert queries.neutral_mask[2].tolist() == [1, 1, 1]


def test_words_that_are_like_no_class_are_refused_without_words_that_are_not_near() -> None:
    with pytest.raises(UnknownWordError, match="'kite' and 'piano' are like nothing") as caught:
        ask("sofa", "kite", "settee", "piano")
    assert caught.value.words == {"kite": (), "piano": ()}
    assert encoder(raw=True).queries(["kite"], encoder_id="e", text_space="s").floor == 0.2


def test_unknown_words_are_all_named_with_what_is_spelt_alike() -> None:
    with pytest.raises(
        UnknownWordError, match=r"'couhc' .did you mean 'couch'.* and 'x'"
    ) as caught:
        ask("sofa", "couhc", "x")
    assert caught.value.words == {"couhc": ("couch",), "x": ()}
    with pytest.raises(UnknownWordError) as caught:
        ask("glowwurm", "kitte")  # an alias is offered, a word without a place is not
    assert caught.value.words == {"glowwurm": ("glowworm",), "kitte": ()}


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
