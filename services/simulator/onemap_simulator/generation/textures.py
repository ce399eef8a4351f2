"""Procedural textures: (h, w, 3) uint8 RGB images of a family, in two given colours."""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np
from numpy.typing import ArrayLike

from onemap_shared.geometry import F32, U8

SIZE = 64  # pixels: finer detail vanishes in a 320 x 240 image anyway
_RAMP = np.arange(SIZE, dtype=np.float32) / SIZE
_U, _V = np.meshgrid(_RAMP, _RAMP)


def texture(family: str, rng: np.random.Generator, colours: ArrayLike) -> U8:
    """One image (64, 64, 3) of the family between two colours (2, 3), RGB 0 to 1.

    Each family gives a weight (64, 64) in 0 to 1 that mixes the colours; fine noise is
    added, because no real surface is uniform.
    """
    first, second = np.asarray(colours, dtype=np.float32)
    weight = np.clip(np.asarray(_FAMILIES[family](rng), np.float32), 0.0, 1.0)[..., None]
    grain = rng.normal(0.0, 0.015, (SIZE, SIZE, 1)).astype(np.float32)
    return to_image(first * (1 - weight) + second * weight + grain)


def to_image(rgb: ArrayLike) -> U8:
    """uint8 image from RGB values, clipped to 0 to 1."""
    image: U8 = (np.clip(np.asarray(rgb), 0.0, 1.0) * 255 + 0.5).astype(np.uint8)
    return image


def smooth_noise(rng: np.random.Generator, cells: tuple[int, int], size: int = SIZE) -> F32:
    """Noise (size, size) in 0 to 1 with about ``cells`` (rows, columns) bumps, repeating."""
    coarse = rng.random(cells, dtype=np.float32)
    wrapped = np.pad(coarse, 1, mode="wrap")
    rows, columns = size // cells[0], size // cells[1]
    shape = ((cells[1] + 2) * columns, (cells[0] + 2) * rows)
    fine = cv2.resize(wrapped, shape, interpolation=cv2.INTER_LINEAR).astype(np.float32)
    fine = fine[rows : rows + size, columns : columns + size]
    return np.asarray(cv2.resize(fine, (size, size)), dtype=np.float32)


def _mixed(*noises: tuple[float, int, int]) -> Callable[[np.random.Generator], ArrayLike]:
    """A family that is a sum of noises: share, rows and columns of bumps."""

    def weight(rng: np.random.Generator) -> ArrayLike:
        return sum((share * smooth_noise(rng, (r, c)) for share, r, c in noises), np.float32(0))

    return weight


def _wood(rng: np.random.Generator) -> ArrayLike:
    bend = smooth_noise(rng, (2, 8)) + 0.5 * smooth_noise(rng, (4, 16))
    rings = 0.5 + 0.5 * np.sin(2 * np.pi * (_U * int(rng.integers(4, 9)) + bend))
    return 0.6 * rings + 0.4 * smooth_noise(rng, (4, 64))


def _burl(rng: np.random.Generator) -> ArrayLike:
    swirl = smooth_noise(rng, (4, 4)) + 0.5 * smooth_noise(rng, (8, 8))
    weight: F32 = 0.5 + 0.5 * np.sin(swirl * 18)
    return weight


def _planks(rng: np.random.Generator) -> ArrayLike:
    count = int(rng.integers(4, 7))
    lane = np.floor(_U * count).astype(int)
    shift = rng.random(count)[lane]
    tone = rng.random((count, 2))[lane, (np.floor(_V * 2 + shift) % 2).astype(int)]
    seam = (_U * count % 1 < 0.06) | ((_V + shift / 2) % 0.5 < 0.012)
    return np.where(seam, 1.0, 0.45 * tone + 0.35 * smooth_noise(rng, (4, 64)))


def _weave(rng: np.random.Generator) -> ArrayLike:
    count = int(rng.integers(10, 20))
    threads = np.sin(2 * np.pi * count * _U) * np.sin(2 * np.pi * count * _V)
    return 0.5 + 0.4 * threads + 0.2 * (smooth_noise(rng, (8, 8)) - 0.5)


def _stripes(rng: np.random.Generator) -> ArrayLike:
    along = _U if rng.random() < 0.7 else _V
    count, share = int(rng.integers(3, 9)), rng.uniform(0.25, 0.75)
    return (along * count) % 1 < share


def _checks(rng: np.random.Generator) -> ArrayLike:
    count = int(rng.integers(2, 6))
    if rng.random() < 0.5:
        return (np.floor(_U * 2 * count) + np.floor(_V * 2 * count)) % 2
    weight: F32 = 0.5 * ((_U * count) % 1 < 0.5) + 0.5 * ((_V * count) % 1 < 0.5)
    return weight


def _tiles(rng: np.random.Generator) -> ArrayLike:
    count = int(rng.integers(3, 6))
    tone = rng.random((count, count))[np.int64(_V * count), np.int64(_U * count)]
    joint = (_U * count % 1 < 0.05) | (_V * count % 1 < 0.05)
    return np.where(joint, 1.0, 0.25 * tone)


def _leather(rng: np.random.Generator) -> ArrayLike:
    weight: F32 = 0.35 * (smooth_noise(rng, (32, 32)) > 0.72) + 0.25 * smooth_noise(rng, (4, 4))
    return weight


def _marble(rng: np.random.Generator) -> ArrayLike:
    veins = np.abs(np.sin(np.pi * (_U + _V) * 2 + 6 * smooth_noise(rng, (4, 4))))
    weight: F32 = (1 - veins) ** 4 + 0.1 * smooth_noise(rng, (16, 16))
    return weight


def _dots(rng: np.random.Generator) -> ArrayLike:
    count, radius = int(rng.integers(3, 7)), rng.uniform(0.2, 0.38)
    return np.hypot(_U * count % 1 - 0.5, _V * count % 1 - 0.5) < radius


def _zigzag(rng: np.random.Generator) -> ArrayLike:
    count = int(rng.integers(3, 6))
    return (_V * count + np.abs(_U * count % 1 - 0.5)) % 1 < 0.5


def _herringbone(rng: np.random.Generator) -> ArrayLike:
    columns = int(rng.integers(2, 5)) * 2
    lean = np.where(np.floor(_U * columns) % 2 == 0, _U, -_U)
    tone = rng.random(64)[np.floor((_V + lean) * 12).astype(int) % 12]
    weight: F32 = 0.8 * tone + 0.2 * (_U * columns % 1 < 0.06)
    return weight


def _terrazzo(rng: np.random.Generator) -> ArrayLike:
    chips = smooth_noise(rng, (16, 16))
    weight: F32 = 0.9 * (chips > 0.65) + 0.5 * (chips < 0.3)
    return weight


_FAMILIES: dict[str, Callable[[np.random.Generator], ArrayLike]] = {
    "plain": _mixed((0.12, 4, 4)),
    "noise": _mixed((0.5, 8, 8), (0.5, 32, 32)),
    "plaster": _mixed((0.25, 16, 16), (0.15, 64, 64)),
    "brushed": _mixed((0.5, 64, 2), (0.2, 2, 4)),
    "wood": _wood,
    "burl": _burl,
    "planks": _planks,
    "weave": _weave,
    "stripes": _stripes,
    "checks": _checks,
    "tiles": _tiles,
    "leather": _leather,
    "marble": _marble,
    "dots": _dots,
    "zigzag": _zigzag,
    "herringbone": _herringbone,
    "terrazzo": _terrazzo,
}
