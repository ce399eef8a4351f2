"""Time of a query over a large map, against reading its table and against a matrix product."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import torch
from torch import Tensor

from onemap_mapper.belief.cells import CellStore
from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.params import MapParams
from onemap_mapper.query.similarity import ScoreCache, TextQuery
from onemap_tools.bench.machine import Clock, best_s, clock_of, device_facts, machine_limits
from onemap_tools.bench.query_waits import Dtype, WaitOptions, frame_waits, map_of

CHANNELS = 768
NEUTRAL_WORDS = 103  # as many as mini's
TEXTS = 32  # asked at once
STANDING = 20  # texts that are asked again after every frame
FRAME_CELLS = 800  # that a frame changes
TEMPERATURE = 50.0


@dataclass(frozen=True, slots=True)
class QueryTimeOptions:
    """Cells of the map, how their features are stored, threads of torch, and the seed.

    wait_frames: that are fused while texts are asked; 0: none. device: of the features.
    """

    cells: int = 250_000
    feature_dtype: Dtype = "float32"
    threads: int = 1
    seed: int = 0
    wait_frames: int = 40
    device: str = "cpu"


def run(options: QueryTimeOptions) -> dict[str, Any]:
    """Milliseconds of processor time with one thread, of the clock with several.

    ``frame_waits`` says what it adds.
    """
    torch.set_num_threads(options.threads)
    device = torch.device(options.device)
    clock = clock_of(device, options.threads)
    generator = torch.Generator().manual_seed(options.seed)
    params = MapParams(feature_dtype=options.feature_dtype, device=options.device)
    belief = map_of(options.cells, CHANNELS, params, options.seed)
    neutral = _unit(NEUTRAL_WORDS, generator).to(device)
    texts = [_query(f"text {k}", _unit(1, generator).to(device), neutral) for k in range(2 * TEXTS)]
    limits = machine_limits(clock, device)
    times_ms = _times_ms(belief, texts, clock)
    matrix_ms = 2 * TEXTS * options.cells * CHANNELS / limits.matrix_gflops * 1e-6
    return {
        "benchmark": "query",
        "seed": options.seed,
        "cells": options.cells,
        "channels": CHANNELS,
        "feature_dtype": options.feature_dtype,
        "table_bytes": options.cells * CHANNELS * belief.store.blocks[0].element_size(),
        **times_ms,
        "calibrated_over_read": round(times_ms["calibrated_text_ms"] / times_ms["read_ms"], 2),
        "texts_at_once": TEXTS,
        "matrix_product_ms": round(matrix_ms, 2),
        "texts_over_product": round(times_ms["texts_at_once_ms"] / matrix_ms, 2),
        "standing_texts": STANDING,
        "standing_ms_per_frame": _standing_ms(belief, texts[:STANDING], clock, generator),
        **_waits(belief, options, texts),
        **limits.as_dict(),
        **device_facts(device),
        "threads": options.threads,
        "cores": len(os.sched_getaffinity(0)),
        "load_average": round(os.getloadavg()[0], 2),
    }


def _times_ms(
    belief: BeliefMap, texts: list[TextQuery], clock: Callable[[], float]
) -> dict[str, float]:
    """Least milliseconds for the table alone, and for texts whose scores are not kept.

    The first calibrated text also computes what its competing words weigh in every cell; the
    others find that in ``warm``.
    """
    store, now = belief.store, belief.revision
    first, other = texts[:2]
    every, own = np.arange(store.count), first.concepts[:1]
    plain = replace(other, concepts=other.concepts[:1], neutral=None)
    warm, unasked = ScoreCache(), Unasked()
    warm.scores(first, store, now)
    asks: dict[str, Callable[[], object]] = {
        "read_ms": lambda: _read(store),
        "product_ms": lambda: store.products(every, own),
        "first_calibrated_text_ms": lambda: ScoreCache().scores(first, store, now),
        "plain_text_ms": lambda: warm.scores(unasked.query(plain), store, now),
        "calibrated_text_ms": lambda: warm.scores(unasked.query(other), store, now),
        "texts_at_once_ms": lambda: warm.scores_of_all(
            [unasked.query(text) for text in texts[:TEXTS]], store, now
        ),
    }
    return {name: round(best_s(ask, 3, clock) * 1e3, 2) for name, ask in asks.items()}


def _waits(belief: BeliefMap, options: QueryTimeOptions, texts: list[TextQuery]) -> dict[str, Any]:
    if not options.wait_frames:
        return {}
    waits = WaitOptions(options.wait_frames, FRAME_CELLS, options.seed)
    return frame_waits(belief, texts, waits)


class Unasked:
    """Queries under names that were never asked, so that their scores are not kept."""

    def __init__(self) -> None:
        self._asked = 0

    def query(self, like: TextQuery) -> TextQuery:
        """The same query for a text of another name."""
        self._asked += 1
        return replace(like, text=f"{like.text}, {self._asked}")


def _unit(count: int, generator: torch.Generator) -> Tensor:
    vectors = torch.randn((count, CHANNELS), generator=generator)
    return torch.nn.functional.normalize(vectors, dim=1)


def _query(text: str, own: Tensor, neutral: Tensor) -> TextQuery:
    """A calibrated text that all neutral words compete with."""
    excluded = neutral.new_zeros(len(neutral))
    return TextQuery(
        text, torch.cat([own, neutral]), TEMPERATURE, neutral=neutral, excluded=excluded
    )


def _read(store: CellStore) -> float:
    """Read the whole table once: the sum of its bytes as float32."""
    return float(torch.stack([block.view(torch.float32).sum() for block in store.blocks]).sum())


def _standing_ms(
    belief: BeliefMap,
    texts: list[TextQuery],
    clock: Clock,
    generator: torch.Generator,
) -> float:
    """Milliseconds for texts that are asked again after a frame, the best of several frames."""
    cache, store, now = ScoreCache(), belief.store, belief.revision
    cache.scores_of_all(texts, store, now)
    slots = np.arange(FRAME_CELLS)
    features = _unit(FRAME_CELLS, generator).to(store.device)
    ones = features.new_ones(FRAME_CELLS)
    times = []
    for revision in range(now + 1, now + 7):
        store.fuse(slots, features, ones, revision=revision)
        started = clock()
        cache.scores_of_all(texts, store, revision)
        times.append(clock() - started)
    belief.revision += 6
    return round(min(times) * 1e3, 2)
