"""Words that are spelt alike.

``difflib`` compares letter by letter in Python. An upper bound of its ratio, the letters that
two words have in common, is computed for all words at once and leaves few of them to compare.
"""

from __future__ import annotations

import difflib
from collections.abc import Sequence

import numpy as np

from onemap_shared.geometry import F32

BUCKETS = 64  # letters that share one make the bound larger, never too small


class SpellingIndex:
    """Words to be suggested for others; immutable."""

    def __init__(self, words: Sequence[str]) -> None:
        self._words = tuple(words)
        self._letters = np.array([letters(word) for word in words]).reshape(-1, BUCKETS)
        self._lengths = self._letters.sum(axis=1)

    def close_matches(self, word: str, count: int, share: float) -> list[str]:
        """As ``difflib.get_close_matches`` of these words: the most similar first."""
        common = np.minimum(self._letters, letters(word)).sum(axis=1)
        total = self._lengths + len(word)
        bound = np.where(total > 0, 2.0 * common / np.maximum(total, 1), 1.0)
        likely = [self._words[index] for index in np.flatnonzero(bound >= share - 1e-6)]
        return difflib.get_close_matches(word, likely, count, share)


def letters(word: str) -> F32:
    """How often each letter occurs: (BUCKETS,) float32."""
    places = np.array([ord(letter) % BUCKETS for letter in word], np.intp)
    counts: F32 = np.bincount(places, minlength=BUCKETS).astype(np.float32)
    return counts
