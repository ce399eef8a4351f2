"""Procedural textures: (h, w, 3) uint8 RGB images of a family, in two given colours."""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np
from numpy.typing import ArrayLike

from onemap_shared.geometry import F32, U8

SIZE = 64  # pixels: finer detail vanishes in a 320 x 240 image anyway


def texture(family: str, rng: np.random.Generator, colours: ArrayLike) -> U8:
    """One image (64, 64, 3) of the family between two colours (2, 3), RGB 0 to 1.

    Each family gives a weight (64, 64) in 0 to 1 that mixes the colours; fine noise is
    added, because no real surface is uniform.
    """
    first, second = np.asarray(colours, dtype=np.float32)
    weight = np.clip(FAMILIES[family](rng), 0.0, 1.0)[..., None]
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


def _axes() -> tuple[F32, F32]:
    ramp = np.arange(SIZE, dtype=np.float32) / SIZE
    u, v = np.meshgrid(ramp, ramp)
    return _weight(u), _weight(v)


def _weight(values: ArrayLike) -> F32:
    return np.asarray(values, dtype=np.float32)


def _plain(rng: np.random.Generator) -> F32:
    return _weight(0.12 * smooth_noise(rng, (4, 4)))


def _noise(rng: np.random.Generator) -> F32:
    return _weight(0.5 * smooth_noise(rng, (8, 8)) + 0.5 * smooth_noise(rng, (32, 32)))


def _plaster(rng: np.random.Generator) -> F32:
    return _weight(0.25 * smooth_noise(rng, (16, 16)) + 0.15 * smooth_noise(rng, (64, 64)))


def _wood(rng: np.random.Generator) -> F32:
    u, _ = _axes()
    bend = smooth_noise(rng, (2, 8)) + 0.5 * smooth_noise(rng, (4, 16))
    rings = 0.5 + 0.5 * np.sin(2 * np.pi * (u * int(rng.integers(4, 9)) + bend))
    return _weight(0.6 * rings + 0.4 * smooth_noise(rng, (4, 64)))


def _burl(rng: np.random.Generator) -> F32:
    swirl = smooth_noise(rng, (4, 4)) + 0.5 * smooth_noise(rng, (8, 8))
    return _weight(0.5 + 0.5 * np.sin(swirl * 18))


def _planks(rng: np.random.Generator) -> F32:
    u, v = _axes()
    count = int(rng.integers(4, 7))
    lane = np.floor(u * count).astype(int)
    shift = rng.random(count)[lane]
    tone = rng.random((count, 2))[lane, (np.floor(v * 2 + shift) % 2).astype(int)]
    seam = (u * count % 1 < 0.06) | ((v + shift / 2) % 0.5 < 0.012)
    grain = smooth_noise(rng, (4, 64))
    return _weight(np.where(seam, 1.0, 0.45 * tone + 0.35 * grain))


def _weave(rng: np.random.Generator) -> F32:
    u, v = _axes()
    count = int(rng.integers(10, 20))
    threads = np.sin(2 * np.pi * count * u) * np.sin(2 * np.pi * count * v)
    return _weight(0.5 + 0.4 * threads + 0.2 * (smooth_noise(rng, (8, 8)) - 0.5))


def _stripes(rng: np.random.Generator) -> F32:
    u, v = _axes()
    along = u if rng.random() < 0.7 else v
    count, share = int(rng.integers(3, 9)), rng.uniform(0.25, 0.75)
    return _weight((along * count) % 1 < share)


def _checks(rng: np.random.Generator) -> F32:
    u, v = _axes()
    count = int(rng.integers(2, 6))
    if rng.random() < 0.5:
        return _weight((np.floor(u * 2 * count) + np.floor(v * 2 * count)) % 2)
    return _weight(0.5 * ((u * count) % 1 < 0.5) + 0.5 * ((v * count) % 1 < 0.5))


def _tiles(rng: np.random.Generator) -> F32:
    u, v = _axes()
    count = int(rng.integers(3, 6))
    tone = rng.random((count, count))[np.int64(v * count), np.int64(u * count)]
    joint = (u * count % 1 < 0.05) | (v * count % 1 < 0.05)
    return _weight(np.where(joint, 1.0, 0.25 * tone))


def _brushed(rng: np.random.Generator) -> F32:
    return _weight(0.5 * smooth_noise(rng, (64, 2)) + 0.2 * smooth_noise(rng, (2, 4)))


def _leather(rng: np.random.Generator) -> F32:
    return _weight((smooth_noise(rng, (32, 32)) > 0.72) * 0.35 + 0.25 * smooth_noise(rng, (4, 4)))


def _marble(rng: np.random.Generator) -> F32:
    u, v = _axes()
    veins = np.abs(np.sin(np.pi * (u + v) * 2 + 6 * smooth_noise(rng, (4, 4))))
    return _weight((1 - veins) ** 4 + 0.1 * smooth_noise(rng, (16, 16)))


def _dots(rng: np.random.Generator) -> F32:
    u, v = _axes()
    count, radius = int(rng.integers(3, 7)), rng.uniform(0.2, 0.38)
    return _weight(np.hypot(u * count % 1 - 0.5, v * count % 1 - 0.5) < radius)


def _zigzag(rng: np.random.Generator) -> F32:
    u, v = _axes()
    count = int(rng.integers(3, 6))
    return _weight((v * count + np.abs(u * count % 1 - 0.5)) % 1 < 0.5)


def _herringbone(rng: np.random.Generator) -> F32:
    u, v = _axes()
    columns = int(rng.integers(2, 5)) * 2
    lean = np.where(np.floor(u * columns) % 2 == 0, u, -u)
    slat = np.floor((v + lean) * 12)
    tone = rng.random(64)[slat.astype(int) % 12]
    return _weight(0.8 * tone + 0.2 * (u * columns % 1 < 0.06))


def _terrazzo(rng: np.random.Generator) -> F32:
    chips = smooth_noise(rng, (16, 16))
    return _weight((chips > 0.65) * 0.9 + (chips < 0.3) * 0.5)


FAMILIES: dict[str, Callable[[np.random.Generator], F32]] = {
    "plain": _plain,
    "noise": _noise,
    "plaster": _plaster,
    "wood": _wood,
    "burl": _burl,
    "planks": _planks,
    "weave": _weave,
    "stripes": _stripes,
    "checks": _checks,
    "tiles": _tiles,
    "brushed": _brushed,
    "leather": _leather,
    "marble": _marble,
    "dots": _dots,
    "zigzag": _zigzag,
    "herringbone": _herringbone,
    "terrazzo": _terrazzo,
}
