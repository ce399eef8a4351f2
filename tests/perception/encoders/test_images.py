"""Images as vision towers take them."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from onemap_perception.encoders.images import decoded, fitted_size, framed, patch_shares
from onemap_perception.errors import ImageError
from onemap_shared.geometry import U8

SIDE = st.integers(1, 4000)


@given(width=SIDE, height=SIDE, cells=st.integers(1, 40))
def test_the_size_is_whole_cells_near_the_shape(width: int, height: int, cells: int) -> None:
    stride = 32
    size = fitted_size(width, height, long_side_px=cells * stride, stride=stride)
    assert max(size) == cells * stride
    assert all(side >= stride and side % stride == 0 for side in size)
    exact = min(width, height) / max(width, height) * cells
    assert abs(min(size) / stride - exact) <= 0.5 or min(size) == stride


def png(rgb: U8) -> bytes:
    data: bytes = cv2.imencode(".png", rgb[..., ::-1])[1].tobytes()
    return data


def noise(height: int, width: int) -> U8:
    return np.random.default_rng(0).integers(0, 256, (height, width, 3), dtype=np.uint8)


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (b"GIF89a", "no PNG and no JPEG"),
        (png(noise(24, 40))[:200], "damaged or cut off"),
        (png(noise(8, 40)), "40 x 8 pixels"),
        (png(np.full((24, 40, 3), 90, np.uint8)), "nothing but one colour"),
    ],
)
def test_what_shows_nothing_is_refused(data: bytes, reason: str) -> None:
    with pytest.raises(ImageError, match=reason):
        decoded(data)


@pytest.mark.parametrize(("height", "width"), [(16, 64), (64, 16), (17, 17), (300, 400)])
def test_a_crop_of_any_shape_fills_the_frame_one_way(height: int, width: int) -> None:
    image, mask = framed(noise(height, width), (64, 48))
    assert image.shape == (48, 64, 3)
    rows, columns = np.nonzero(mask)
    inner = (np.ptp(rows) + 1, np.ptp(columns) + 1)
    assert inner[0] == 48 or inner[1] == 64
    assert inner[0] / inner[1] == pytest.approx(height / width, rel=0.07)
    assert patch_shares(mask, 6, 8).sum() == pytest.approx(mask.sum() / 64, rel=1e-3)
