"""The vocabulary that ships, and the table of embeddings."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain
from pathlib import Path

import numpy as np
import pytest

from onemap_perception.config import SHIPPED
from onemap_perception.errors import UnknownWordError
from onemap_perception.text.embeddings import EmbedTexts
from onemap_perception.text.vocabulary import (
    EmbeddingTable,
    load_calibration,
    load_table,
    load_vocabulary,
)
from onemap_shared.geometry import F32

VOCABULARY = load_vocabulary(SHIPPED)


def test_no_word_means_two_things_and_no_held_out_word_was_trained() -> None:
    trained = list(chain(*(entry.aliases for entry in VOCABULARY.classes)))
    held_out = list(chain(*(entry.held_out for entry in VOCABULARY.classes)))
    assert len(set(trained)) == len(trained)
    assert not set(trained) & set(held_out)
    assert not (set(trained) | set(held_out)) & set(VOCABULARY.neutral)


@pytest.mark.parametrize("content", ["{", "[]", '{"classes": [{"name": "sofa"}]}'])
def test_a_damaged_vocabulary_is_refused(tmp_path: Path, content: str) -> None:
    with pytest.raises(ValueError, match="cannot read"):
        load_vocabulary(tmp_path)
    (tmp_path / "vocabulary.json").write_text(content)
    with pytest.raises(ValueError, match="is not a vocabulary"):
        load_vocabulary(tmp_path)


@pytest.mark.parametrize("content", ["{", "[]", '{"temperature": 3}', '{"temperature": "warm"}'])
def test_a_damaged_calibration_is_refused(tmp_path: Path, content: str) -> None:
    (tmp_path / "calibration.json").write_text(content)
    with pytest.raises(ValueError, match="cannot read the calibration"):
        load_calibration(tmp_path)


WORDS = ("dish", "glass", "sofa", "teddy bear")
ROWS = np.eye(4, dtype=np.float32)


def table(fallback: EmbedTexts | None = None) -> EmbeddingTable:
    return EmbeddingTable(WORDS, ROWS, fallback=fallback)


def test_unknown_words_are_all_named_with_the_remedy() -> None:
    with pytest.raises(UnknownWordError, match=r"'диван' is not among the 4 words.*pip install"):
        table().embed(["sofa", "диван"])
    with pytest.raises(UnknownWordError, match=r"'sofaa', 'x' and 'y' are not among") as caught:
        table().embed(["sofaa", "x", "y"])
    assert caught.value.words == {"sofaa": (), "x": (), "y": ()}


def test_only_words_outside_the_table_go_to_the_fallback() -> None:
    asked: list[str] = []

    def embed(texts: Sequence[str]) -> F32:
        asked.extend(texts)
        return ROWS[:1]

    np.testing.assert_array_equal(table(embed).embed(["the Spoon", "sofas"]), ROWS[[0, 2]])
    assert asked == ["spoon"]


def write(folder: Path, words: Sequence[str], rows: np.ndarray) -> None:
    np.savez(folder / "words.npz", words=np.array(words), embeddings=rows)


def test_damaged_tables_are_refused_with_their_path(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"cannot read the word table .*words\.npz"):
        load_table(tmp_path)
    (tmp_path / "words.npz").write_bytes(b"not a zip file")
    with pytest.raises(ValueError, match="cannot read the word table"):
        load_table(tmp_path)
    write(tmp_path, WORDS[:3], ROWS)
    with pytest.raises(ValueError, match="damaged"):
        load_table(tmp_path)
    write(tmp_path, WORDS, np.full((4, 4), np.nan))
    with pytest.raises(ValueError, match="damaged"):
        load_table(tmp_path)
    np.savez(tmp_path / "words.npz", words=np.array([{}], dtype=object), embeddings=ROWS)
    with pytest.raises(ValueError, match="cannot read the word table"):
        load_table(tmp_path)
