from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from onemap_simulator.rendering.texture_atlas import MAX_LEVELS, TextureAtlas

RNG = np.random.default_rng(0)
SMALL = RNG.integers(0, 256, (3, 5, 3), np.uint8)
LARGE = RNG.integers(0, 256, (256, 300, 3), np.uint8)
ATLAS = TextureAtlas.of([SMALL, LARGE])


def sample(texture: int, level: int, u: float, v: float) -> np.ndarray:
    texels: np.ndarray = ATLAS.sample(
        np.array([texture], np.int32),
        np.array([level], np.int32),
        np.array([u], np.float32),
        np.array([v], np.float32),
    )
    texel: np.ndarray = texels[0]
    return texel


@settings(max_examples=100, deadline=None, derandomize=True)
@given(
    texture=st.integers(0, 1),
    column=st.integers(0, 299),
    row=st.integers(0, 255),
    turns=st.integers(-3, 3),
)
def test_reads_the_texel_below_a_coordinate_and_repeats(
    texture: int, column: int, row: int, turns: int
) -> None:
    image = (SMALL, LARGE)[texture]
    height, width = image.shape[:2]
    row, column = row % height, column % width
    u, v = (column + 0.5) / width + turns, (row + 0.5) / height - turns
    np.testing.assert_array_equal(sample(texture, 0, u, v), image[row, column])


def test_tiny_negative_coordinates_stay_inside() -> None:
    np.testing.assert_array_equal(sample(0, 0, -1e-12, -1e-12), SMALL[-1, -1])


def test_levels_beyond_both_ends_are_the_ends() -> None:
    np.testing.assert_array_equal(sample(1, -7, 0.0, 0.0), LARGE[0, 0])
    smallest = sample(1, MAX_LEVELS + 5, 0.3, 0.8)
    np.testing.assert_allclose(smallest, LARGE.mean(axis=(0, 1)), atol=6)


def test_a_small_pattern_is_enlarged_without_changing_its_colours() -> None:
    ramp = np.repeat(np.arange(0, 256, 4, dtype=np.uint8)[None, :, None], 64, axis=0)
    atlas = TextureAtlas.of([np.repeat(ramp, 3, axis=2)])
    assert (atlas.widths[0, 0], atlas.heights[0, 0]) == (256, 256)
    u = np.linspace(0.1, 0.9, 50, dtype=np.float32)
    zeros = np.zeros(50, np.int32)
    shown = atlas.sample(zeros, zeros, u, u)[:, 0]
    np.testing.assert_allclose(shown, u * 256 - 2, atol=3)
