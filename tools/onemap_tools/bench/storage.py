"""What rounding does to a map in an hour: float16 and float32 cells against the exact belief."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import torch

from onemap_mapper.belief.cells import CellStore
from onemap_mapper.params import MapParams
from onemap_shared.geometry import F64

NEAREST = "float16, rounded to the nearest"  # what chance in rounding is there to improve
LEAST_CONFIDENCE, MOST_CONFIDENCE = 0.26, 0.86  # of the released model at 4 and at 2 m
SAMPLED_S = 1.0  # between two comparisons with the exact belief
FOLLOWED = 0.9  # cosine with the thing that is there now, from which a cell shows it
CPU = torch.device("cpu")


@dataclass(frozen=True, slots=True)
class StorageOptions:
    """noise: length of what differs in each view, of the feature's; exchange_s: after which every
    cell shows another thing; rate_hz: of frames."""

    hours: float = 1.0
    rate_hz: float = 4.0
    exchange_s: float = 600.0
    noise: float = 0.5
    cells: int = 16
    channels: int = 768
    seed: int = 0


@dataclass(frozen=True, slots=True)
class Film:
    """Unit features (things, cells, D) that the cells show in turn, frames of each."""

    things: F64
    frames_each: int


def run(options: StorageOptions) -> dict[str, Any]:
    """Greatest errors of similarity after every second, and the views until a change is seen."""
    torch.set_num_threads(1)  # the arrays are small
    rng = np.random.default_rng(options.seed)
    frames = round(options.hours * 3600 * options.rate_hz)
    frames_each = max(1, round(options.exchange_s * options.rate_hz))
    count = -(-frames // frames_each)
    film = Film(_unit(rng.normal(size=(count, options.cells, options.channels))), frames_each)
    stores = {name: _Stored(name, options) for name in ("float32", "float16", NEAREST)}
    exact, known = _Exact(options), np.zeros(options.cells)
    for frame in range(frames):
        thing = film.things[frame // frames_each]
        seen = thing + _unit(rng.normal(size=thing.shape)) * options.noise
        confidence = rng.uniform(LEAST_CONFIDENCE, MOST_CONFIDENCE, options.cells)
        confidence = confidence.astype(np.float32).astype(np.float64)
        seen = _unit(seen).astype(np.float32).astype(np.float64)
        exact.fuse(seen, confidence, known)
        for store in stores.values():
            store.fuse(seen, confidence)
        known += confidence
        if (frame + 1) % max(1, round(SAMPLED_S * options.rate_hz)) == 0:
            for store in stores.values():
                store.compare(exact, film, frame)
    return {
        "benchmark": "storage",
        "seed": options.seed,
        "hours": options.hours,
        "rate_hz": options.rate_hz,
        "exchange_s": options.exchange_s,
        "noise": options.noise,
        "cells": options.cells,
        "channels": options.channels,
        "max_prior_confidence": MapParams().max_prior_confidence,
        **{name: store.report(options) for name, store in stores.items()},
    }


class _Exact:
    """The belief in float64."""

    def __init__(self, options: StorageOptions) -> None:
        self.features = np.zeros((options.cells, options.channels))

    def fuse(self, seen: F64, confidence: F64, known: F64) -> None:
        """Fuse a view, as the equations say."""
        prior = np.minimum(known, MapParams().max_prior_confidence)
        K = confidence / (prior + confidence)
        self.features += K[:, None] * (seen - self.features)


class _Stored:
    """The same cells as a map stores them, and its greatest errors so far."""

    def __init__(self, name: str, options: StorageOptions) -> None:
        dtype = torch.float32 if name != "float16" else torch.float16
        limit = MapParams().max_prior_confidence
        self._rounded = name == NEAREST  # in float32, and rounded after each view
        self._store = CellStore(
            options.channels, device=CPU, dtype=dtype, compiled=True, max_prior=limit
        )
        self._slots = self._store.add(np.zeros((options.cells, 2), np.int64))
        self._revision = 0
        self._error, self._least_cosine = 0.0, 1.0
        self._followed: dict[int, int] = {}

    def fuse(self, seen: F64, confidence: F64) -> None:
        """Fuse a view as the mapper does."""
        self._revision += 1
        self._store.fuse(
            self._slots,
            torch.from_numpy(seen).float(),
            torch.from_numpy(confidence).float(),
            revision=self._revision,
        )
        if self._rounded:
            rows = self._store.blocks[0][: len(self._slots)]
            rows.copy_(rows.half())

    def compare(self, exact: _Exact, film: Film, frame: int) -> None:
        """Compare the directions of all cells, and their cosines with what they showed."""
        stored = _unit(self._store.features(self._slots).double().numpy())
        wanted = _unit(exact.features)
        now = frame // film.frames_each
        shown = film.things[max(0, now - 1) : now + 1]  # what is there, and was before
        errors = np.abs(((stored - wanted) * shown).sum(axis=-1))
        self._error = max(self._error, float(errors.max()))
        self._least_cosine = min(self._least_cosine, float((stored * wanted).sum(axis=-1).min()))
        follows = (stored * film.things[now]).sum(axis=-1).min() >= FOLLOWED
        if follows and now not in self._followed:
            self._followed[now] = frame - now * film.frames_each + 1

    def report(self, options: StorageOptions) -> dict[str, Any]:
        """The errors, and after how long the last thing that replaced another was seen."""
        changes = [views for thing, views in self._followed.items() if thing > 0]
        slowest = round(max(changes) / options.rate_hz, 1) if changes else None
        return {
            "similarity_error_max": round(self._error, 5),
            "cosine_with_exact_min": round(self._least_cosine, 6),
            "changes_followed": len(changes),
            "slowest_change_s": slowest,
        }


def _unit(rows: F64) -> F64:
    unit: F64 = rows / np.maximum(np.linalg.norm(rows, axis=-1, keepdims=True), 1e-12)
    return unit
