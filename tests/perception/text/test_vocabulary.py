"""The vocabulary that ships: what training and evaluation rely on."""

from __future__ import annotations

from itertools import chain
from pathlib import Path

import pytest

from onemap_perception.config import SHIPPED
from onemap_perception.text.vocabulary import load_calibration, load_vocabulary
from onemap_shared.names import normalised

VOCABULARY = load_vocabulary(SHIPPED)


def test_every_class_has_four_aliases_and_a_held_out_one() -> None:
    assert len(VOCABULARY.classes) >= 45
    for entry in VOCABULARY.classes:
        assert entry.aliases[0] == entry.name
        assert len(entry.aliases) >= 4
        assert 1 <= len(entry.held_out) <= 2


def test_no_word_means_two_things_and_no_held_out_word_was_trained() -> None:
    trained = list(chain(*(entry.aliases for entry in VOCABULARY.classes)))
    held_out = list(chain(*(entry.held_out for entry in VOCABULARY.classes)))
    assert len(set(trained)) == len(trained)
    assert not set(trained) & set(held_out)
    assert not (set(trained) | set(held_out)) & set(VOCABULARY.neutral)


def test_words_are_as_queries_are_looked_up() -> None:
    assert all(word == normalised(word) for word in VOCABULARY.words)
    assert len(VOCABULARY.words) > 600


def test_classes_are_found_by_trained_words_only() -> None:
    names = VOCABULARY.names
    assert VOCABULARY.class_of("couch") == names.index("sofa")
    assert VOCABULARY.class_of("telly") is None


@pytest.mark.parametrize("content", ["{", "[]", '{"classes": [{"name": "sofa"}]}'])
def test_a_damaged_vocabulary_is_refused(tmp_path: Path, content: str) -> None:
    with pytest.raises(ValueError, match="cannot read"):
        load_vocabulary(tmp_path)
    (tmp_path / "vocabulary.json").write_text(content)
    with pytest.raises(ValueError, match="is not a vocabulary"):
        load_vocabulary(tmp_path)


def test_a_calibration_without_a_floor_has_not_measured_one(tmp_path: Path) -> None:
    (tmp_path / "calibration.json").write_text(
        '{"temperature": 3, "expansion": 1, "sharpness": 20, "synonym": 0.7}'
    )
    loaded = load_calibration(tmp_path)
    assert (loaded.floor, loaded.placed) == (0.0, 0.0)


@pytest.mark.parametrize("content", ["{", "[]", '{"temperature": 3}', '{"temperature": "warm"}'])
def test_a_damaged_calibration_is_refused(tmp_path: Path, content: str) -> None:
    (tmp_path / "calibration.json").write_text(content)
    with pytest.raises(ValueError, match="cannot read the calibration"):
        load_calibration(tmp_path)
