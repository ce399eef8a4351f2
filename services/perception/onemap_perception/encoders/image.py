"""Prepares images for vision towers: size, scale, normalisation."""

from __future__ import annotations

import cv2
import numpy as np

from onemap_shared.geometry import F32, U8
from onemap_shared.messages import expect


def fitted_size(width: int, height: int, *, long_side_px: int, stride: int) -> tuple[int, int]:
    """(width, height) in multiples of ``stride``: the longer side ``long_side_px``, the shape kept.

    The shorter side is off by half a stride at most, and one cell at least.
    """
    scale = long_side_px / max(width, height)
    columns, rows = (max(round(side * scale / stride), 1) for side in (width, height))
    return columns * stride, rows * stride


def resized(rgb: U8, size: tuple[int, int]) -> U8:
    """The image (H, W, 3) at (width, height) ``size``; reducing averages pixels."""
    expect(rgb, "rgb", np.uint8, (None, None, 3))
    if size == (rgb.shape[1], rgb.shape[0]):
        return rgb
    reduces = size[0] <= rgb.shape[1] and size[1] <= rgb.shape[0]
    method = cv2.INTER_AREA if reduces else cv2.INTER_CUBIC
    image: U8 = cv2.resize(rgb, size, interpolation=method).astype(np.uint8)
    return image


def pixel_values(rgb: U8, mean: F32, std: F32) -> F32:
    """(1, 3, H, W) float32 of an image (H, W, 3): (value / 255 - mean) / std, both (3,)."""
    scale = np.float32(1 / 255) / std
    image: F32 = rgb.astype(np.float32) * scale - mean / std
    return np.ascontiguousarray(image.transpose(2, 0, 1)[None])
