"""Time of a query over a large map, against reading its table and against a matrix product."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from itertools import count
from typing import Any

import numpy as np
import torch
from torch import Tensor

from onemap_mapper.belief.cells import CellStore, FeatureShare
from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.occupancy.heights import LEVELS
from onemap_mapper.params import MapParams
from onemap_mapper.query.similarity import ScoreCache, TextQuery
from onemap_tools.bench.machine import Clock, best_ms, clock_of, machine_facts
from onemap_tools.bench.options import QueryBench

CHANNELS = 768
NEUTRAL_WORDS = 103  # as many as mini's
TEXTS = 32  # asked at once
STANDING = 20  # texts that are asked again after every frame
FRAME_CELLS = 800  # that a frame changes
TEMPERATURE = 50.0
MATRIX = 1024  # rows and columns of the machine's own product


def run(options: QueryBench, _tell: Callable[[str], None]) -> dict[str, Any]:
    """Milliseconds of processor time with one thread, of the clock with several."""
    torch.set_num_threads(options.threads)
    device = torch.device(options.device)
    clock = clock_of(device, options.threads)
    generator = torch.Generator().manual_seed(options.seed)
    params = MapParams(feature_dtype=options.feature_dtype, device=options.device)
    belief = map_of(options.cells, params, options.seed)
    neutral = _unit(NEUTRAL_WORDS, generator).to(device)
    texts = [_query(f"text {k}", _unit(1, generator).to(device), neutral) for k in range(TEXTS)]
    times_ms = _times_ms(belief, texts, clock)
    a, b = (torch.ones((MATRIX, MATRIX), device=device) for _ in range(2))
    matrix_ms = best_ms(lambda: torch.mm(a, b), clock) * TEXTS * options.cells * CHANNELS
    matrix_ms /= MATRIX**3
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
        "map_bytes": belief.memory_bytes,
        **machine_facts(device),
    }


def map_of(cells: int, params: MapParams, seed: int) -> BeliefMap:
    """A square map of random features, one per cell."""
    side = math.isqrt(cells - 1) + 1
    where = np.argwhere(np.ones((side, side), bool))[:cells]
    belief = BeliefMap(params)
    belief.grow(where)
    belief.set_encoder("random", "random", CHANNELS)
    generator = torch.Generator().manual_seed(seed)
    for first in range(0, cells, 4096):
        some = where[first : first + 4096]
        ones = np.ones(len(some))
        heights, colours = (np.zeros((len(some), k), np.float32) for k in (LEVELS, 3))
        features = _unit(len(some), generator)
        belief.put_in(FeatureShare(some, features, ones, ones, heights, colours))
    return belief


def _times_ms(belief: BeliefMap, texts: list[TextQuery], clock: Clock) -> dict[str, float]:
    """Least milliseconds for the table alone, and for texts whose scores are not kept.

    The first one of a map also computes what competing words weigh in every cell.
    """
    store, now = belief.store, belief.revision
    first, other = texts[:2]
    every, own = np.arange(store.count), first.concepts[:1]
    warm, numbers = ScoreCache(), count()

    def unasked(like: TextQuery) -> TextQuery:  # under a new name: its scores are not kept
        return replace(like, text=f"{like.text}, {next(numbers)}")

    warm.scores_of_all([first], store, now)
    asks: dict[str, Callable[[], object]] = {
        "read_ms": lambda: _read(store),
        "product_ms": lambda: store.products(every, own),
        "first_text_ms": lambda: ScoreCache().scores_of_all([first], store, now),
        "calibrated_text_ms": lambda: warm.scores_of_all([unasked(other)], store, now),
        "texts_at_once_ms": lambda: warm.scores_of_all(
            [unasked(text) for text in texts], store, now
        ),
    }
    return {name: best_ms(ask, clock) for name, ask in asks.items()}


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
    belief: BeliefMap, texts: list[TextQuery], clock: Clock, generator: torch.Generator
) -> float:
    """Milliseconds for texts that are asked again after a frame, the best of several frames.

    As in a search, for which scores of the changed cells are copied only.
    """
    cache, store = ScoreCache(), belief.store
    cache.updated(texts, store, belief.revision)
    features = _unit(FRAME_CELLS, generator).to(store.device)
    ones, times = np.ones(FRAME_CELLS, np.float32), []
    for revision in range(belief.revision + 1, belief.revision + 7):
        store.fuse(np.arange(FRAME_CELLS), features, ones, revision=revision)
        started = clock()
        cache.updated(texts, store, revision)
        times.append(clock() - started)
    return round(min(times) * 1e3, 2)
