"""The index of spellings finds what difflib finds among all words."""

from __future__ import annotations

import difflib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from onemap_perception.text.spelling import SpellingIndex

WORDS = ("refrigerator", "sofa", "sofa bed", "table", "stable", "lamp", "clamp", "vase", "")
INDEX = SpellingIndex(WORDS)


@given(st.text(max_size=15), st.sampled_from([0.5, 0.75, 0.85]))
def test_it_finds_what_difflib_finds(word: str, share: float) -> None:
    assert INDEX.close_matches(word, 3, share) == difflib.get_close_matches(word, WORDS, 3, share)


@pytest.mark.parametrize(("word", "first"), [("refridgerator", "refrigerator"), ("tabel", "table")])
def test_a_misspelt_word_is_found(word: str, first: str) -> None:
    assert INDEX.close_matches(word, 3, 0.75)[0] == first
