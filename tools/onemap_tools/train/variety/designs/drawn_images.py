"""Images drawn in code for screens and picture frames: (h, w, 3) uint8 RGB."""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np
from numpy.typing import NDArray

from onemap_shared.geometry import U8
from onemap_simulator.generation.textures import smooth_noise, to_image
from onemap_tools.train.variety.pictures import photograph

Image = NDArray[np.float32]
Rng = np.random.Generator
HIGH, WIDE = 90, 160


def switched_off(rng: Rng) -> U8:
    """A dark screen: even, a grey gradient, or the reflection of a window or a lamp."""
    rows, columns = np.mgrid[0 : 1 : HIGH * 1j, 0 : 1 : WIDE * 1j]
    value = np.full((HIGH, WIDE), rng.uniform(0.03, 0.17))
    kind = int(rng.integers(5))
    if kind == 1:
        slope = rng.uniform(-1, 1, 2)
        value += 0.2 * np.clip(slope[0] * rows + slope[1] * columns, 0, 1)
    elif kind == 2:
        left, top = rng.uniform(0.05, 0.6), rng.uniform(0.0, 0.4)
        inside = (abs(columns - left - 0.12) < 0.12) & (abs(rows - top - 0.2) < 0.2)
        value += rng.uniform(0.08, 0.3) * inside * (abs(columns - left - 0.12) > 0.01)
    elif kind == 3:
        x, y = rng.uniform(0.1, 0.9, 2)
        value += 0.5 * np.exp(-((columns - x) ** 2 * 3 + (rows - y) ** 2) / 0.01)
    elif kind == 4:
        value += 0.12 * cv2.resize(smooth_noise(rng, (3, 4)), (WIDE, HIGH))
    return to_image(value[..., None] * rng.uniform(0.85, 1.15, 3))


def shown(rng: Rng) -> U8:
    """A screen that shows a programme, a menu or a film."""
    if rng.random() < 0.25:
        return photograph(rng)
    kinds: tuple[Callable[[Rng], Image], ...]
    kinds = (_news, _landscape, _menu, _pitch, _cartoon, _bars)
    image = kinds[int(rng.integers(len(kinds)))](rng)
    return to_image(image * rng.uniform(0.6, 1.0) + rng.normal(0, 0.015, image.shape))


def desktop(rng: Rng) -> U8:
    """A laptop's screen: windows over a background, a sheet, a code editor or a film."""
    kind = int(rng.integers(5))
    if kind == 0:
        return shown(rng)
    ground = _landscape(rng) if kind == 1 else _flat(rng)
    x, y = int(rng.integers(0, 40)), int(rng.integers(0, 20))
    dark = rng.random() < 0.4
    ground[y : HIGH - y - 4, x : WIDE - x] = 0.12 if dark else 0.96
    ground[y : y + 5, x : WIDE - x] = rng.random(3)
    for row in range(y + 10, HIGH - y - 8, int(rng.integers(4, 7))):
        left = x + 4 + int(rng.integers(0, 4)) * (5 if kind == 2 else 0)
        colour = rng.uniform(0.3, 1, 3) if dark else rng.uniform(0.0, 0.5) * np.ones(3)
        ground[row : row + 2, left : min(left + int(rng.integers(15, 90)), WIDE - x - 4)] = colour
    if kind == 3:
        ground[y + 5 : HIGH - y - 4 : 6, x : WIDE - x] = 0.6
        ground[y + 5 : HIGH - y - 4, x : WIDE - x : 18] = 0.6
    ground[-4:] = rng.uniform(0.1, 0.9)
    return to_image(ground)


def _flat(rng: Rng, shape: tuple[int, int] = (HIGH, WIDE)) -> Image:
    """A gradient between two colours, downwards."""
    low, high = rng.random((2, 3))
    down = np.linspace(0, 1, shape[0])[:, None, None]
    image = np.empty((*shape, 3), np.float32)
    image[:] = low + (high - low) * down
    return image


def _colour(rng: Rng) -> tuple[float, float, float]:
    r, g, b = map(float, rng.random(3))
    return r, g, b


def _news(rng: Rng) -> Image:
    """A studio: a speaker at a desk, an inset picture, a banner with text."""
    image = _flat(rng)
    for x in range(0, WIDE, int(rng.integers(18, 40))):
        image[:, x : x + 2] *= 1.3
    x = int(rng.integers(40, 70))
    cv2.ellipse(image, (x, 84), (24, 38), 0, 0, 360, _colour(rng), -1)
    cv2.ellipse(image, (x, 34), (9, 12), 0, 0, 360, (0.85, 0.65, 0.52), -1)
    cv2.ellipse(image, (x, 27), (10, 8), 0, 180, 360, (0.2, 0.13, 0.08), -1)
    image[12:52, 95:150] = cv2.resize(_landscape(rng), (55, 40))
    cv2.rectangle(image, (0, 66), (WIDE, 82), _colour(rng), -1)
    cv2.rectangle(image, (8, 70), (int(rng.integers(60, 140)), 73), (0.95, 0.95, 0.95), -1)
    cv2.rectangle(image, (8, 76), (int(rng.integers(40, 120)), 78), (0.8, 0.8, 0.8), -1)
    return image


