"""The cache of text embeddings."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from onemap_perception.text.embeddings import CachedTextEncoder
from onemap_shared.geometry import F32


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
