"""The validation camera changes how pictures look, not where things are."""

from __future__ import annotations

import numpy as np

from onemap_tools.train.variety.camera import photographed


def test_bright_stays_brighter_than_dark() -> None:
    rgb = np.full((48, 64, 3), 60, np.uint8)
    rgb[:, 32:] = 190
    before = rgb.copy()
    for seed in range(10):
        picture = photographed(rgb, np.random.default_rng(seed))
        assert picture.shape == rgb.shape
        assert picture.dtype == np.uint8
        assert picture[:, 40:].mean() > picture[:, :24].mean() + 20
        np.testing.assert_array_equal(picture, photographed(rgb, np.random.default_rng(seed)))
    np.testing.assert_array_equal(rgb, before)
