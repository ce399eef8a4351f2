"""Text towers behind a prompt and a cache."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from cachetools import LRUCache

from onemap_perception.errors import UnknownWordError
from onemap_shared.geometry import F32

EmbedTexts = Callable[[Sequence[str]], F32]  # N texts to rows (N, D) float32


class CachedTextEncoder:
    """Embeds texts, filled into ``prompt`` (``{}`` in it), and keeps the newest rows.

    capacity: number of texts whose rows are kept. Not thread-safe: the bus serves one request
    after the other.
    """

    def __init__(self, embed: EmbedTexts, *, prompt: str, capacity: int) -> None:
        self._embed = embed
        self._prompt = prompt
        self._rows: LRUCache[str, F32] = LRUCache(capacity)

    def __call__(self, texts: Sequence[str]) -> F32:
        """Unit rows (N, D) float32 of N >= 1 texts; the new ones in one run of the tower."""
        words = [" ".join(text.split()) for text in texts]
        if not words or not all(words):
            raise UnknownWordError("an empty text has no embedding: name an object")
        rows = {word: self._rows[word] for word in words if word in self._rows}
        new = [word for word in dict.fromkeys(words) if word not in rows]
        if new:
            embedded = self._embed([self._prompt.format(word) for word in new])
            rows.update(zip(new, unit_rows(embedded), strict=True))
        self._rows.update({word: rows[word] for word in words})
        return np.stack([rows[word] for word in words])


def unit_rows(rows: F32) -> F32:
    """Rows (N, D) scaled to length one."""
    unit: F32 = (rows / np.linalg.norm(rows, axis=1, keepdims=True)).astype(np.float32)
    return unit
