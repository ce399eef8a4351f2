"""Pictures made in code: paintings, photographs, what screens show, views from windows.

Each returns an image (h, w, 3) uint8 RGB that is not repeated.
"""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np

from onemap_shared.geometry import U8
from onemap_tools.foreign.noise import PX, cloud, resized, tinted, to_bytes
from onemap_tools.foreign.textures import Colour, mix, shade


def ink_of(colour: Colour) -> tuple[int, int, int]:
    """The colour as OpenCV draws it."""
    red, green, blue = (int(255 * c) for c in colour)
    return red, green, blue


def random_hue(rng: np.random.Generator, saturation: float = 0.7, value: float = 0.8) -> Colour:
    """A colour of any hue."""
    hsv = np.array([[[rng.uniform(0, 180), 255 * saturation, 255 * value]]], np.uint8)
    red, green, blue = (float(c) / 255 for c in cv2.cvtColor(hsv, cv2.COLOR_HSV2RGB)[0, 0])
    return red, green, blue


def gradient(rows: int, columns: int, top: Colour, bottom: Colour) -> U8:
    """From the top to the bottom colour."""
    t = np.linspace(0, 1, rows)[:, None, None]
    return to_bytes(
        np.broadcast_to(np.array(top) * (1 - t) + np.array(bottom) * t, (rows, columns, 3))
    )


