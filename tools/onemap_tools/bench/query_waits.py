"""How long frames wait for queries, over a large map: as the mapper asks, and with a held lock."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
import torch

from onemap_mapper.belief.cells import FeatureShare
from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.occupancy.heights import LEVELS
from onemap_mapper.params import MapParams
from onemap_mapper.query.replies import similarity_reply
from onemap_mapper.query.scores import MapScores, ScoredVersion
from onemap_mapper.query.similarity import TextQuery
from onemap_shared.messages import SimilarityRequest

FRAMES_HZ = 8.0
Dtype = Literal["float32", "float16"]


@dataclass(frozen=True, slots=True)
class WaitOptions:
    """How many frames are fused, each into so many cells, in each of the two ways."""

    frames: int = 40
    frame_cells: int = 800
    seed: int = 0


def frame_waits(belief: BeliefMap, texts: list[TextQuery], options: WaitOptions) -> dict[str, Any]:
    """Waits of frames while new texts are asked without a pause, in ms of the clock.

    query_holds_ms: the longest that a query held the lock, in ms of its thread's processor time.
    """
    lock = TimedLock()
    scores = MapScores(belief, lock)

    def reply(scored: ScoredVersion, query: TextQuery) -> None:
        similarity_reply(scored, request=SimilarityRequest(query.text))

    def ask(query: TextQuery) -> None:
        with lock.timed():
            scored = scores.of([query])
        reply(scored, query)

    alone = MapScores(belief)  # with a lock of its own: the mapper's is held by the asker

    def ask_with_the_lock(query: TextQuery) -> None:
        with lock.timed(), lock:
            reply(alone.of([query]), query)

    return {
        name: _measured(belief, lock, asking, texts, options)
        for name, asking in (("frame_waits", ask), ("with_a_held_lock", ask_with_the_lock))
    }


def map_of(cells: int, dimension: int, params: MapParams, seed: int) -> BeliefMap:
    """A square map of random features, one per cell."""
    side = math.isqrt(cells - 1) + 1
    where = np.argwhere(np.ones((side, side), bool))[:cells]
    belief = BeliefMap(params)
    belief.grow(where)
    belief.set_encoder("random", "random", dimension)
    rng = np.random.default_rng(seed)
    for first in range(0, cells, 4096):
        belief.put_in(_share(rng, where[first : first + 4096], dimension))
    return belief


class TimedLock:
    """A lock that measures how long one thread's processor time has it held."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._asker, self._taken_s = 0, 0.0
        self.longest_s = 0.0

    @contextmanager
    def timed(self) -> Iterator[None]:
        """Measure this thread meanwhile."""
        self._asker = threading.get_ident()
        yield
        self._asker = 0

    def __enter__(self) -> None:
        self._lock.acquire()
        if threading.get_ident() == self._asker:
            self._taken_s = time.thread_time()

    def __exit__(self, *_problem: object) -> None:
        if threading.get_ident() == self._asker:
            self.longest_s = max(self.longest_s, time.thread_time() - self._taken_s)
        self._lock.release()


def _measured(
    belief: BeliefMap,
    lock: TimedLock,
    ask: Callable[[TextQuery], None],
    texts: list[TextQuery],
    options: WaitOptions,
) -> dict[str, Any]:
    ask(texts[0])  # what the competing words weigh is computed once
    lock.longest_s, stop, asked = 0.0, threading.Event(), 0

    def keep_asking() -> None:
        nonlocal asked
        while not stop.is_set():
            asked += 1
            ask(replace(texts[asked % len(texts)]))  # as a new text

    asker = threading.Thread(target=keep_asking)
    asker.start()
    waits_ms = _fuse_frames(belief, lock, options)
    stop.set()
    asker.join()
    p50, p95, most = np.quantile(waits_ms, (0.5, 0.95, 1.0))
    return {
        "p50_ms": round(float(p50), 2),
        "p95_ms": round(float(p95), 2),
        "max_ms": round(float(most), 2),
        "query_holds_ms": round(lock.longest_s * 1e3, 2),
        "queries": asked,
    }


def _fuse_frames(belief: BeliefMap, lock: TimedLock, options: WaitOptions) -> list[float]:
    """Fuse frames at their rate; how long each waited for the lock, in ms."""
    rng, waits_ms, due = np.random.default_rng(options.seed), [], threading.Event()
    for _ in range(options.frames):
        chosen = rng.integers(0, belief.store.count - options.frame_cells)
        cells = belief.store.cells[chosen : chosen + options.frame_cells].copy()
        share = _share(rng, cells, belief.dimension)
        due.wait(1 / FRAMES_HZ)
        began_s = time.perf_counter()
        with lock:
            waits_ms.append((time.perf_counter() - began_s) * 1e3)
            belief.put_in(share)
    return waits_ms


def _share(rng: np.random.Generator, cells: np.ndarray, dimension: int) -> FeatureShare:
    features = torch.from_numpy(rng.standard_normal((len(cells), dimension), np.float32))
    ones = torch.ones(len(cells), dtype=torch.float64)
    unit = torch.nn.functional.normalize(features, dim=1)
    heights = np.zeros((len(cells), LEVELS), np.float32)
    return FeatureShare(cells, unit, ones, ones, ones, heights)
