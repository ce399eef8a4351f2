"""Repeating textures of unlike statistics, in colours of any kind: what a part may be made of.

The families of TRAINING and of VALIDATION are disjoint, and none is one of the simulator's
held-out style (``onemap_simulator.generation.style``).
"""

from __future__ import annotations

import colorsys
from collections.abc import Callable

import cv2
import numpy as np

from onemap_shared.geometry import F32, U8

SIZE = 128  # texels: on a metre of surface 8 mm, a pixel of a 320 x 240 image from 2 m


def surface(family: str, rng: np.random.Generator) -> U8:
    """One texture (128, 128, 3) uint8 RGB of the family; repeats in both directions."""
    height = FAMILIES[family](rng)
    ramp = palette(rng)
    at = np.clip(height, 0, 1) * (len(ramp) - 1)
    low = np.minimum(at.astype(np.int32), len(ramp) - 2)
    part = (at - low)[..., None]
    mixed = ramp[low] * (1 - part) + ramp[low + 1] * part
    image: U8 = (np.clip(mixed, 0, 1) * 255).astype(np.uint8)
    return image


def palette(rng: np.random.Generator) -> F32:
    """Two to four colours (n, 3) in 0 to 1: shades of one, or several, pale, dark or vivid."""
    count = int(rng.integers(2, 5))
    hue, saturation, value = rng.random(), rng.random() ** 2.5, rng.uniform(0.08, 1.0)
    spread = 0.5 if rng.random() < 0.3 else 0.04
    contrast = rng.uniform(0.05, 0.6)
    rows = []
    for _ in range(count):
        tone = float(np.clip(value + contrast * rng.uniform(-1, 1), 0.02, 1))
        tint = float(np.clip(saturation + rng.uniform(-0.15, 0.15), 0, 1))
        rows.append(colorsys.hsv_to_rgb((hue + spread * rng.uniform(-1, 1)) % 1, tint, tone))
    return np.array(rows, np.float32)


def fractal(
    rng: np.random.Generator, power: float, stretch: tuple[float, float] = (1.0, 1.0)
) -> F32:
    """Periodic noise (128, 128) in 0 to 1 whose amplitude falls as frequency to minus ``power``.

    stretch: factor of the frequencies along rows and columns; (1, 8) gives grain along u.
    """
    v, u = np.fft.fftfreq(SIZE)[:, None] * SIZE, np.fft.rfftfreq(SIZE)[None] * SIZE
    radius = np.hypot(v * stretch[0], u * stretch[1])
    radius[0, 0] = 1
    phases = np.exp(2j * np.pi * rng.random(radius.shape))
    spectrum = phases * radius**-power
    spectrum[0, 0] = 0
    noise = np.fft.irfft2(spectrum, s=(SIZE, SIZE)).astype(np.float32)
    low, high = np.percentile(noise, (1, 99))
    result: F32 = np.clip((noise - low) / max(float(high - low), 1e-9), 0, 1)
    return result


def _axes() -> tuple[F32, F32]:
    ramp = np.arange(SIZE, dtype=np.float32) / SIZE
    u, v = np.meshgrid(ramp, ramp)
    return np.asarray(u, np.float32), np.asarray(v, np.float32)


def _even(rng: np.random.Generator) -> F32:
    tone, relief = np.float32(rng.random()), np.float32(rng.uniform(0, 0.15))
    return np.asarray(tone + relief * fractal(rng, 2.0))


def _cloudy(rng: np.random.Generator) -> F32:
    return fractal(rng, rng.uniform(0.4, 2.2))


def _grain(rng: np.random.Generator) -> F32:
    along, across = rng.uniform(4, 20), 1.0
    stretch = (along, across) if rng.random() < 0.5 else (across, along)
    return fractal(rng, rng.uniform(0.6, 1.6), stretch)


def _veins(rng: np.random.Generator) -> F32:
    u, v = _axes()
    waves = rng.integers(1, 4, 2)
    bent = waves[0] * u + waves[1] * v + rng.uniform(0.3, 1.5) * fractal(rng, 2.0)
    veins: F32 = (1 - np.abs(np.sin(np.pi * bent))) ** np.float32(rng.uniform(1, 6))
    return veins


def _bands(rng: np.random.Generator) -> F32:
    """Stripes of random widths and tones."""
    count = int(rng.integers(2, 16))
    edges = np.sort(rng.random(count))
    tones = rng.random(count + 1).astype(np.float32)
    tones[-1] = tones[0]
    u, v = _axes()
    along = u if rng.random() < 0.5 else v
    return np.asarray(tones[np.searchsorted(edges, along)])


def _tiles(rng: np.random.Generator) -> F32:
    """A chessboard or random tones, with or without joints."""
    u, v = _axes()
    rows, columns = (2 * int(n) for n in rng.integers(1, 7, 2))
    row, column = (v * rows).astype(int), (u * columns).astype(int)
    if rng.random() < 0.4:
        tone = ((row + column) % 2).astype(np.float32)
    else:
        tone = rng.random((rows, columns), dtype=np.float32)[row, column]
    if rng.random() < 0.6:
        joint = rng.uniform(0.02, 0.12)
        seam = (v * rows % 1 < joint) | (u * columns % 1 < joint)
        tone = np.where(seam, np.float32(rng.random()), tone)
    return np.asarray(tone)