def _landscape(rng: Rng) -> Image:
    """Ridges below a sky with a sun."""
    image = _flat(rng)
    image[:] = image * 0.5 + 0.45
    sun = (int(rng.integers(20, 140)), int(rng.integers(10, 40)))
    cv2.circle(image, sun, int(rng.integers(4, 12)), (1.0, 0.95, 0.7), -1, cv2.LINE_AA)
    rows = np.arange(HIGH)[:, None]
    for level in range(int(rng.integers(2, 5))):
        crest = np.interp(np.arange(WIDE), np.linspace(0, WIDE, 9), rng.uniform(-12, 12, 9))
        shade = rng.uniform(0.15, 0.7, 3) * (1 - 0.15 * level)
        image[rows > crest + 38 + 13 * level] = shade
    return image


def _menu(rng: Rng) -> Image:
    """Rows of coloured tiles, one of them marked."""
    image = np.full((HIGH, WIDE, 3), rng.uniform(0.03, 0.25), np.float32)
    columns, rows = int(rng.integers(3, 7)), int(rng.integers(2, 4))
    w, h = (WIDE - 12) // columns, (HIGH - 24) // rows
    marked = int(rng.integers(columns * rows))
    for index in range(columns * rows):
        x, y = 6 + index % columns * w, 18 + index // columns * h
        if index == marked:
            cv2.rectangle(image, (x, y), (x + w - 2, y + h - 2), (1.0, 1.0, 1.0), -1)
        image[y + 2 : y + h - 4, x + 2 : x + w - 4] = rng.random(3)
        if rng.random() < 0.5:
            cv2.circle(image, (x + w // 2, y + h // 2), h // 4, _colour(rng), -1, cv2.LINE_AA)
    cv2.rectangle(image, (8, 6), (int(rng.integers(30, 80)), 11), (0.9, 0.9, 0.9), -1)
    return image


def _pitch(rng: Rng) -> Image:
    """A green field in strips with white lines, players and stands."""
    image = np.empty((HIGH, WIDE, 3), np.float32)
    image[:] = (0.15, 0.5, 0.18)
    for x in range(0, WIDE, 24):
        image[:, x : x + 12] *= 1.2
    image[:18] = cv2.resize(rng.random((9, 80, 3)).astype(np.float32), (WIDE, 18)) * 0.6
    for a, b in (((10, 24), (150, 24)), ((80, 24), (80, 90)), ((10, 24), (0, 90))):
        cv2.line(image, a, b, (0.95, 0.95, 0.95), 1, cv2.LINE_AA)
    cv2.ellipse(image, (80, 56), (26, 14), 0, 0, 360, (0.95, 0.95, 0.95), 1, cv2.LINE_AA)
    teams = (_colour(rng), _colour(rng))
    for index in range(12):
        x, y = int(rng.integers(8, 150)), int(rng.integers(28, 84))
        cv2.rectangle(image, (x, y), (x + 3, y + 7), teams[index % 2], -1)
    cv2.rectangle(image, (6, 5), (50, 11), (0.1, 0.1, 0.3), -1)
    return image


def _cartoon(rng: Rng) -> Image:
    """A round face with large eyes before a flat ground."""
    image = np.empty((HIGH, WIDE, 3), np.float32)
    image[:] = rng.uniform(0.3, 1, 3)
    x, y, size = int(rng.integers(55, 105)), int(rng.integers(42, 54)), int(rng.integers(26, 40))
    for side in (-1, 1):
        cv2.circle(image, (x + side * size, y - size // 2), size // 3, _colour(rng), -1)
    cv2.circle(image, (x, y), size, _colour(rng), -1, cv2.LINE_AA)
    for side in (-1, 1):
        eye = (x + side * size // 3, y - size // 5)
        cv2.ellipse(image, eye, (size // 4, size // 3), 0, 0, 360, (1.0, 1.0, 1.0), -1)
        cv2.circle(image, eye, size // 9 + 1, (0.05, 0.05, 0.05), -1)
    cv2.ellipse(image, (x, y + size // 3), (size // 2, size // 4), 0, 0, 180, (0.6, 0.1, 0.1), -1)
    return image


def _bars(rng: Rng) -> Image:
    """Test bars, or snow."""
    if rng.random() < 0.3:
        snow = cv2.resize(rng.random((45, 80)), (WIDE, HIGH))
        return np.repeat(snow[..., None], 3, axis=2).astype(np.float32)
    colours = [(1, 1, 1), (1, 1, 0), (0, 1, 1), (0, 1, 0), (1, 0, 1), (1, 0, 0), (0, 0, 1)]
    image = np.zeros((HIGH, WIDE, 3), np.float32)
    for index, colour in enumerate(colours):
        image[:, index * WIDE // 7 :] = np.array(colour) * 0.8
    image[70:] = np.linspace(0, 1, WIDE)[None, :, None]
    return image
