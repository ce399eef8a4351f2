"""Every family, under every seed, is an image between its two colours."""

from __future__ import annotations

import numpy as np
import pytest

from onemap_simulator.generation.textures import FAMILIES, SIZE, smooth_noise, texture


@pytest.mark.parametrize("family", FAMILIES)
def test_a_texture_lies_between_its_colours(family: str) -> None:
    for seed in range(3):
        rng = np.random.default_rng(seed)
        image = texture(family, rng, [(0.2, 0.4, 0.6), (0.3, 0.5, 0.7)])
        assert image.shape == (SIZE, SIZE, 3)
        assert image.dtype == np.uint8
        mean = image.reshape(-1, 3).mean(axis=0) / 255
        assert (mean > (0.15, 0.35, 0.55)).all()
        assert (mean < (0.35, 0.55, 0.75)).all()


def test_the_seed_decides() -> None:
    first, second = (
        texture("wood", np.random.default_rng(s), [(0, 0, 0), (1, 1, 1)]) for s in (1, 2)
    )
    again = texture("wood", np.random.default_rng(1), [(0, 0, 0), (1, 1, 1)])
    assert (first == again).all()
    assert (first != second).any()


def test_noise_spans_zero_to_one_at_the_size_asked() -> None:
    noise = smooth_noise(np.random.default_rng(0), (1, 8), 64)
    assert noise.shape == (64, 64)
    assert noise.min() >= 0
    assert noise.max() <= 1
    assert smooth_noise(np.random.default_rng(0), (32, 32), 96).shape == (96, 96)
