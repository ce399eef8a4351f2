"""Texts are embedded once; a slow one does not block the others."""

from __future__ import annotations

import os
import threading
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
import torch

from onemap_mapper.query.texts import BATCHES_AT_ONCE, TextCache
from onemap_shared.clock import SystemClock
from onemap_shared.messages import TextEmbeddings
from onemap_shared.transport import RequestRejected

CPU = torch.device("cpu")


class Embedder:
    """Embeds every text as one vector and records what it was asked, in which batches."""

    def __init__(self) -> None:
        self.asked: list[str] = []
        self.batches: list[tuple[str, ...]] = []
        self.failing = False
        self.unknown = ""

    def __call__(self, texts: tuple[str, ...]) -> TextEmbeddings:
        self.asked.extend(texts)
        self.batches.append(texts)
        if self.failing:
            raise LookupError(texts)
        if self.unknown in texts:
            raise RequestRejected("unknown_word", f"{self.unknown} is unknown")
        ones, none = np.ones((len(texts), 4), np.float32), np.zeros((0, 4), np.float32)
        mask = np.zeros((len(texts), 0), np.uint8)
        return TextEmbeddings("e", "space", texts, ones, none, mask, 1.0)


def test_a_slow_text_does_not_block_the_others() -> None:
    begun, release = threading.Event(), threading.Event()
    embedder = Embedder()

    def embed(texts: tuple[str, ...]) -> TextEmbeddings:
        if "slow" in texts:
            begun.set()
            assert release.wait(60)
        return embedder(texts)

    cache = TextCache(embed, CPU, SystemClock())
    with ThreadPoolExecutor() as pool:
        slow = pool.submit(cache.query, "slow")
        assert begun.wait(60)
        assert cache.query("cup")[1].text == "cup"
        release.set()
        assert slow.result(10)[1].text == "slow"


class HeldBack:
    """Embeds when it is released; ``busy`` counts the batches that have arrived."""

    def __init__(self) -> None:
        self.embedder = Embedder()
        self.busy = threading.Semaphore(0)
        self.release = threading.Event()

    def __call__(self, texts: tuple[str, ...]) -> TextEmbeddings:
        self.busy.release()
        assert self.release.wait(60)
        return self.embedder(texts)

    def fill(self, cache: TextCache, pool: ThreadPoolExecutor) -> None:
        """Keep every thread of the cache busy."""
        for number in range(BATCHES_AT_ONCE):
            pool.submit(cache.query, f"first {number}")
            assert self.busy.acquire(timeout=60)


def until_waiting(cache: TextCache, count: int) -> None:
    while len(cache._waiting) < count:
        os.sched_yield()


def test_an_unknown_word_fails_alone() -> None:
    embed = HeldBack()
    embed.embedder.unknown = "qzxw"
    cache = TextCache(embed, CPU, SystemClock())
    with ThreadPoolExecutor(16) as pool:
        embed.fill(cache, pool)
        asked = {text: pool.submit(cache.query, text) for text in ("cup", "qzxw", "bed")}
        until_waiting(cache, 3)
        embed.release.set()
        assert asked["cup"].result(20)[1].text == "cup"
        assert asked["bed"].result(20)[1].text == "bed"
        with pytest.raises(RequestRejected, match="qzxw is unknown"):
            asked["qzxw"].result(20)
