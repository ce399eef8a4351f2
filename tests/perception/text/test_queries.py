"""Queries and their scores: who competes, what expands, and what the softmax says."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from onemap_perception.encoders.protocol import UnknownWordError
from onemap_perception.text.embedding_table import EmbeddingTable
from onemap_perception.text.queries import (
    Calibration,
    QueryEncoder,
    load_calibration,
    save_calibration,
    scores,
    unit,
)
from onemap_perception.text.vocabulary import ObjectClass, Vocabulary, load_vocabulary
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
}


def text(*, aliases: bool = True) -> QueryEncoder:
    rows = np.stack([unit(np.array(v, np.float32)) for v in VECTORS.values()])
    table = EmbeddingTable(tuple(VECTORS), rows, prompt="a {}")
    return QueryEncoder(VOCABULARY, table, CALIBRATION, aliases=aliases)


def ask(*words: str) -> TextEmbeddings:
    return text().queries(words, encoder_id="e", text_space="s")


def test_trained_words_stand_for_their_class() -> None:
    queries = ask("sofa", "The Couch", "lamp")
    np.testing.assert_allclose(queries.embeddings[0], queries.embeddings[1])
    np.testing.assert_allclose(queries.embeddings[0], [1, 0, 0, 0], atol=1e-6)
    assert queries.neutral_mask.tolist() == [[0, 1, 1], [0, 1, 1], [1, 0, 1]]
    assert queries.temperature == 12.0
    assert (queries.encoder_id, queries.text_space) == ("e", "s")


def test_other_words_lean_to_the_nearest_class_and_synonyms_do_not_compete() -> None:
    queries = ask("settee", "lantern", "piano")
    sofa = np.array([1, 0, 0, 0], np.float32)
    assert queries.embeddings[0] @ sofa > unit(np.array(VECTORS["settee"], np.float32)) @ sofa
    np.testing.assert_allclose(np.linalg.norm(queries.embeddings, axis=1), 1, rtol=1e-5)
    assert queries.neutral_mask[0].tolist() == [0, 1, 1]
    assert queries.neutral_mask[2].tolist() == [1, 1, 1]


@pytest.mark.parametrize("word", ["glowworm", "a Harp"])
def test_a_name_that_is_known_to_fail_stands_for_its_class(word: str) -> None:
    np.testing.assert_array_equal(ask(word).embeddings, ask("lamp").embeddings)
    np.testing.assert_array_equal(ask(word).neutral_mask, ask("lamp").neutral_mask)


def test_evaluation_sends_such_a_name_through_the_embedding() -> None:
    harp = text(aliases=False).queries(["harp"], encoder_id="e", text_space="s").embeddings[0]
    sofa, lamp = ask("sofa", "lamp").embeddings
    assert harp @ sofa > harp @ lamp


def test_a_word_without_a_place_comes_with_the_nearest_known_ones() -> None:
    queries = ask("sofa", "kite", "settee", "piano")
    assert queries.nearest == ((), ("sofa", "lamp"), (), ("sofa", "lamp"))
    assert queries.floor == 0.2


def test_unknown_words_are_all_named_with_what_is_spelt_alike() -> None:
    with pytest.raises(
        UnknownWordError, match=r"'couhc' .did you mean 'couch'.* and 'x'"
    ) as caught:
        ask("sofa", "couhc", "x")
    assert caught.value.words == {"couhc": ("couch",), "x": ()}
    with pytest.raises(UnknownWordError) as caught:
        ask("glowwurm", "kitte")  # an alias is offered, a word without a place is not
    assert caught.value.words == {"glowwurm": ("glowworm",), "kitte": ()}


def test_a_thing_scores_as_itself_and_not_as_others() -> None:
    sofa = ask("sofa").embeddings
    for word, low, high in (("sofa", 0.99, 1), ("settee", 0.9, 1), ("lamp", 0, 0.01)):
        assert low <= scores(sofa, ask(word))[0, 0] <= high
    # No such thing here: an unrelated word stays low on everything that is known.
    everything = np.concatenate([sofa, ask("lamp").embeddings])
    assert scores(everything, ask("piano")).max() < 0.1


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
def test_scores_agree_with_the_slow_twin_and_are_shares(seed: int) -> None:
    rng = np.random.default_rng(seed)
    features = rng.normal(size=(5, 4)).astype(np.float32)
    features /= np.linalg.norm(features, axis=1, keepdims=True)
    queries = ask("sofa", "settee", "piano")
    fast = scores(features, queries)
    np.testing.assert_allclose(fast, slow_scores(features, queries), rtol=1e-3, atol=1e-6)
    assert ((fast >= 0) & (fast <= 1)).all()


def test_without_calibration_the_score_is_the_cosine() -> None:
    bare = TextEmbeddings(
        encoder_id="e",
        text_space="s",
        texts=("x",),
        embeddings=np.eye(4, dtype=np.float32)[:1],
        neutral=np.zeros((0, 4), np.float32),
        neutral_mask=np.zeros((1, 0), np.uint8),
        temperature=0.0,
    )
    features = np.array([[1, 0, 0, 0], [-1, 0, 0, 0], [0, 1, 0, 0]], np.float32)
    np.testing.assert_allclose(scores(features, bare)[:, 0], [1, 0, 0.5])


def test_a_calibration_without_a_floor_has_not_measured_one(tmp_path: Path) -> None:
    (tmp_path / "calibration.json").write_text(
        '{"temperature": 3, "expansion": 1, "sharpness": 20, "synonym": 0.7}'
    )
    loaded = load_calibration(tmp_path)
    assert (loaded.floor, loaded.placed) == (0.0, 0.0)


def test_calibration_goes_to_disk_and_back(tmp_path: Path) -> None:
    save_calibration(tmp_path, CALIBRATION)
    assert load_calibration(tmp_path) == CALIBRATION


@pytest.mark.parametrize("content", ["{", "[]", '{"temperature": 3}', '{"temperature": "warm"}'])
def test_a_damaged_calibration_is_refused(tmp_path: Path, content: str) -> None:
    (tmp_path / "calibration.json").write_text(content)
    with pytest.raises(ValueError, match="cannot read the calibration"):
        load_calibration(tmp_path)


@pytest.mark.parametrize("content", ["{", "[]", '{"classes": [{"name": "sofa"}]}'])
def test_a_damaged_vocabulary_is_refused(tmp_path: Path, content: str) -> None:
    with pytest.raises(ValueError, match="cannot read"):
        load_vocabulary(tmp_path)
    (tmp_path / "vocabulary.json").write_text(content)
    with pytest.raises(ValueError, match="is not a vocabulary"):
        load_vocabulary(tmp_path)