def _specks(rng: np.random.Generator) -> F32:
    noise = fractal(rng, rng.uniform(0.2, 1.4))
    ground: F32 = (noise > rng.uniform(0.3, 0.8)).astype(np.float32)
    return np.asarray(ground * np.float32(rng.uniform(0.3, 1)) + np.float32(0.1) * noise)


def _cells(rng: np.random.Generator) -> F32:
    """Areas around random points, each of one tone, or its distance from the point."""
    count = int(rng.integers(6, 40))
    seeds = rng.integers(0, SIZE, (count, 2))
    ground = np.ones((3 * SIZE, 3 * SIZE), np.uint8)
    for shift in np.ndindex(3, 3):
        ground[seeds[:, 0] + shift[0] * SIZE, seeds[:, 1] + shift[1] * SIZE] = 0
    distance, owner = cv2.distanceTransformWithLabels(
        ground, cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL
    )
    middle = np.s_[SIZE : 2 * SIZE, SIZE : 2 * SIZE]
    if rng.random() < 0.4:
        apart: F32 = np.asarray(distance[middle], np.float32)
        return apart / max(float(apart.max()), 1e-6)
    # Labels count the copies row by row: the tone belongs to the point that was copied.
    at = np.zeros(int(owner.max()) + 1, np.int64)
    zeros = np.argwhere(ground == 0)
    at[owner[zeros[:, 0], zeros[:, 1]]] = (zeros[:, 0] % SIZE) * SIZE + zeros[:, 1] % SIZE
    tones = rng.random(SIZE * SIZE, dtype=np.float32)
    cells: F32 = tones[at[owner[middle]]]
    return cells


def _strokes(rng: np.random.Generator) -> F32:
    """Short lines or leaves scattered on an even ground."""
    image = np.full((SIZE, SIZE), float(rng.random()), np.float32)
    tones = rng.random(3)
    for _ in range(int(rng.integers(8, 40))):
        centre = rng.integers(0, SIZE, 2)
        axes = (int(rng.integers(3, 16)), int(rng.integers(1, 6)))
        angle, tone = float(rng.uniform(0, 180)), float(rng.choice(tones))
        for shift in np.ndindex(3, 3):
            at = (int(centre[0]) + (shift[0] - 1) * SIZE, int(centre[1]) + (shift[1] - 1) * SIZE)
            cv2.ellipse(image, at, axes, angle, 0, 360, tone, -1, cv2.LINE_AA)
    return image


def _bricks(rng: np.random.Generator) -> F32:
    u, v = _axes()
    rows, columns = 2 * int(rng.integers(3, 9)), int(rng.integers(2, 6))
    row = (v * rows).astype(int)
    shifted = u * columns + 0.5 * (row % 2)
    tone = rng.random((rows, columns), dtype=np.float32)[row, shifted.astype(int) % columns]
    joint = (v * rows % 1 < 0.1) | (shifted % 1 < 0.05)
    return np.asarray(np.where(joint, np.float32(1), np.float32(0.7) * tone))


def _plaid(rng: np.random.Generator) -> F32:
    u, v = _axes()
    total = np.zeros((SIZE, SIZE), np.float32)
    for axis in (u, v):
        for _ in range(3):
            count = int(rng.integers(1, 9))
            total += np.float32(rng.random()) * (axis * count % 1 < rng.uniform(0.1, 0.6))
    return np.asarray(total / np.float32(max(float(total.max()), 1e-6)))


def _quasi(rng: np.random.Generator) -> F32:
    """Plane waves in several directions."""
    u, v = _axes()
    waves = rng.integers(-9, 10, (5, 2))
    total = sum(
        np.sin(2 * np.pi * (a * u + b * v + phase))
        for (a, b), phase in zip(waves, rng.random(5), strict=True)
    )
    return np.asarray(0.5 + 0.15 * total, np.float32)


def _strata(rng: np.random.Generator) -> F32:
    """Level lines of noise, in steps."""
    levels = int(rng.integers(3, 9))
    steps = np.floor(fractal(rng, rng.uniform(1.4, 2.4)) * np.float32(levels))
    return np.asarray(steps / np.float32(levels))


FAMILIES: dict[str, Callable[[np.random.Generator], F32]] = {
    "even": _even,
    "cloudy": _cloudy,
    "grain": _grain,
    "veins": _veins,
    "bands": _bands,
    "tiles": _tiles,
    "specks": _specks,
    "cells": _cells,
    "strokes": _strokes,
    "bricks": _bricks,
    "plaid": _plaid,
    "quasi": _quasi,
    "strata": _strata,
}
# Plain surfaces are the most frequent in homes, hence several times.
TRAINING = (
    *("even",) * 4,
    *("grain",) * 2,
    *("cloudy",) * 2,
    *("veins", "bands", "tiles", "specks", "cells", "strokes"),
)
VALIDATION = ("bricks", "plaid", "quasi", *("strata",) * 2)
