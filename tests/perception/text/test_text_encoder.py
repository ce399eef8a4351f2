"""The cache of text embeddings."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from onemap_perception.text.text_encoder import CachedTextEncoder
from onemap_shared.geometry import F32


def test_the_least_recently_used_text_is_evicted() -> None:
    asked: list[str] = []

    def embed(prompts: Sequence[str]) -> F32:
        asked.extend(prompts)
        return np.array([[len(p), 1.0] for p in prompts], np.float32)

    texts = CachedTextEncoder(embed, prompt="see {}", capacity=2)
    texts(["a", "b"])
    texts(["a"])
    texts(["c"])  # b is the oldest now
    asked.clear()
    texts(["a", "c"])
    assert asked == []
    texts(["b"])
    assert asked == ["see b"]


def test_threads_that_ask_for_the_same_text_embed_it_once() -> None:
    asked: list[str] = []
    together = threading.Barrier(4)

    def embed(prompts: Sequence[str]) -> F32:
        asked.extend(prompts)
        return np.ones((len(prompts), 3), np.float32)

    texts = CachedTextEncoder(embed, prompt="{}", capacity=8)

    def ask(_: int) -> F32:
        together.wait(60)
        return texts(["sofa"])

    with ThreadPoolExecutor(4) as pool:
        rows = list(pool.map(ask, range(4)))
    assert asked == ["sofa"]
    assert all(row.shape == (1, 3) for row in rows)
