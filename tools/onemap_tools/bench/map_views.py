"""What a frame and a planner's view of the map cost, by the size of the map.

The map is a square of floor, all of it seen. A robot in its middle looks around a room; after each
frame a planner asks for its view, once for what changed and once for the whole.
"""

from __future__ import annotations

import os
import time
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import torch

from onemap_mapper.belief.cells import FeatureShare
from onemap_mapper.belief.map import BeliefMap
from onemap_mapper.config import MapperConfig
from onemap_mapper.frame.update import FrameUpdate, compute_update
from onemap_mapper.occupancy.evidence import OccupancyUpdate
from onemap_mapper.occupancy.heights import LEVELS
from onemap_mapper.query.replies import ViewReplies, search_view
from onemap_mapper.query.scores import MapScores
from onemap_mapper.query.similarity import TextQuery
from onemap_planner.world.map_view import AssembledView, PlanningView, after, map_view_around
from onemap_shared.geometry import F32, F64, I64
from onemap_shared.messages import (
    NO_VIEW,
    TILE_CELLS,
    SearchView,
    ViewChanges,
    ViewChangesRequest,
)
from onemap_shared.wire import decode, encode
from onemap_tools.bench.fusion import simulated_field

SIZES_M = (10, 50, 100, 200)
CHANNELS = 64  # of mini; 768 for 200 m would take 6 GB
NEUTRAL_WORDS = 20
TEXT, RIVALS = "sofa", ("bed", "desk")
WARM_UP = 3  # frames that are not counted: first allocations
WINDOW_M = 5.0  # around the robot: what the planner looks at while it follows a path
WHOLE_VIEWS = 2  # for each size: they take long
ROBOT_M: F64 = np.zeros(2)


@dataclass(frozen=True, slots=True)
class ViewBenchOptions:
    """What is measured: maps of these sizes, so many frames in each, drawn with the seed."""

    sizes_m: tuple[int, ...] = SIZES_M
    frames: int = 10
    seed: int = 0


@dataclass(frozen=True, slots=True)
class ViewCost:
    """Processor time of one view: of the mapper with encoding, of the planner from the bytes to the
    window around the robot; and its bytes."""

    mapper_ms: float
    planner_ms: float
    message_bytes: int


def run(options: ViewBenchOptions) -> dict[str, Any]:
    """Measure each size, in milliseconds of processor time of one thread."""
    torch.set_num_threads(1)
    rng = np.random.default_rng(options.seed)
    updates = [_update(sequence, rng) for sequence in range(options.frames + WARM_UP)]
    return {
        "benchmark": "view",
        "seed": options.seed,
        "frames": options.frames,
        "channels": CHANNELS,
        "frame_cells": int(np.median([len(update.cells) for update in updates])),
        "texts": 1 + len(RIVALS),
        "results": [_measured(size_m, updates, rng) for size_m in options.sizes_m],
        "cores": len(os.sched_getaffinity(0)),
        "load_average": round(os.getloadavg()[0], 2),
    }


def _measured(size_m: int, updates: list[FrameUpdate], rng: np.random.Generator) -> dict[str, Any]:
    belief = seen_floor(size_m, rng)
    bench = _Views(belief, rng)
    fuse_ms, changes, whole = [], [], []
    first = bench.changes()  # everything, as when a search begins
    for index, update in enumerate(updates):
        started = time.process_time()
        belief.fuse(replace(update, sequence=index))
        fuse_ms.append((time.process_time() - started) * 1e3)
        changes.append(bench.changes())
        if index >= len(updates) - WHOLE_VIEWS:
            whole.append(bench.whole())
    bench.check()
    return {
        "size_m": size_m,
        "cells": belief.store.count,
        "fuse_ms": _low_and_middle(fuse_ms[WARM_UP:]),
        "first": _summary([first]),
        "changes": _summary(changes[WARM_UP:]),
        "whole": _summary(whole),
    }


