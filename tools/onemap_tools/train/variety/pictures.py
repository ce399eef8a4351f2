"""Pictures made in code with the look of photographs: for screens, and for what hangs on walls."""

from __future__ import annotations

import cv2
import numpy as np

from onemap_shared.geometry import F32, U8
from onemap_tools.train.variety.surfaces import fractal, palette

HEIGHT, WIDTH = 96, 160  # texels


def photograph(rng: np.random.Generator) -> U8:
    """A landscape, a face, things on a table, a page or a pattern: (96, 160, 3) uint8 RGB."""
    make = KINDS[int(rng.integers(len(KINDS)))]
    image = make(rng)
    # The light of a photograph: exposure, a darker rim, grain.
    v, u = np.mgrid[-1 : 1 : HEIGHT * 1j, -1 : 1 : WIDTH * 1j]
    rim = 1 - rng.uniform(0, 0.5) * (u**2 + v**2) / 2
    image = image * (np.exp(rng.uniform(-0.7, 0.3)) * rim)[..., None].astype(np.float32)
    image += rng.normal(0, 0.02, (HEIGHT, WIDTH, 1)).astype(np.float32)
    result: U8 = (np.clip(image, 0, 1) * 255).astype(np.uint8)
    return result


def _noise(rng: np.random.Generator, power: float) -> F32:
    """Noise (96, 160) in 0 to 1."""
    size = (WIDTH, HEIGHT)
    return np.asarray(cv2.resize(fractal(rng, power), size, interpolation=cv2.INTER_LINEAR))


def _shaded(rng: np.random.Generator, colour: F32, power: float = 1.6) -> F32:
    """A colour (3,) under uneven light: (96, 160, 3)."""
    shade = 0.4 + 0.8 * _noise(rng, power)
    result: F32 = shade[..., None] * colour
    return result


def _landscape(rng: np.random.Generator) -> F32:
    """A sky with clouds above ridges that get darker towards the viewer."""
    colours = palette(rng)
    sky = colours[0] * 0.5 + 0.5
    down = np.linspace(0, 1, HEIGHT, dtype=np.float32)[:, None, None]
    image = sky * (1 - 0.5 * down) + 0.4 * _noise(rng, 2.0)[..., None]
    rows = np.arange(HEIGHT)[:, None]
    for depth in range(int(rng.integers(1, 5))):
        crest = HEIGHT * (0.35 + 0.15 * depth) + 30 * (_noise(rng, 1.8)[0] - 0.5)
        ground = _shaded(rng, colours[(depth + 1) % len(colours)] * (0.9 - 0.15 * depth), 1.2)
        image = np.where((rows > crest)[..., None], ground, image)
    return np.asarray(image, np.float32)


def _face(rng: np.random.Generator) -> F32:
    """A head and shoulders before a blurred ground."""
    colours = palette(rng)
    image = _shaded(rng, colours[0], 2.2)
    skin = np.array([0.9, 0.68, 0.55], np.float32) * np.float32(rng.uniform(0.35, 1.05))
    x, y = rng.uniform(0.3, 0.7) * WIDTH, rng.uniform(0.35, 0.5) * HEIGHT
    size = rng.uniform(0.18, 0.3) * HEIGHT
    figures = (
        ((x, y + 2.6 * size), (2.0 * size, 1.8 * size), colours[1]),
        ((x, y - 0.2 * size), (0.95 * size, 1.25 * size), colours[-1] * 0.4),
        ((x, y), (0.75 * size, size), skin),
        ((x - 0.28 * size, y - 0.1 * size), (0.1 * size, 0.06 * size), skin * 0.2),
        ((x + 0.28 * size, y - 0.1 * size), (0.1 * size, 0.06 * size), skin * 0.2),
        ((x, y + 0.45 * size), (0.3 * size, 0.08 * size), skin * 0.5),
    )
    for centre, axes, colour in figures:
        _blend(image, rng, (centre, axes), colour)
    return image


def _things(rng: np.random.Generator) -> F32:
    """Rounded shaded bodies on a ground, with a horizon."""
    colours = palette(rng)
    image = _shaded(rng, colours[0])
    line = int(rng.uniform(0.4, 0.8) * HEIGHT)
    image[line:] = _shaded(rng, colours[1])[line:]
    for _ in range(int(rng.integers(2, 8))):
        centre = (float(rng.uniform(0, WIDTH)), float(rng.uniform(line - 30, line + 15)))
        axes = (float(rng.uniform(5, 28)), float(rng.uniform(5, 28)))
        _blend(image, rng, (centre, axes), rng.random(3).astype(np.float32))
    return image


def _page(rng: np.random.Generator) -> F32:
    """A window with lines of text, bars and a picture in it."""
    image = np.full((HEIGHT, WIDTH, 3), palette(rng)[0], np.float32)
    dark = rng.random() < 0.4
    x, y = int(rng.integers(0, 20)), int(rng.integers(0, 12))
    image[y : HEIGHT - y, x : WIDTH - x] = 0.1 if dark else 0.95
    image[y : y + 6, x : WIDTH - x] = rng.random(3)
    ink = 0.8 if dark else 0.2
    for row in range(y + 10, HEIGHT - y - 4, int(rng.integers(4, 8))):
        image[row : row + 2, x + 5 : x + 5 + int(rng.integers(20, WIDTH - 2 * x - 10))] = ink
    if rng.random() < 0.6:
        inset = cv2.resize(_landscape(rng), (60, 40))
        image[y + 20 : y + 60, WIDTH - x - 65 : WIDTH - x - 5] = inset
    return image


def _pattern(rng: np.random.Generator) -> F32:
    """Clouds of colour: each channel its own noise."""
    power = rng.uniform(1, 2.2)
    return np.stack([_noise(rng, power) for _ in range(3)], axis=-1)


def _blend(
    image: F32,
    rng: np.random.Generator,
    ellipse: tuple[tuple[float, float], tuple[float, float]],
    colour: F32,
) -> None:
    """Paint an ellipse (centre, half axes) that is lit from one side into ``image``."""
    (x, y), (a, b) = ellipse
    v, u = np.mgrid[:HEIGHT, :WIDTH].astype(np.float32)
    du, dv = (u - np.float32(x)) / np.float32(a), (v - np.float32(y)) / np.float32(b)
    inside = du**2 + dv**2 < 1
    light = 0.75 - 0.35 * (du * np.float32(rng.uniform(-1, 1)) + dv)
    image[inside] = (light[..., None] * colour)[inside]


KINDS = (_landscape, _landscape, _face, _things, _page, _pattern)
