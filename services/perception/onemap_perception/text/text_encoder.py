"""Texts to unit rows through a text tower: one prompt, asked once each."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Sequence

import numpy as np

from onemap_perception.encoders.protocol import UnknownWordError
from onemap_shared.geometry import F32

Embed = Callable[[Sequence[str]], F32]


class CachedTextEncoder:
    """Wraps a text tower: fills texts into ``prompt`` (``{}`` in it) and keeps the newest rows.

    Not for several threads at once: the bus serves one question after the other.
    """

    def __init__(self, embed: Embed, *, prompt: str, capacity: int) -> None:
        self._embed = embed
        self._prompt = prompt
        self._kept = capacity
        self._rows: OrderedDict[str, F32] = OrderedDict()

    def __call__(self, texts: Sequence[str]) -> F32:
        """Unit rows (N, D) float32 of N >= 1 texts; one run of the tower for all new ones."""
        words = [" ".join(text.split()) for text in texts]
        if not words or not all(words):
            raise UnknownWordError("an empty text has no embedding: name an object")
        new = [word for word in dict.fromkeys(words) if word not in self._rows]
        known = {word: self._rows[word] for word in words if word in self._rows}
        if new:
            rows = self._embed([self._prompt.format(word) for word in new])
            known.update(zip(new, unit_rows(rows), strict=True))
        for word in words:
            self._remember(word, known[word])
        return np.stack([known[word] for word in words])

    def _remember(self, word: str, row: F32) -> None:
        self._rows[word] = row
        self._rows.move_to_end(word)
        if len(self._rows) > self._kept:
            self._rows.popitem(last=False)


def unit_rows(rows: F32) -> F32:
    """Rows (N, D) at length one."""
    unit: F32 = (rows / np.linalg.norm(rows, axis=1, keepdims=True)).astype(np.float32)
    return unit
