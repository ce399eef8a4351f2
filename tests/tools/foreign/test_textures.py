"""Textures: their size, that they are functions of the generator, and what marks each kind."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from onemap_shared.geometry import U8
from onemap_tools.foreign import textures
from onemap_tools.foreign.noise import PX

TAN, BLUE = (0.6, 0.4, 0.25), (0.2, 0.3, 0.6)
MAKERS: dict[str, Callable[[np.random.Generator], U8]] = {
    "wood": lambda rng: textures.wood(rng, TAN),
    "planks": lambda rng: textures.planks(rng, TAN),
    "parquet": lambda rng: textures.parquet(rng, TAN),
    "weave": lambda rng: textures.weave(rng, BLUE),
    "stripes": lambda rng: textures.stripes(rng, TAN, BLUE),
    "plaid": lambda rng: textures.plaid(rng, TAN, BLUE),
    "blossoms": lambda rng: textures.blossoms(rng, TAN, BLUE),
    "leather": lambda rng: textures.leather(rng, TAN),
    "brushed": textures.brushed,
    "marble": lambda rng: textures.marble(rng, (0.9, 0.9, 0.9), BLUE),
    "terrazzo": lambda rng: textures.terrazzo(rng, (0.8, 0.8, 0.8)),
    "tiles": lambda rng: textures.tiles(rng, BLUE),
    "checker": lambda rng: textures.checker(rng, (0.9, 0.9, 0.9), (0.1, 0.1, 0.1)),
    "plaster": lambda rng: textures.plaster(rng, TAN),
    "wallpaper": lambda rng: textures.wallpaper(rng, TAN, BLUE),
    "concrete": textures.concrete,
    "bricks": lambda rng: textures.bricks(rng, TAN),
    "wicker": lambda rng: textures.wicker(rng, TAN),
    "fur": lambda rng: textures.fur(rng, TAN),
    "foliage": lambda rng: textures.foliage(rng, (0.2, 0.4, 0.2)),
    "plain": lambda rng: textures.plain(rng, BLUE),
}


@pytest.mark.parametrize("kind", MAKERS)
def test_a_texture_is_an_image_that_its_generator_decides(kind: str) -> None:
    first, again, other = (MAKERS[kind](np.random.default_rng(seed)) for seed in (1, 1, 2))
    assert first.dtype == np.uint8
    assert first.ndim == 3
    assert min(first.shape[:2]) >= 64
    np.testing.assert_array_equal(first, again)
    assert (first != other).any()


@pytest.mark.parametrize("kind", ["wood", "weave", "marble", "concrete", "brushed"])
def test_a_texture_repeats_without_a_seam(kind: str) -> None:
    image = MAKERS[kind](np.random.default_rng(3)).astype(np.float64)
    inside = np.abs(np.diff(image, axis=0)).mean()
    seam = np.abs(image[0] - image[-1]).mean()
    assert seam < 4 * inside + 4


def test_grain_and_scratches_lie_along_x() -> None:
    for kind in ("wood", "brushed"):
        image = MAKERS[kind](np.random.default_rng(4)).astype(np.float64)
        assert np.abs(np.diff(image, axis=0)).mean() > 2 * np.abs(np.diff(image, axis=1)).mean()


def test_mixed_and_shaded_colours_stay_colours() -> None:
    assert textures.mix((0, 0, 0), (1, 0.5, 0), 0.5) == (0.5, 0.25, 0)
    assert textures.shade((0.5, 0.9, 0.1), 2.0) == (1.0, 1.0, 0.2)
    assert MAKERS["wood"](np.random.default_rng(0)).shape == (PX, PX, 3)
