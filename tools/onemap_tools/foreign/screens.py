"""What televisions and laptops show.

Each returns an image (h, w, 3) uint8 RGB that is not repeated.
"""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np

from onemap_shared.geometry import U8
from onemap_tools.foreign.images import (
    abstract,
    gradient,
    ink_of,
    landscape,
    portrait,
    poster,
    random_hue,
    seascape,
)
from onemap_tools.foreign.noise import cloud, resized, tinted, to_bytes

SCREEN_SHAPE = (180, 320)  # rows, columns
WHITE, BLACK = (250, 250, 250), (20, 20, 24)


def football(rng: np.random.Generator, shape: tuple[int, int] = SCREEN_SHAPE) -> U8:
    """A match: striped pitch with lines, players of two teams, a score."""
    rows, columns = shape
    bands = (np.arange(columns) * 10 // columns) % 2
    image = np.empty((rows, columns, 3), np.uint8)
    image[:] = np.where(bands[None, :, None] == 0, (58, 132, 52), (70, 150, 60))
    image[: rows // 5] = to_bytes(rng.uniform(0.1, 0.7, (rows // 5, columns, 3)))
    middle, circle = (columns // 2, int(0.62 * rows)), (columns // 7, rows // 9)
    cv2.ellipse(image, middle, circle, 0, 0, 360, WHITE, 2, cv2.LINE_AA)
    cv2.line(image, (columns // 2, rows // 5), (columns // 2, rows), WHITE, 2)
    for player in range(14):
        x, y = int(rng.uniform(0.05, 0.95) * columns), int(rng.uniform(0.3, 0.92) * rows)
        shirt = (210, 40, 40) if player % 2 else (240, 240, 250)
        cv2.rectangle(image, (x - 3, y), (x + 3, y + 9), shirt, -1)
        cv2.rectangle(image, (x - 3, y + 9), (x + 3, y + 15), (30, 30, 60), -1)
        cv2.circle(image, (x, y - 3), 3, (205, 160, 130), -1)
    cv2.rectangle(image, (10, 8), (96, 24), (20, 22, 60), -1)
    cv2.putText(image, "2 : 1", (26, 21), cv2.FONT_HERSHEY_SIMPLEX, 0.45, WHITE, 1, cv2.LINE_AA)
    return image


def news(rng: np.random.Generator, shape: tuple[int, int] = SCREEN_SHAPE) -> U8:
    """A speaker in a studio with a banner and a ticker."""
    rows, columns = shape
    image: U8 = portrait(rng, shape).copy()
    image[:, : columns // 4] = landscape(rng, (rows, columns // 4))
    image[int(0.78 * rows) : int(0.92 * rows)] = ink_of((0.7, 0.08, 0.1))
    image[int(0.92 * rows) :] = (240, 240, 240)
    banner, ticker = (columns // 16, int(0.89 * rows)), (4, int(0.985 * rows))
    font, small = cv2.FONT_HERSHEY_DUPLEX, cv2.FONT_HERSHEY_PLAIN
    cv2.putText(image, "BREAKING NEWS", banner, font, 0.6, WHITE, 1, cv2.LINE_AA)
    cv2.putText(image, "markets weather sport politics culture", ticker, small, 0.8, BLACK, 1)
    return image


def menu(rng: np.random.Generator, shape: tuple[int, int] = SCREEN_SHAPE) -> U8:
    """A streaming menu: rows of small pictures on black."""
    rows, columns = shape
    image = np.full((rows, columns, 3), 16, np.uint8)
    makers = (landscape, abstract, seascape, poster)
    for row in range(3):
        for column in range(5):
            tile = makers[int(rng.integers(4))](rng, (rows // 4, columns // 6))
            y, x = 8 + row * (rows // 3), 8 + column * (columns // 5)
            place = image[y : y + rows // 4, x : x + columns // 6]
            place[:] = tile[: place.shape[0], : place.shape[1]]
    cv2.rectangle(image, (6, 6), (9 + columns // 6, 9 + rows // 4), WHITE, 2)
    return image


def cartoon(rng: np.random.Generator, shape: tuple[int, int] = SCREEN_SHAPE) -> U8:
    """A round creature on a meadow."""
    rows, columns = shape
    image = gradient(rows, columns, (0.4, 0.75, 1.0), (0.8, 0.95, 1.0))
    hill = (columns // 2, int(1.2 * rows))
    cv2.ellipse(image, hill, (columns, rows // 2), 0, 0, 360, (110, 200, 70), -1, cv2.LINE_AA)
    x, y = int(rng.uniform(0.35, 0.65) * columns), int(0.55 * rows)
    body = ink_of(random_hue(rng, 0.8, 0.95))
    cv2.circle(image, (x, y), rows // 4, body, -1, cv2.LINE_AA)
    for side in (-1, 1):
        eye = (x + side * rows // 11, y - rows // 14)
        cv2.circle(image, eye, rows // 18, WHITE, -1, cv2.LINE_AA)
        cv2.circle(image, eye, rows // 40, BLACK, -1, cv2.LINE_AA)
    mouth, size = (x, y + rows // 14), (rows // 9, rows // 14)
    cv2.ellipse(image, mouth, size, 0, 0, 180, (130, 20, 40), -1, cv2.LINE_AA)
    return image


def desktop(rng: np.random.Generator, shape: tuple[int, int] = SCREEN_SHAPE) -> U8:
    """Windows with text before a background picture, a bar of icons below."""
    rows, columns = shape
    image: U8 = landscape(rng, shape).copy()
    for window in range(2):
        x, y = columns // 12 + window * columns // 3, rows // 10 + window * rows // 6
        cv2.rectangle(image, (x, y), (x + columns // 2, y + rows // 2), WHITE, -1)
        cv2.rectangle(image, (x, y), (x + columns // 2, y + rows // 14), (60, 64, 78), -1)
        for line in range(8):
            at = y + rows // 9 + line * rows // 20
            end = x + 8 + int(rng.uniform(0.2, 0.9) * columns / 2) - 12
            cv2.line(image, (x + 8, at), (end, at), ink_of(random_hue(rng, 0.5, 0.5)), 2)
    image[-rows // 12 :] = (34, 36, 44)
    return image


def switched_off(rng: np.random.Generator, shape: tuple[int, int] = SCREEN_SHAPE) -> U8:
    """A dark screen with a faint reflection of the room."""
    value = np.clip(0.1 + 0.1 * cloud(rng, 2, 2), 0, 1)
    image = tinted(value, (0.015, 0.016, 0.02), (0.16, 0.17, 0.2))
    return resized(image, *shape)


SCREENS: tuple[Callable[..., U8], ...] = (
    football, news, menu, cartoon, landscape, seascape, switched_off, desktop,
)  # fmt: skip
