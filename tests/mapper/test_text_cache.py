"""Texts are embedded once; a slow one does not block the others."""

from __future__ import annotations

import threading
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
import torch

from onemap_mapper import text_cache
from onemap_mapper.text_cache import TextCache
from onemap_shared.messages import TextEmbeddings

CPU = torch.device("cpu")


class Embedder:
    """Embeds every text as one vector and records what it was asked."""

    def __init__(self) -> None:
        self.asked: list[str] = []
        self.failing = False

    def __call__(self, text: str) -> TextEmbeddings:
        self.asked.append(text)
        if self.failing:
            raise LookupError(text)
        ones, none = np.ones((1, 4), np.float32), np.zeros((0, 4), np.float32)
        return TextEmbeddings("e", "space", (text,), ones, none, np.zeros((1, 0), np.uint8), 1.0)


def test_a_text_is_embedded_once() -> None:
    embedder = Embedder()
    cache = TextCache(embedder, CPU)
    space, query = cache.query("sofa")
    assert (space, query.text) == ("space", "sofa")
    assert cache.query("sofa")[1] is query
    assert embedder.asked == ["sofa"]


def test_after_a_change_of_encoder_texts_are_embedded_again() -> None:
    embedder = Embedder()
    cache = TextCache(embedder, CPU)
    cache.query("sofa")
    cache.clear()
    cache.query("sofa")
    assert embedder.asked == ["sofa", "sofa"]


def test_the_text_used_longest_ago_is_dropped(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(text_cache, "MAX_TEXTS", 2)
    embedder = Embedder()
    cache = TextCache(embedder, CPU)
    for text in ("sofa", "cup", "sofa", "lamp", "sofa", "cup"):
        cache.query(text)
    assert embedder.asked == ["sofa", "cup", "lamp", "cup"]


def test_a_failure_is_passed_on_and_not_cached() -> None:
    embedder = Embedder()
    cache = TextCache(embedder, CPU)
    embedder.failing = True
    with pytest.raises(LookupError):
        cache.query("sofa")
    embedder.failing = False
    assert cache.query("sofa")[1].text == "sofa"


def test_a_slow_text_does_not_block_the_others() -> None:
    release = threading.Event()
    embedder = Embedder()

    def embed(text: str) -> TextEmbeddings:
        if text == "slow":
            assert release.wait(10)
        return embedder(text)

    cache = TextCache(embed, CPU)
    with ThreadPoolExecutor() as pool:
        slow = pool.submit(cache.query, "slow")
        assert cache.query("cup")[1].text == "cup"
        release.set()
        assert slow.result(10)[1].text == "slow"
