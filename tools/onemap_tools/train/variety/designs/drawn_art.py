"""Paintings, prints and posters drawn in code: (h, w, 3) uint8 RGB of the frame's proportions."""

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
SIDE = 112  # texels of the longer side


def artwork(rng: Rng, width: float, height: float) -> U8:
    """A picture of the proportions of ``width`` to ``height``, sometimes with a paper mount."""
    scale = SIDE / max(width, height)
    shape = (max(int(height * scale), 24), max(int(width * scale), 24))
    if rng.random() < 0.2:
        image = np.asarray(cv2.resize(photograph(rng), shape[::-1]) / 255, np.float32)
    else:
        image = KINDS[int(rng.integers(len(KINDS)))](rng, shape)
    if rng.random() < 0.15:
        image[:] = image.mean(axis=2, keepdims=True)
    return to_image(image + rng.normal(0, 0.012, (*shape, 1)))


def mounted(rng: Rng, image: U8, share: float) -> U8:
    """The image within a plain paper mount whose margin is a share of the shorter side."""
    high, wide = image.shape[:2]
    margin = int(min(high, wide) * share)
    result = np.full_like(image, int(rng.uniform(190, 250)))
    inner = (wide - 2 * margin, high - 2 * margin)
    result[margin : margin + inner[1], margin : margin + inner[0]] = cv2.resize(image, inner)
    return result


def _colour(rng: Rng) -> tuple[float, float, float]:
    r, g, b = map(float, rng.random(3))
    return r, g, b


def _ground(rng: Rng, shape: tuple[int, int], low: float = 0.0) -> Image:
    image = np.empty((*shape, 3), np.float32)
    image[:] = rng.uniform(low, 1, 3)
    image += 0.12 * (cv2.resize(smooth_noise(rng, (6, 6)), shape[::-1])[..., None] - 0.5)
    return image


