"""Smooth random fields that repeat at their borders: the ground of all textures."""

from __future__ import annotations

import cv2
import numpy as np

from onemap_shared.geometry import F32, F64, U8

PX = 256  # side of a texture: 4 mm on a metre


def waves(rng: np.random.Generator, rows: int, columns: int, size: int = PX) -> F32:
    """One octave: (size, size) float32 about 0, of ``rows`` x ``columns`` random values."""
    values = rng.standard_normal((rows, columns)).astype(np.float32)
    padded = np.pad(values, 2, mode="wrap")
    scale_y, scale_x = size // rows, size // columns
    large = cv2.resize(padded, None, fx=scale_x, fy=scale_y, interpolation=cv2.INTER_CUBIC)
    inner = large[2 * scale_y :, 2 * scale_x :][: rows * scale_y, : columns * scale_x]
    return np.asarray(cv2.resize(inner, (size, size)), np.float32)


def cloud(rng: np.random.Generator, cells: int = 4, octaves: int = 4, size: int = PX) -> F32:
    """Octaves of halved strength: (size, size) float32 about 0 with a deviation near 1."""
    total = np.zeros((size, size), np.float32)
    for octave in range(octaves):
        count = min(cells * 2**octave, size // 2)
        total += waves(rng, count, count, size) * np.float32(0.5**octave)
    return total


def tinted(
    value: F32 | F64, dark: tuple[float, float, float], light: tuple[float, float, float]
) -> U8:
    """Values (h, w), 0 to 1, between two colours of 0 to 1: (h, w, 3) uint8."""
    t = np.clip(value, 0, 1)[..., None]
    colours = np.array(dark) * (1 - t) + np.array(light) * t
    return to_bytes(colours)


def to_bytes(colours: np.ndarray) -> U8:
    """Colours of 0 to 1 as bytes."""
    result: U8 = (np.clip(colours, 0, 1) * 255 + 0.5).astype(np.uint8)
    return result


def resized(image: U8, rows: int, columns: int) -> U8:
    """A copy of the image in another size."""
    return np.array(cv2.resize(image, (columns, rows)), np.uint8)
