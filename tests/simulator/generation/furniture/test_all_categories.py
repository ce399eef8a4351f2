"""Every factory gives sound, varied models of its category."""

from __future__ import annotations

import numpy as np
import pytest

from onemap_simulator.generation.model import Model
from onemap_simulator.generation.sampler import Sampler
from onemap_simulator.generation.style import HELD_OUT, TRAINING, Style
from tests.simulator.generation.furniture.catalogue import FACTORIES

EVERY = sorted(FACTORIES)


def draw(category: str, seed: int, style: Style = TRAINING) -> Model:
    sampler = Sampler(np.random.default_rng(seed), style)
    return sampler.choice(FACTORIES[category])(sampler)


def outline(model: Model) -> tuple[float, ...]:
    return tuple((model.upper - model.lower).round(6).tolist())


@pytest.mark.parametrize("category", EVERY)
@pytest.mark.parametrize("style", [TRAINING, HELD_OUT], ids=lambda style: style.name)
def test_models_are_sound(category: str, style: Style) -> None:
    for seed in range(6):
        model = draw(category, seed, style)
        assert model.category == category
        size = model.upper - model.lower
        assert (size > 0.01).all() or category == "rug"
        assert size.max() < 3.6
        assert model.lower[2] > -0.13  # brackets hang a little below a shelf's lowest board
        assert sum(len(part.mesh.faces) for part in model.parts) < 4000
        for mesh, material in model.parts:
            assert np.isfinite(mesh.vertices).all()
            assert np.isfinite(mesh.uv).all()
            assert mesh.faces.min() >= 0
            assert mesh.faces.max() < len(mesh.vertices)
            assert material.texture.dtype == np.uint8
            assert material.texture.shape[2] == 3


@pytest.mark.parametrize("category", EVERY)
def test_models_vary_with_the_seed_and_only_with_it(category: str) -> None:
    models = [draw(category, seed) for seed in range(5)]
    looks = {model.parts[0].material.texture.tobytes() for model in models}
    assert len(looks) == len(models)
    assert len({outline(model) for model in models}) > 1
    again = draw(category, 3)
    assert outline(again) == outline(models[3])
    assert (again.parts[0].material.texture == models[3].parts[0].material.texture).all()


@pytest.mark.parametrize("category", EVERY)
def test_support_surfaces_lie_within_the_model(category: str) -> None:
    for seed in range(4):
        model = draw(category, seed)
        for top in model.support_surfaces:
            assert top.x_min < top.x_max
            assert top.y_min < top.y_max
            assert model.lower[0] <= top.x_min
            assert top.x_max <= model.upper[0]
            assert model.lower[2] < top.z <= model.upper[2] + 1e-6


def test_there_are_as_many_categories_as_documented() -> None:
    assert len(FACTORIES) + len(("wall", "floor", "ceiling")) >= 57
