"""Embeddings of texts, asked for once on the bus and remembered."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable

import torch

from onemap_mapper.similarity import TextQuery, text_query
from onemap_shared.messages import TextEmbeddings

MAX_TEXTS = 256  # texts; a few KB each


class TextCache:
    """Queries by text, least recently used out first. Safe between threads."""

    def __init__(self, ask: Callable[[str], TextEmbeddings], device: torch.device) -> None:
        self._ask = ask
        self._device = device
        self._lock = threading.Lock()
        self._known: OrderedDict[str, tuple[str, TextQuery]] = OrderedDict()

    def query(self, text: str) -> tuple[str, TextQuery]:
        """The text space and the query of a text; asks without holding the lock."""
        with self._lock:
            if text in self._known:
                self._known.move_to_end(text)
                return self._known[text]
        reply = self._ask(text)
        entry = (reply.text_space, text_query(reply, 0, self._device))
        with self._lock:
            self._known[text] = entry
            if len(self._known) > MAX_TEXTS:
                self._known.popitem(last=False)
        return entry

    def clear(self) -> None:
        """Forget everything: the encoder changed."""
        with self._lock:
            self._known.clear()
