"""Images as vision towers take them."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from onemap_perception.encoders.images import fitted_size, pixel_values, resized

SIDE = st.integers(1, 4000)


def test_a_usual_image_keeps_its_shape_exactly() -> None:
    assert fitted_size(640, 480, long_side_px=640, stride=32) == (640, 480)
    assert fitted_size(1280, 720, long_side_px=640, stride=32) == (640, 352)


@given(width=SIDE, height=SIDE, cells=st.integers(1, 40))
def test_the_size_is_whole_cells_near_the_shape(width: int, height: int, cells: int) -> None:
    stride = 32
    size = fitted_size(width, height, long_side_px=cells * stride, stride=stride)
    assert max(size) == cells * stride
    assert all(side >= stride and side % stride == 0 for side in size)
    exact = min(width, height) / max(width, height) * cells
    assert abs(min(size) / stride - exact) <= 0.5 or min(size) == stride


def test_nothing_is_copied_that_fits() -> None:
    rgb = np.zeros((8, 6, 3), np.uint8)
    assert resized(rgb, (6, 8)) is rgb
    assert resized(rgb, (12, 2)).shape == (2, 12, 3)


def test_planes_are_whitened_channels() -> None:
    rgb = np.array([[[0, 255, 51]]], np.uint8)
    mean, std = np.array([0.5, 0.5, 0.1], np.float32), np.array([0.5, 0.25, 0.1], np.float32)
    result = pixel_values(rgb, mean, std)
    assert result.shape == (1, 3, 1, 1)
    np.testing.assert_allclose(result.ravel(), [-1, 2, 1], atol=1e-6)