def _sea(rng: Rng, shape: tuple[int, int]) -> Image:
    """A horizon over water with a low sun and its glitter, or hills."""
    high, wide = shape
    down = np.linspace(0, 1, high)[:, None, None]
    first, second, third = rng.uniform(0.2, 1, (3, 3))
    image = np.zeros((high, wide, 3), np.float32)
    image[:] = first * (1 - down) + second * down
    line = int(high * rng.uniform(0.4, 0.7))
    image[line:] = third * 0.7
    x = int(rng.uniform(0.2, 0.8) * wide)
    cv2.circle(image, (x, line - high // 8), high // 12 + 1, (1.0, 0.9, 0.6), -1, cv2.LINE_AA)
    for _ in range(30):
        y, left = int(rng.integers(line, high)), x + int(rng.normal(0, wide / 8))
        cv2.line(image, (left, y), (left + wide // 12, y), (0.95, 0.9, 0.75), 1)
    if rng.random() < 0.5:
        crest = np.interp(np.arange(wide), np.linspace(0, wide, 7), rng.uniform(0, high / 4, 7))
        rows = np.arange(high)[:, None]
        image[(rows > line - crest) & (rows < line + 1)] = second * 0.4
    return image


def _portrait(rng: Rng, shape: tuple[int, int]) -> Image:
    """An old portrait: shoulders, head and hair in the dark."""
    image = _ground(rng, shape)
    image *= 0.5
    high, wide = shape
    r, x, y = min(shape) // 6, wide // 2, int(high * 0.4)
    skin = np.array([0.9, 0.7, 0.55]) * rng.uniform(0.5, 1.05)
    tone = (float(skin[0]), float(skin[1]), float(skin[2]))
    cv2.ellipse(image, (x, y + 4 * r), (int(2.4 * r), 3 * r), 0, 0, 360, _colour(rng), -1)
    cv2.ellipse(image, (x, y), (int(r * 1.3), int(r * 1.6)), 0, 0, 360, (0.15, 0.1, 0.07), -1)
    cv2.ellipse(image, (x, y + r // 4), (r, int(r * 1.3)), 0, 0, 360, tone, -1)
    for side in (-1, 1):
        cv2.circle(image, (x + side * r // 2, y), max(r // 7, 1), (0.1, 0.1, 0.1), -1)
    cv2.line(image, (x - r // 3, y + r), (x + r // 3, y + r), (0.6, 0.2, 0.2), 1)
    return image


def _grid(rng: Rng, shape: tuple[int, int]) -> Image:
    """Coloured rectangles between black bars."""
    image = np.full((*shape, 3), 0.95, np.float32)
    xs = np.sort(rng.integers(0, shape[1], int(rng.integers(2, 6))))
    ys = np.sort(rng.integers(0, shape[0], int(rng.integers(2, 6))))
    for _ in range(int(rng.integers(3, 7))):
        a, b = np.sort(rng.choice(np.append(xs, (0, shape[1])), 2))
        c, d = np.sort(rng.choice(np.append(ys, (0, shape[0])), 2))
        image[c:d, a:b] = rng.random(3)
    for x in xs:
        image[:, x : x + 3] = 0.05
    for y in ys:
        image[y : y + 3] = 0.05
    return image


def _flowers(rng: Rng, shape: tuple[int, int]) -> Image:
    """Flowers on stalks, from a vase or the lower edge."""
    image = _ground(rng, shape, 0.3)
    high, wide = shape
    root = (wide // 2, int(high * 0.75))
    petals, heart = _colour(rng), _colour(rng)
    for _ in range(int(rng.integers(3, 9))):
        at = (int(rng.uniform(0.15, 0.85) * wide), int(rng.uniform(0.1, 0.55) * high))
        cv2.line(image, root, at, (0.15, 0.4, 0.15), 2, cv2.LINE_AA)
        r = min(shape) // 14 + 1
        for angle in np.linspace(0, 2 * np.pi, 6, endpoint=False):
            petal = (at[0] + int(r * np.cos(angle)), at[1] + int(r * np.sin(angle)))
            cv2.circle(image, petal, r, petals, -1, cv2.LINE_AA)
        cv2.circle(image, at, r, heart, -1, cv2.LINE_AA)
    if rng.random() < 0.6:
        cv2.ellipse(
            image, (wide // 2, int(high * 0.85)), (wide // 8, high // 7), 0, 0, 360, heart, -1
        )
    return image


def _strokes(rng: Rng, shape: tuple[int, int]) -> Image:
    """Wide brush strokes or drips."""
    image = _ground(rng, shape, 0.4)
    for _ in range(int(rng.integers(4, 30))):
        points = (rng.random((4, 2)) * shape[::-1]).astype(np.int32)
        thick = int(rng.integers(1, 10))
        cv2.polylines(image, [points], False, _colour(rng), thick, cv2.LINE_AA)
    return image


def _poster(rng: Rng, shape: tuple[int, int]) -> Image:
    """A poster: large letters, a disc or bar, small lines of text."""
    image = _ground(rng, shape)
    high, wide = shape
    ink = _colour(rng)
    middle = (wide // 2, int(high * rng.uniform(0.35, 0.6)))
    if rng.random() < 0.6:
        cv2.circle(image, middle, min(shape) // 4, _colour(rng), -1, cv2.LINE_AA)
    else:
        cv2.rectangle(image, (wide // 5, high // 4), (4 * wide // 5, 3 * high // 5), ink, -1)
    word = "".join(rng.choice(list("ABEHKLMNORSTVX"), int(rng.integers(2, 6))))
    size = wide / (len(word) * 20)
    letters = np.zeros(shape, np.uint8)
    cv2.putText(letters, word, (wide // 12, high // 5), 0, size, 255, 2)
    image[letters > 0] = ink
    for row in range(int(high * 0.8), high - 4, 5):
        image[row : row + 2, wide // 8 : wide // 8 + int(rng.uniform(0.3, 0.75) * wide)] = ink
    return image


def _map(rng: Rng, shape: tuple[int, int]) -> Image:
    """A map or contours: levels of a smooth field, with a grid."""
    field = cv2.resize(smooth_noise(rng, (5, 5)), shape[::-1])
    levels = np.floor(field * int(rng.integers(3, 9))).astype(int)
    colours = rng.uniform(0.3, 1, (12, 3))
    image = np.asarray(colours[levels % 12], np.float32)
    if rng.random() < 0.5:
        image[:: shape[0] // 6] *= 0.7
        image[:, :: shape[1] // 6] *= 0.7
    return image


def _animal(rng: Rng, shape: tuple[int, int]) -> Image:
    """A child's drawing of an animal or a house under a sun."""
    image = _ground(rng, shape, 0.5)
    high, wide = shape
    x, y, r = wide // 2, int(high * 0.6), min(shape) // 5
    coat = _colour(rng)
    image[int(high * 0.8) :] = (0.3, 0.6, 0.25)
    if rng.random() < 0.5:
        for leg in (-0.9, -0.4, 0.4, 0.9):
            at = (x + int(leg * r), y)
            cv2.line(image, at, (at[0], y + int(1.3 * r)), coat, max(r // 4, 1))
        cv2.ellipse(image, (x, y), (int(1.3 * r), int(0.7 * r)), 0, 0, 360, coat, -1, cv2.LINE_AA)
        cv2.circle(image, (x + int(1.4 * r), y - r // 2), r // 2 + 1, coat, -1, cv2.LINE_AA)
    else:
        cv2.rectangle(image, (x - r, y - r // 2), (x + r, y + r), coat, -1)
        roof = np.array([(x - r - 4, y - r // 2), (x + r + 4, y - r // 2), (x, y - int(1.5 * r))])
        cv2.fillPoly(image, [roof.astype(np.int32)], _colour(rng))
        cv2.rectangle(image, (x - r // 4, y + r // 4), (x + r // 4, y + r), (0.2, 0.15, 0.1), -1)
    cv2.circle(image, (wide // 6, high // 6), r // 2 + 1, (1.0, 0.85, 0.2), -1, cv2.LINE_AA)
    return image


KINDS: tuple[Callable[[Rng, tuple[int, int]], Image], ...]
KINDS = (_sea, _portrait, _grid, _flowers, _strokes, _poster, _map, _animal)
