"""Every design is a sound body of its category, and a share of them is never trained on."""

from __future__ import annotations

import numpy as np
import pytest

from onemap_perception.encoders.mini import SHIPPED
from onemap_perception.text.vocabulary import load_vocabulary
from onemap_simulator.generation.model import Model
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_simulator.scene.scene import STRUCTURE
from onemap_tools.train.variety.designs.catalogue import TRAINING, VALIDATION, all_designs
from onemap_tools.train.variety.kinds import VARIED

MAX_FACES = 4500  # ten times a plain piece of furniture: a scene holds a hundred things
MAX_SIZE_M = 3.6
CARRIERS = ("table", "coffee table", "desk", "dresser", "nightstand", "bench")
DESIGNS = [(c, maker) for c, makers in all_designs().items() for maker in makers]


def made(maker: ModelFactory, seed: int) -> Model:
    return maker(Sampler(np.random.default_rng(seed), VARIED.style))


@pytest.mark.parametrize(
    ("category", "maker"), DESIGNS, ids=[f"{c}-{m.__name__}" for c, m in DESIGNS]
)
def test_a_design_is_a_sound_body(category: str, maker: ModelFactory) -> None:
    for seed in range(3):
        model = made(maker, seed)
        assert model.category == category
        assert model.lower[2] == pytest.approx(0, abs=2e-3)
        size = model.upper - model.lower
        assert np.isfinite(size).all()
        assert (size > 1e-3).all()
        assert (size < MAX_SIZE_M).all()
        assert sum(len(part.mesh.faces) for part in model.parts) <= MAX_FACES
        for surface in model.support_surfaces:
            assert model.lower[0] <= surface.x_min < surface.x_max <= model.upper[0]
            assert model.lower[1] <= surface.y_min < surface.y_max <= model.upper[1]
            assert 0 < surface.z <= model.upper[2] + 0.01  # a board of cork or leather lies in it


@pytest.mark.parametrize("category", sorted(all_designs()))
def test_a_share_of_each_category_is_for_validation_alone(category: str) -> None:
    trained, held_out = set(TRAINING[category]), set(VALIDATION[category])
    assert trained
    assert held_out
    assert not trained & held_out
    assert trained | held_out == set(all_designs()[category])


def test_all_that_stands_in_rooms_has_designs() -> None:
    assert set(all_designs()) == set(load_vocabulary(SHIPPED).names) - STRUCTURE


def test_a_design_is_a_function_of_the_generator_and_varies() -> None:
    for _, maker in DESIGNS[::20]:
        first, again, other = (made(maker, seed) for seed in (1, 1, 2))
        np.testing.assert_array_equal(first.upper, again.upper)
        assert not np.array_equal(first.upper, other.upper) or len(first.parts) != len(other.parts)


@pytest.mark.parametrize("category", CARRIERS)
def test_what_carries_things_mostly_has_a_top(category: str) -> None:
    tops = [bool(made(maker, 0).support_surfaces) for maker in all_designs()[category]]
    assert np.mean(tops) >= 0.6