class _Views:
    """A mapper's replies and a planner's copy, for one map."""

    def __init__(self, belief: BeliefMap, rng: np.random.Generator) -> None:
        self._scores = MapScores(belief)
        self._replies = ViewReplies(self._scores, "benchmark")
        neutral = _unit_rows(rng, NEUTRAL_WORDS)
        self._queries = [
            TextQuery(name, torch.from_numpy(np.concatenate([_unit_rows(rng, 1), neutral])), 20.0)
            for name in (TEXT, *RIVALS)
        ]
        self._kept: AssembledView | None = None

    def changes(self) -> ViewCost:
        """What changed since the last call."""
        have = NO_VIEW if self._kept is None else self._kept.key
        started = time.process_time()
        packet = encode(self._replies.reply(ViewChangesRequest(TEXT, RIVALS, have), self._queries))
        sent = time.process_time()
        self._kept = after(self._kept, decode(ViewChanges, packet))
        _looked_at(self._kept)
        ended = time.process_time()
        return ViewCost(
            (sent - started) * 1e3, (ended - sent) * 1e3, len(packet.body) + len(packet.header)
        )

    def whole(self) -> ViewCost:
        """The whole view."""
        started = time.process_time()
        packet = encode(search_view(self._scores.of(self._queries), text=TEXT))
        sent = time.process_time()
        _looked_at(decode(SearchView, packet))
        ended = time.process_time()
        return ViewCost(
            (sent - started) * 1e3, (ended - sent) * 1e3, len(packet.body) + len(packet.header)
        )

    def check(self) -> None:
        """Raise unless the planner's copy is the whole view bit for bit."""
        assert self._kept is not None
        ours, whole = self._kept.whole(), search_view(self._scores.of(self._queries), text=TEXT)
        for name in ("occupancy", "layers", "similarity", "rival", "guidance"):
            if not np.array_equal(getattr(ours, name), getattr(whole, name), equal_nan=True):
                raise RuntimeError(f"the assembled view has another {name} than the whole one")


def _looked_at(view: PlanningView) -> None:
    map_view_around(view, ROBOT_M, np.stack([ROBOT_M - WINDOW_M, ROBOT_M + WINDOW_M]))


def seen_floor(size_m: int, rng: np.random.Generator) -> BeliefMap:
    """A map of a square of free floor around the origin, every cell with a feature."""
    params = MapperConfig(max_extent_m=size_m + 20)
    belief = BeliefMap(params)
    side = round(size_m / params.cell_size_m)
    belief.set_encoder("benchmark", "benchmark", CHANNELS)
    belief.grow(np.array([[-side // 2, -side // 2], [side // 2 - 1, side // 2 - 1]]))
    for start in range(-side // 2, side // 2, TILE_CELLS):
        x = np.arange(start, min(start + TILE_CELLS, side // 2))
        cells: I64 = np.stack(np.meshgrid(x, np.arange(-side // 2, side // 2), indexing="ij"), -1)
        _see(belief, cells.reshape(-1, 2), rng)
    return belief


def _see(belief: BeliefMap, cells: I64, rng: np.random.Generator) -> None:
    """Let cells (n, 2) have been seen well, as free floor."""
    confidence = torch.full((len(cells),), 10.0, dtype=torch.float64)
    features = torch.from_numpy(_unit_rows(rng, len(cells)))
    heights = np.zeros((len(cells), LEVELS), np.float32)
    belief.put_in(FeatureShare(cells, features, confidence, confidence, confidence, heights))
    evidence = np.zeros((len(cells), belief.params.levels + 1), np.int8)
    clear, none = np.ones(len(cells), bool), np.zeros(len(cells), bool)
    belief.fuse_occupancy(OccupancyUpdate.of_arrays(cells, evidence, clear, none))


def _update(sequence: int, rng: np.random.Generator) -> FrameUpdate:
    field = simulated_field(sequence, rng)
    features = np.ascontiguousarray(field.features[..., :CHANNELS])
    return compute_update(replace(field, features=features), MapperConfig())


def _unit_rows(rng: np.random.Generator, count: int) -> F32:
    rows = rng.standard_normal((count, CHANNELS), dtype=np.float32)
    unit: F32 = rows / np.linalg.norm(rows, axis=1, keepdims=True)
    return unit


def _low_and_middle(values: list[float]) -> dict[str, float]:
    return {"min": round(min(values), 2), "p50": round(float(np.median(values)), 2)}


def _summary(costs: list[ViewCost]) -> dict[str, Any]:
    return {
        "bytes_p50": int(np.median([cost.message_bytes for cost in costs])),
        "mapper_ms": _low_and_middle([cost.mapper_ms for cost in costs]),
        "planner_ms": _low_and_middle([cost.planner_ms for cost in costs]),
    }
