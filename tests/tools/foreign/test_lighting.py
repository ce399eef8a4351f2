"""Interleaved sampling: patterns cover the square, averaging keeps what is even."""

from __future__ import annotations

import numpy as np

from onemap_tools.foreign.lighting import TILE, SurfacePoints, averaged, falloff, pattern
from onemap_tools.foreign.lit_scene import AreaLight


def plane(height: int, width: int) -> SurfacePoints:
    """Points of a floor."""
    x, y = np.meshgrid(np.arange(width), np.arange(height))
    points = np.stack([x, y, 0 * x], axis=-1).reshape(-1, 3) / 100
    normals = np.tile(np.array([0, 0, 1], np.float32), (height * width, 1))
    return SurfacePoints(points.astype(np.float32), normals, height, width)


def test_a_tile_of_the_pattern_covers_the_square() -> None:
    numbers = pattern(np.random.default_rng(0), 2, 8, 12).reshape(8, 12, 2)[:TILE, :TILE]
    cells = np.floor(numbers.reshape(-1, 2) * TILE).astype(int)
    assert len(np.unique(cells, axis=0)) == TILE * TILE
    np.testing.assert_array_equal(
        pattern(np.random.default_rng(0), 2, 8, 12).reshape(8, 12, 2)[4:, 8:], numbers
    )


def test_averaging_mixes_one_surface_and_no_other() -> None:
    at = plane(8, 16)
    at.normals[:64] = (0, 1, 0)
    values = np.arange(128, dtype=np.float32)[:, None] % 2
    values[:64] += 10
    mean = averaged(values, at)
    assert mean[:64].min() > 9
    assert mean[64:].max() < 2
    assert values.std() > mean[64:].std()


def test_a_light_to_one_side_leaves_the_other_dark() -> None:
    at = plane(2, 2)
    above = np.broadcast_to(np.array([0, 0, 1], np.float32), at.points.shape)
    down = AreaLight((0, 0, 1), (0, 0, 0), (1, 1, 1), (0, 0, -1))
    up = AreaLight((0, 0, 1), (0, 0, 0), (1, 1, 1), (0, 0, 1))
    assert falloff(down, at, above).min() > 0
    assert falloff(up, at, above).max() == 0
