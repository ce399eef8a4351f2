"""Embeddings of images, requested over the bus and cached."""
# Talks: a cache that the bus's threads share.

from __future__ import annotations

import hashlib
import threading
from collections.abc import Callable
from dataclasses import replace

import torch
from cachetools import LRUCache

from onemap_mapper.similarity import text_query
from onemap_mapper.text_cache import Entry
from onemap_shared.messages import TextEmbeddings

MAX_IMAGES = 32  # a few KB each, as their scores are kept of so many texts


class ImageCache:
    """The most recently used queries by image. Thread-safe."""

    def __init__(self, embed: Callable[[bytes], TextEmbeddings], device: torch.device) -> None:
        self._embed = embed
        self._device = device
        self._lock = threading.Lock()
        self._entries: LRUCache[str, Entry] = LRUCache(MAX_IMAGES)

    def query(self, image: bytes) -> Entry:
        """The text space and the query of an image; embeds it without holding the lock."""
        name = f"image {hashlib.sha256(image).hexdigest()}"
        with self._lock:
            entry = self._entries.get(name)
            entries = self._entries  # those of the present encoder
        if entry is None:
            made = self._embed(image)
            query = replace(text_query(made, 0, self._device), text=name)  # scores are kept by it
            entry = (made.text_space, query)
            with self._lock:
                entries[name] = entry
        return entry

    def clear(self) -> None:
        """Drop all entries: the encoder changed."""
        with self._lock:
            self._entries = LRUCache(MAX_IMAGES)
