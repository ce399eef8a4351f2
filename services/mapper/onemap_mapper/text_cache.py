"""Embeddings of texts, requested once over the bus and cached."""

from __future__ import annotations

import threading
from collections.abc import Callable

import torch
from cachetools import LRUCache

from onemap_mapper.similarity import TextQuery, text_query
from onemap_shared.messages import TextEmbeddings

MAX_TEXTS = 256  # a few KB each


class TextCache:
    """The most recently used queries by text. Thread-safe."""

    def __init__(self, embed: Callable[[str], TextEmbeddings], device: torch.device) -> None:
        self._embed = embed
        self._device = device
        self._lock = threading.Lock()
        self._entries: LRUCache[str, tuple[str, TextQuery]] = LRUCache(MAX_TEXTS)

    def query(self, text: str) -> tuple[str, TextQuery]:
        """The text space and the query of a text; embeds it without holding the lock."""
        with self._lock:
            entry = self._entries.get(text)
        if entry is None:
            reply = self._embed(text)
            entry = (reply.text_space, text_query(reply, 0, self._device))
            with self._lock:
                self._entries[text] = entry
        return entry

    def clear(self) -> None:
        """Drop all entries: the encoder changed."""
        with self._lock:
            self._entries.clear()
