"""Embeddings of texts, requested over the bus in batches and cached."""
# Talks: a cache that the bus's threads share.

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor

import torch
from cachetools import LRUCache

from onemap_mapper.similarity import TextQuery, text_query
from onemap_shared.messages import TextEmbeddings
from onemap_shared.transport import RequestRejected

MAX_TEXTS = 256  # a few KB each
MAX_BATCH = 64
BATCHES_AT_ONCE = 2  # so that a slow one does not block the others

Entry = tuple[str, TextQuery]  # the text space and the query
Waiting = Mapping[str, "Future[Entry]"]


class TextCache:
    """The most recently used queries by text. Thread-safe.

    Texts that are asked for while others are being embedded wait and travel together.
    """

    def __init__(
        self, embed: Callable[[tuple[str, ...]], TextEmbeddings], device: torch.device
    ) -> None:
        self._embed = embed
        self._device = device
        self._lock = threading.Lock()
        self._entries: LRUCache[str, Entry] = LRUCache(MAX_TEXTS)
        self._asked: dict[str, Future[Entry]] = {}  # by text, until there is an answer
        self._waiting: dict[str, Future[Entry]] = {}  # those of them that no batch has taken
        self._clearings = 0
        self._pool = ThreadPoolExecutor(BATCHES_AT_ONCE, "texts")

    def query(self, text: str) -> Entry:
        """The text space and the query of a text; embeds it without holding the lock."""
        with self._lock:
            entry = self._entries.get(text)
            if entry is not None:
                return entry
            future = self._asked.get(text)
            if future is None:
                future = self._asked[text] = self._waiting[text] = Future()
                self._pool.submit(self._run)
        return future.result()

    def clear(self) -> None:
        """Drop all entries: the encoder changed."""
        with self._lock:
            self._entries.clear()
            self._clearings += 1

    def _run(self) -> None:
        """Embed the texts that wait; a batch before may have taken them already."""
        with self._lock:
            texts = list(self._waiting)[:MAX_BATCH]
            batch = {text: self._waiting.pop(text) for text in texts}
        if batch:
            self._answer(batch)

    def _answer(self, batch: Waiting) -> None:
        clearings = self._clearings
        try:
            reply = self._embed(tuple(batch))
            entries = {
                text: (reply.text_space, text_query(reply, index, self._device))
                for index, text in enumerate(batch)
            }
        except Exception as problem:  # every asker gets it, none waits for ever
            if len(batch) > 1 and _blames_a_text(problem):
                for text, future in batch.items():
                    self._answer({text: future})
            else:
                self._forget(batch)
                for future in batch.values():
                    future.set_exception(problem)
            return
        with self._lock:
            if clearings == self._clearings:
                self._entries.update(entries)
        self._forget(batch)
        for text, future in batch.items():
            future.set_result(entries[text])

    def _forget(self, batch: Waiting) -> None:
        with self._lock:
            for text in batch:
                del self._asked[text]


def _blames_a_text(problem: Exception) -> bool:
    """Whether the batch failed because of single texts in it."""
    return isinstance(problem, RequestRejected) and problem.code == "unknown_word"
