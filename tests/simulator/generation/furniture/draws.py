"""Draws of one factory with different seeds, for the tests of the furniture."""

from __future__ import annotations

import numpy as np

from onemap_shared.geometry import F64
from onemap_simulator.generation.model import Model
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_simulator.generation.style import TRAINING


def sampler(seed: int) -> Sampler:
    return Sampler(np.random.default_rng(seed), TRAINING)


def draws(factory: ModelFactory, count: int = 10) -> list[Model]:
    return [factory(sampler(seed)) for seed in range(count)]


def extents(models: list[Model]) -> F64:
    """Width, depth and height (N, 3) in metres."""
    return np.array([model.upper - model.lower for model in models])


def backs(models: list[Model]) -> F64:
    """Largest y (N,) in metres: where the wall is for what hangs on it."""
    return np.array([model.upper[1] for model in models])
