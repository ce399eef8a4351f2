"""Text towers behind a prompt and a cache."""
# Talks: a cache that threads share.

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence

import numpy as np
from cachetools import LRUCache

from onemap_shared.geometry import F32

EmbedTexts = Callable[[Sequence[str]], F32]  # N texts to rows (N, D) float32


class CachedTextEncoder:
    """Embeds texts, filled into ``prompt`` (``{}`` in it), and keeps the newest rows.

    capacity: number of texts whose rows are kept. Thread-safe: the loop asks for the objects of
    a search while the bus serves others. Runs of the tower follow one another.
    """

    def __init__(self, embed: EmbedTexts, *, prompt: str, capacity: int) -> None:
        self._embed = embed
        self._prompt = prompt
        self._rows: LRUCache[str, F32] = LRUCache(capacity)
        self._lock = threading.Lock()

    def __call__(self, texts: Sequence[str]) -> F32:
        """Unit rows (N, D) float32 of N >= 1 texts; the new ones in one run of the tower."""
        with self._lock:
            rows = {text: self._rows[text] for text in texts if text in self._rows}
            new = [text for text in dict.fromkeys(texts) if text not in rows]
            if new:
                embedded = self._embed([self._prompt.format(text) for text in new])
                rows.update(zip(new, unit_rows(embedded), strict=True))
            self._rows.update({text: rows[text] for text in texts})
        return np.stack([rows[text] for text in texts])


def unit_rows(rows: F32) -> F32:
    """Rows (N, D) scaled to length one."""
    unit: F32 = (rows / np.linalg.norm(rows, axis=1, keepdims=True)).astype(np.float32)
    return unit