def landscape(rng: np.random.Generator, shape: tuple[int, int] = (PX, PX)) -> U8:
    """Hills behind each other under a sky with a sun, haze growing with distance."""
    rows, columns = shape
    warm = random_hue(rng, 0.5, 0.95)
    image = gradient(
        rows, columns, mix((0.3, 0.5, 0.8), warm, 0.3), mix((0.95, 0.9, 0.8), warm, 0.4)
    )
    sun = (int(rng.uniform(0.2, 0.8) * columns), int(rng.uniform(0.15, 0.4) * rows))
    cv2.circle(image, sun, rows // 14, (255, 244, 214), -1, cv2.LINE_AA)
    near = random_hue(rng, 0.45, 0.4)
    for layer in range(5):
        x = np.linspace(0, 1, columns)
        ridge = 0.4 + 0.12 * layer + 0.09 * np.sin(x * rng.uniform(4, 10) + rng.uniform(0, 6))
        ridge += 0.02 * np.sin(x * rng.uniform(20, 40))
        line = np.stack([np.arange(columns), ridge * rows], axis=1)
        outline = np.concatenate([line, [[columns, rows], [0, rows]]]).astype(np.int32)
        cv2.fillPoly(image, [outline], ink_of(mix((0.75, 0.8, 0.85), near, 0.25 + 0.18 * layer)))
    return image


def abstract(rng: np.random.Generator, shape: tuple[int, int] = (PX, PX)) -> U8:
    """Overlapping discs, bars and triangles in a few colours."""
    rows, columns = shape
    hues = [
        random_hue(rng, float(rng.uniform(0.2, 0.9)), float(rng.uniform(0.3, 1))) for _ in range(5)
    ]
    image = np.full((rows, columns, 3), ink_of(mix(hues[0], (1, 1, 1), 0.6)), np.uint8)
    for _ in range(14):
        ink = ink_of(hues[int(rng.integers(5))])
        x, y = int(rng.integers(columns)), int(rng.integers(rows))
        size = int(rng.integers(rows // 12, rows // 3))
        kind = int(rng.integers(3))
        if kind == 0:
            cv2.circle(image, (x, y), size, ink, -1, cv2.LINE_AA)
        elif kind == 1:
            cv2.rectangle(image, (x, y), (x + size // 3, y + 2 * size), ink, -1)
        else:
            corners = (rng.normal(0, size, (3, 2)) + (x, y)).astype(np.int32)
            cv2.fillConvexPoly(image, corners, ink, cv2.LINE_AA)
    return image


def marbled(rng: np.random.Generator, shape: tuple[int, int] = (PX, PX)) -> U8:
    """Poured paint: bands along the level lines of a cloud."""
    field = cloud(rng, 2, 4)
    image = tinted(
        0.5 + 0.5 * np.sin(4 * field), random_hue(rng, 0.8, 0.5), random_hue(rng, 0.4, 1.0)
    )
    return resized(image, *shape)


def portrait(rng: np.random.Generator, shape: tuple[int, int] = (PX, PX)) -> U8:
    """Head and shoulders before a dark ground."""
    rows, columns = shape
    ground = tinted(0.4 + 0.2 * cloud(rng, 2, 3), (0.1, 0.1, 0.1), random_hue(rng, 0.4, 0.6))
    image = resized(ground, rows, columns)
    skin = mix((0.45, 0.3, 0.2), (0.95, 0.78, 0.66), float(rng.uniform()))
    x = columns // 2

    def oval(y: float, size: tuple[float, float], ink: tuple[int, int, int], *arc: int) -> None:
        axes = (int(size[0] * columns), int(size[1] * rows))
        begin, end = arc or (0, 360)
        cv2.ellipse(image, (x, int(y * rows)), axes, 0, begin, end, ink, -1, cv2.LINE_AA)

    oval(1.0, (0.34, 0.34), ink_of(random_hue(rng, 0.6, 0.5)), 180, 360)
    neck = (x - columns // 16, rows // 2), (x + columns // 16, int(0.72 * rows))
    cv2.rectangle(image, *neck, ink_of(shade(skin, 0.8)), -1)
    hair = shade(mix((0.1, 0.07, 0.05), (0.8, 0.6, 0.3), float(rng.uniform())), 0.8)
    oval(0.38, (0.17, 0.23), ink_of(hair))
    oval(0.42, (0.13, 0.18), ink_of(skin))
    for side in (-1, 1):
        eye = (x + side * columns // 20, int(0.4 * rows))
        cv2.circle(image, eye, max(columns // 70, 1), (20, 20, 20), -1, cv2.LINE_AA)
    oval(0.5, (1 / 24, 1 / 60), (120, 40, 40), 0, 180)
    return image


def still_life(rng: np.random.Generator, shape: tuple[int, int] = (PX, PX)) -> U8:
    """Fruit on a table before a dark wall."""
    rows, columns = shape
    image = gradient(rows, columns, (0.18, 0.14, 0.12), (0.34, 0.26, 0.2))
    image[int(0.65 * rows) :] = ink_of(random_hue(rng, 0.3, 0.55))
    for _ in range(7):
        x, y, r = (
            int(rng.uniform(0.2, 0.8) * columns),
            int(rng.uniform(0.52, 0.72) * rows),
            int(rng.uniform(0.06, 0.12) * rows),
        )
        tone = mix((0.85, 0.2, 0.1), (0.9, 0.8, 0.2), float(rng.uniform()))
        cv2.circle(image, (x, y), r, ink_of(tone), -1, cv2.LINE_AA)
        cv2.circle(
            image,
            (x - r // 3, y - r // 3),
            max(r // 4, 1),
            ink_of(mix(tone, (1, 1, 1), 0.6)),
            -1,
            cv2.LINE_AA,
        )
    return image


def poster(rng: np.random.Generator, shape: tuple[int, int] = (PX, PX)) -> U8:
    """A bold figure with lines of lettering."""
    rows, columns = shape
    image = np.full((rows, columns, 3), ink_of(random_hue(rng, 0.5, 0.95)), np.uint8)
    cv2.circle(
        image,
        (columns // 2, int(0.4 * rows)),
        int(0.26 * columns),
        ink_of(random_hue(rng, 0.8, 0.5)),
        -1,
        cv2.LINE_AA,
    )
    cv2.putText(
        image,
        ("JAZZ", "EXPO", "TOUR", "CINE")[int(rng.integers(4))],
        (columns // 8, int(0.85 * rows)),
        cv2.FONT_HERSHEY_TRIPLEX,
        columns / 140,
        (20, 20, 20),
        3,
        cv2.LINE_AA,
    )
    for line in range(3):
        y = int((0.9 + 0.03 * line) * rows)
        cv2.line(
            image, (columns // 8, y), (int(columns * rng.uniform(0.5, 0.9)), y), (40, 40, 40), 2
        )
    return image


def seascape(rng: np.random.Generator, shape: tuple[int, int] = (PX, PX)) -> U8:
    """Sea with waves under clouds, and a sail."""
    rows, columns = shape
    image = resized(
        tinted(0.5 + 0.3 * cloud(rng, 3, 5), (0.35, 0.55, 0.8), (0.97, 0.97, 0.98)),
        rows,
        columns,
    )
    sea = tinted(0.5 + 0.3 * cloud(rng, 8, 4), (0.05, 0.25, 0.4), (0.3, 0.6, 0.65))
    half = rows - rows // 2
    image[rows // 2 :] = cv2.resize(sea, (columns, half * 3))[:half]
    x = int(rng.uniform(0.3, 0.7) * columns)
    sail = np.array([[x, rows // 4], [x, int(0.55 * rows)], [x + columns // 6, int(0.55 * rows)]])
    cv2.fillConvexPoly(image, sail.astype(np.int32), (245, 240, 230), cv2.LINE_AA)
    return image


def outdoors(rng: np.random.Generator, shape: tuple[int, int] = (PX, PX)) -> U8:
    """A view from a window: sky, houses or trees."""
    rows, columns = shape
    clouds = tinted(0.45 + 0.3 * cloud(rng, 2, 5), (0.55, 0.72, 0.95), (1, 1, 1))
    image = resized(clouds, rows, columns)
    if rng.uniform() < 0.5:
        for _ in range(7):
            x, width = int(rng.uniform(-0.1, 0.9) * columns), int(rng.uniform(0.14, 0.3) * columns)
            top = int(rng.uniform(0.35, 0.7) * rows)
            cv2.rectangle(
                image,
                (x, top),
                (x + width, rows),
                ink_of(random_hue(rng, 0.25, float(rng.uniform(0.5, 0.85)))),
                -1,
            )
            for pane in range(12):
                px, py = x + 6 + (pane % 3) * width // 3, top + 8 + (pane // 3) * rows // 9
                cv2.rectangle(
                    image, (px, py), (px + width // 7, py + rows // 18), (70, 84, 104), -1
                )
        return image
    for _ in range(260):
        y = int(rows * (0.45 + 0.55 * rng.uniform() ** 0.6))
        green = ink_of(mix((0.12, 0.26, 0.1), (0.5, 0.66, 0.3), float(rng.uniform())))
        cv2.circle(
            image, (int(rng.integers(columns)), y), int(rng.integers(6, 22)), green, -1, cv2.LINE_AA
        )
    return image


def book_spines(rng: np.random.Generator, count: int = 24) -> U8:
    """A strip of spines, each 1 / count of the width: colours, bands and marks as lettering."""
    width, rows = 16, 128
    image = np.empty((rows, count * width, 3), np.uint8)
    for book in range(count):
        tone = random_hue(rng, float(rng.uniform(0.05, 0.75)), float(rng.uniform(0.2, 0.95)))
        spine = np.full((rows, width, 3), ink_of(tone), np.uint8)
        mark = ink_of(mix(tone, (1, 0.95, 0.8) if sum(tone) < 1.4 else (0.1, 0.1, 0.1), 0.8))
        for at in rng.choice(rows - 12, int(rng.integers(1, 4)), replace=False):
            cv2.line(spine, (1, int(at)), (width - 2, int(at)), mark, 2)
        letters = int(rng.integers(20, 60))
        for row in range(30, 30 + letters, 4):
            cv2.line(spine, (width // 3, row), (int(rng.uniform(0.45, 0.8) * width), row), mark, 2)
        spine[:, 0] = spine[:, 0] // 2
        image[:, book * width : (book + 1) * width] = spine
    return image


PAINTINGS: tuple[Callable[..., U8], ...] = (
    landscape, abstract, portrait, marbled, still_life, poster, seascape, outdoors,
)  # fmt: skip
