from __future__ import annotations

import colorsys

import numpy as np
import pytest

from onemap_simulator.generation.sampler import Sampler
from onemap_simulator.generation.style import HELD_OUT, TRAINING, Style


def test_held_out_sizes_lie_outside_the_nominal_interval() -> None:
    sampler = Sampler(np.random.default_rng(0), HELD_OUT)
    sizes = [sampler.size(1.0, 2.0) for _ in range(100)]
    assert all(size < 1.0 or size > 2.0 for size in sizes)
    nominal = Sampler(np.random.default_rng(0), TRAINING)
    assert all(1.0 <= nominal.size(1.0, 2.0) <= 2.0 for _ in range(100))


@pytest.mark.parametrize("style", [TRAINING, HELD_OUT], ids=lambda style: style.name)
def test_colours_stay_within_the_style(style: Style) -> None:
    sampler = Sampler(np.random.default_rng(0), style)
    hsv = np.array([colorsys.rgb_to_hsv(*sampler.colour()) for _ in range(200)])
    assert (hsv[:, 1] >= style.saturation[0] - 1e-9).all()
    assert (hsv[:, 1] <= style.saturation[1] + 1e-9).all()
    assert (hsv[:, 2] >= style.value[0] - 1e-9).all()
    assert (hsv[:, 2] <= style.value[1] + 1e-9).all()


def test_draws_have_their_distribution() -> None:
    sampler = Sampler(np.random.default_rng(0), TRAINING)
    assert np.mean([sampler.chance(0.3) for _ in range(2000)]) == pytest.approx(0.3, abs=0.03)
    assert {sampler.integer(2, 4) for _ in range(100)} == {2, 3, 4}
    assert {sampler.choice("ab") for _ in range(50)} == {"a", "b"}
    numbers = [sampler.uniform(-1.0, 3.0) for _ in range(500)]
    assert -1.0 <= min(numbers) < -0.9
    assert 2.9 < max(numbers) <= 3.0


def test_the_same_seed_draws_the_same_material() -> None:
    first, second = (Sampler(np.random.default_rng(5), TRAINING).wood() for _ in range(2))
    np.testing.assert_array_equal(first.texture, second.texture)
    assert first.tile_m == second.tile_m


def test_a_second_colour_defaults_to_a_darker_shade() -> None:
    sampler = Sampler(np.random.default_rng(0), TRAINING)
    striped = sampler.material("stripes", 1.0, (1.0, 0.5, 0.0)).texture
    colours = np.unique(striped.reshape(-1, 3) // 32, axis=0)
    assert len(colours) > 1
    bright, dark = striped.reshape(-1, 3).max(axis=0), striped.reshape(-1, 3).min(axis=0)
    assert bright[0] > 240
    assert 0.5 * 255 < dark[0] < 0.9 * 255
