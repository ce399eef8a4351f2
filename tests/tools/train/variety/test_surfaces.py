"""Textures repeat, differ in their statistics, and are functions of the generator."""

from __future__ import annotations

import numpy as np
import pytest

from onemap_tools.train.variety.surfaces import FAMILIES, SIZE, fractal, palette, surface

# Their lines run along the edge, where one may begin: there the texture is not smooth anywhere.
SHARP = {"bands", "tiles", "bricks", "plaid", "cells", "specks", "strata", "veins"}


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


@pytest.mark.parametrize("family", sorted(FAMILIES))
def test_a_texture_is_a_function_of_the_generator(family: str) -> None:
    first, again, other = (surface(family, rng(seed)) for seed in (1, 1, 2))
    assert first.shape == (SIZE, SIZE, 3)
    assert first.dtype == np.uint8
    np.testing.assert_array_equal(first, again)
    assert (first != other).any()


@pytest.mark.parametrize("family", sorted(set(FAMILIES) - SHARP))
def test_smooth_textures_repeat_without_a_seam(family: str) -> None:
    for seed in range(4):
        height = FAMILIES[family](rng(seed))
        for axis in (0, 1):
            steps = np.abs(np.diff(height, axis=axis)).mean()
            seam = np.abs(height.take(0, axis) - height.take(-1, axis)).mean()
            assert seam <= 3 * steps + 0.02


def test_a_higher_power_gives_coarser_noise() -> None:
    rough, smooth = (np.abs(np.diff(fractal(rng(), power))).mean() for power in (0.5, 2.0))
    assert smooth < rough / 3


def test_grain_runs_along_the_axis_of_the_lower_factor() -> None:
    noise = fractal(rng(), 1.2, stretch=(12.0, 1.0))
    along, across = (np.abs(np.diff(noise, axis=axis)).mean() for axis in (0, 1))
    assert along < across / 2


def test_palettes_hold_colours() -> None:
    for seed in range(20):
        colours = palette(rng(seed))
        assert 2 <= len(colours) <= 4
        assert colours.min() >= 0
        assert colours.max() <= 1
