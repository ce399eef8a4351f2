"""Baked textures of materials: wood, cloth, steel, stone, tiles, leather, plaster, wicker.

Each returns an image (h, w, 3) uint8 RGB that repeats at its borders. Colours are 0 to 1.
"""

from __future__ import annotations

import cv2
import numpy as np

from onemap_shared.geometry import F32, U8
from onemap_tools.foreign.noise import PX, cloud, tinted, to_bytes, waves

Colour = tuple[float, float, float]


def shade(colour: Colour, factor: float) -> Colour:
    """A lighter (above 1) or darker colour."""
    red, green, blue = (min(max(c * factor, 0.0), 1.0) for c in colour)
    return (red, green, blue)


def mix(one: Colour, other: Colour, share: float) -> Colour:
    """``share`` of the other colour in one."""
    red, green, blue = (a + (b - a) * share for a, b in zip(one, other, strict=True))
    return (red, green, blue)


def wood(rng: np.random.Generator, colour: Colour, contrast: float = 0.45) -> U8:
    """Grain along the image's columns of pixels' direction x: wavy rings, pores and fibres."""
    y = np.linspace(0, 1, PX, endpoint=False, dtype=np.float32)[:, None]
    bend = 0.05 * waves(rng, 4, 2) + 0.012 * waves(rng, 16, 4)
    rings = int(rng.integers(5, 12))
    grain = np.sin(2 * np.pi * (rings * (y + bend)))
    fibres = waves(rng, 128, 4) * 0.5 + waves(rng, 256, 16) * 0.25
    pores = np.clip(waves(rng, 128, 16) - 1.6, 0, 1)
    value = 0.62 + contrast * (0.34 * grain + 0.25 * fibres) - 0.5 * pores
    return tinted(value, shade(colour, 0.52), shade(colour, 1.14))


def planks(rng: np.random.Generator, colour: Colour, rows: int = 6) -> U8:
    """Floor boards along x, each with its own tone, and dark joints."""
    image = np.empty((2 * PX, 2 * PX, 3), np.uint8)
    height = 2 * PX // rows
    for row in range(rows):
        tone = shade(colour, float(rng.uniform(0.82, 1.12)))
        grain = cv2.resize(wood(rng, tone, 0.3), (2 * PX, PX))
        top, end = row * height, (row + 1) * height if row < rows - 1 else 2 * PX
        image[top:end] = np.resize(grain, (PX, 2 * PX, 3))[: end - top]
        joint = int(rng.integers(0, 2 * PX))
        image[top:end, joint : joint + 2] = image[top:end, joint : joint + 2] // 2
        image[top : top + 2] = image[top : top + 2] // 2
    return image


def parquet(rng: np.random.Generator, colour: Colour) -> U8:
    """Strips laid as basket weave: squares of four strips, turned by turns."""
    tiles, side = 4, PX // 2
    image = np.empty((tiles * side, tiles * side, 3), np.uint8)
    for row in range(tiles):
        for column in range(tiles):
            strips = [
                cv2.resize(
                    wood(rng, shade(colour, float(rng.uniform(0.8, 1.15))), 0.25)[:64],
                    (side, side // 4),
                )
                for _ in range(4)
            ]
            square = np.concatenate(strips)
            square[:: side // 4] = square[:: side // 4] // 2
            if (row + column) % 2:
                square = square.transpose(1, 0, 2)
            image[row * side : (row + 1) * side, column * side : (column + 1) * side] = square
    return image


def weave(rng: np.random.Generator, colour: Colour, coarse: int = 64, depth: float = 0.3) -> U8:
    """Cloth: warp and weft over and under each other, threads of uneven tone."""
    at = np.arange(PX, dtype=np.float32) * coarse / PX
    over = np.sin(np.pi * at)[:, None] * np.cos(np.pi * at)[None]
    threads = rng.normal(0, 0.3, (coarse, 1)) + rng.normal(0, 0.3, (1, coarse))
    tone = cv2.resize(threads.astype(np.float32), (PX, PX), interpolation=cv2.INTER_NEAREST)
    value = 0.6 + depth * (0.5 * over + 0.4 * tone) + 0.06 * cloud(rng, 3, 3)
    return tinted(value, shade(colour, 0.6), shade(colour, 1.25))


def stripes(rng: np.random.Generator, one: Colour, other: Colour, count: int = 8) -> U8:
    """Woven stripes across x of uneven widths."""
    edges = np.sort(rng.uniform(0, 1, 2 * count))
    x = np.linspace(0, 1, PX, endpoint=False)
    pick = (np.searchsorted(edges, x) % 2).astype(np.float32)
    ground, band = weave(rng, one), weave(rng, other)
    return np.where(pick[None, :, None] > 0, band, ground).astype(np.uint8)


def plaid(rng: np.random.Generator, one: Colour, other: Colour) -> U8:
    """A checked cloth: stripes both ways that darken where they cross."""
    lines = (np.sin(2 * np.pi * 4 * np.linspace(0, 1, PX, endpoint=False)) > 0.35) * 0.5
    thin = (np.sin(2 * np.pi * 8 * np.linspace(0, 1, PX, endpoint=False) + 1) > 0.9) * 0.4
    value = (lines + thin)[:, None] + (lines + thin)[None]
    ground = weave(rng, one).astype(np.float32) / 255
    return to_bytes(ground * (1 - value[..., None] * (1 - np.array(other))))


def blossoms(rng: np.random.Generator, ground: Colour, petals: Colour, count: int = 26) -> U8:
    """Printed cloth: flowers with leaves, strewn."""
    image: U8 = weave(rng, ground, 96, 0.15).copy()
    for _ in range(count):
        x, y, size = (int(v) for v in rng.integers((0, 0, 7), (PX, PX, 16)))
        turn = float(rng.uniform(0, np.pi))
        tone = shade(petals, float(rng.uniform(0.7, 1.2)))
        leaf = tuple(int(255 * c) for c in (0.25, 0.42, 0.24))
        cv2.ellipse(image, (x, y), (2 * size, size // 2), np.degrees(turn), 0, 360, leaf, -1)
        for petal in range(5):
            angle = turn + 2 * np.pi * petal / 5
            at = (int(x + size * 0.7 * np.cos(angle)), int(y + size * 0.7 * np.sin(angle)))
            cv2.circle(image, at, size // 2, tuple(int(255 * c) for c in tone), -1, cv2.LINE_AA)
        cv2.circle(image, (x, y), max(size // 4, 1), (230, 190, 70), -1, cv2.LINE_AA)
    return image


def leather(rng: np.random.Generator, colour: Colour) -> U8:
    """Cells with dark creases, and worn lighter patches."""
    seeds = np.full((PX, PX), 255, np.uint8)
    at = rng.integers(0, PX, (900, 2))
    seeds[at[:, 0], at[:, 1]] = 0
    distance = cv2.distanceTransform(seeds, cv2.DIST_L2, 3)
    crease = np.clip(distance / 6, 0, 1)
    value = 0.66 - 0.3 * crease**2 + 0.1 * cloud(rng, 3, 3)
    return tinted(value, shade(colour, 0.5), shade(colour, 1.3))


def brushed(rng: np.random.Generator, colour: Colour = (0.66, 0.67, 0.68)) -> U8:
    """Brushed metal: long fine scratches along x and slow streaks of light across it."""
    value = 0.5 + 0.05 * waves(rng, 256, 2) + 0.025 * waves(rng, 128, 8) + 0.09 * waves(rng, 2, 2)
    return tinted(value, shade(colour, 0.62), shade(colour, 1.32))


def marble(rng: np.random.Generator, ground: Colour, vein: Colour) -> U8:
    """Stone with branching veins: the zero lines of a turbulent field."""
    field = cloud(rng, 2, 6)
    veins = np.exp(-np.abs(field) * 9) + 0.5 * np.exp(-np.abs(cloud(rng, 3, 6)) * 16)
    return tinted(veins + 0.12 * cloud(rng, 2, 3), ground, vein)


def terrazzo(rng: np.random.Generator, ground: Colour) -> U8:
    """Chips of many colours in a smooth ground."""
    image: U8 = tinted(0.5 + 0.1 * cloud(rng, 4, 4), shade(ground, 0.9), shade(ground, 1.06)).copy()
    for _ in range(420):
        x, y = (int(v) for v in rng.integers(0, PX, 2))
        chip = rng.normal(0, 3, (5, 2)) + (x, y)
        tone = tuple(int(v) for v in rng.integers(60, 230, 3))
        cv2.fillConvexPoly(image, cv2.convexHull(chip.astype(np.int32)), tone, cv2.LINE_AA)
    return image


def tiles(
    rng: np.random.Generator,
    colour: Colour,
    *,
    rows: int = 4,
    shift: float = 0.0,
    vary: float = 0.05,
) -> U8:
    """Glazed tiles with grout; ``shift`` of a tile between rows gives a brick bond."""
    columns = rows if shift == 0 else max(rows // 2, 1)
    y, x = np.mgrid[0:PX, 0:PX].astype(np.float32) / PX
    row = np.floor(y * rows)
    across = x * columns + shift * (row % 2)
    column = np.floor(across) % columns
    tone = rng.normal(1, vary, (rows, columns))[row.astype(int), column.astype(int)]
    inside_y, inside_x = np.abs(y * rows % 1 - 0.5), np.abs(across % 1 - 0.5)
    edge = np.maximum(inside_y, inside_x if shift == 0 else inside_x + 0.0)
    glaze = np.clip((0.5 - edge) * 24, 0, 1) * (1 + 0.05 * cloud(rng, 4, 3)) * tone
    grout = edge > 0.475
    value = np.array(colour) * glaze[..., None]
    value[grout] = np.array((0.62, 0.6, 0.57)) + 0.04 * rng.standard_normal((int(grout.sum()), 1))
    return to_bytes(value)


def checker(rng: np.random.Generator, one: Colour, other: Colour) -> U8:
    """Chess-board tiles of two stones."""
    cell = np.indices((PX, PX)).sum(axis=0) * 0
    index = np.arange(PX) * 4 // PX
    cell = (index[:, None] + index[None]) % 2
    light, dark = marble(rng, one, shade(one, 0.75)), marble(rng, other, shade(other, 1.5))
    image = np.where(cell[..., None] == 0, light, dark).astype(np.uint8)
    image[:: PX // 4] = image[:, :: PX // 4] = 120
    return image


def plaster(rng: np.random.Generator, colour: Colour, rough: float = 0.05) -> U8:
    """A painted wall: roller marks and faint blotches."""
    value = 0.5 + rough * cloud(rng, 4, 6) + 0.4 * rough * rng.standard_normal((PX, PX))
    return tinted(value, shade(colour, 0.84), shade(colour, 1.12))


def wallpaper(rng: np.random.Generator, ground: Colour, motif: Colour) -> U8:
    """A printed paper of diamonds, rings or leaves."""
    y, x = np.mgrid[0:PX, 0:PX].astype(np.float32) * (2 * np.pi * 4 / PX)
    kinds: tuple[F32, ...] = (
        np.cos(x) + np.cos(y),
        np.cos(x + y) * np.cos(x - y) * 2,
        np.sin(x + 1.2 * np.sin(y)) * 1.6,
    )
    figure = np.clip((kinds[int(rng.integers(3))] - 0.9) * 8, 0, 1)
    return tinted(figure + 0.05 * cloud(rng, 4, 5), ground, motif)


def concrete(rng: np.random.Generator, colour: Colour = (0.58, 0.57, 0.55)) -> U8:
    """Cast concrete: cloudy, with air holes."""
    holes = np.clip(waves(rng, 64, 64) - 2.3, 0, 1) * 0.6
    return tinted(0.55 + 0.16 * cloud(rng, 3, 6) - holes, shade(colour, 0.7), shade(colour, 1.2))


def bricks(rng: np.random.Generator, colour: Colour) -> U8:
    """A brick wall of rough uneven stones with light mortar."""
    base = tiles(rng, colour, rows=8, shift=0.5, vary=0.14).astype(np.float32) / 255
    return to_bytes(base * (1 + 0.1 * cloud(rng, 16, 4))[..., None])


def wicker(rng: np.random.Generator, colour: Colour) -> U8:
    """Plaited cane: rods over and under in turn, with dark gaps."""
    at = np.arange(PX, dtype=np.float32) * 16 / PX
    across, down = np.abs(np.sin(np.pi * at)), np.abs(np.sin(np.pi * at))
    turn = (np.floor(at)[:, None] + np.floor(at)[None]) % 2
    value = np.where(turn > 0, across[None] * (0.6 + 0.4 * down[:, None]), down[:, None] * 0.9)
    return tinted(value + 0.08 * cloud(rng, 8, 4), shade(colour, 0.3), shade(colour, 1.2))


def fur(rng: np.random.Generator, colour: Colour) -> U8:
    """A shaggy pile: short strokes in all directions."""
    image = np.full((PX, PX, 3), [int(255 * c * 0.7) for c in colour], np.uint8)
    for _ in range(2600):
        x, y = rng.integers(0, PX, 2)
        angle, tone = rng.uniform(0, 2 * np.pi), rng.uniform(0.65, 1.25)
        end = (int(x + 9 * np.cos(angle)), int(y + 9 * np.sin(angle)))
        ink = tuple(int(255 * c) for c in shade(colour, float(tone)))
        cv2.line(image, (int(x), int(y)), end, ink, 1, cv2.LINE_AA)
    return image


def foliage(rng: np.random.Generator, colour: Colour) -> U8:
    """A leaf: a light middle vein along x with side veins, blotched green."""
    y, x = np.mgrid[0:PX, 0:PX].astype(np.float32) / PX
    middle = np.exp(-(((y - 0.5) * 30) ** 2))
    sides = 0.5 * np.exp(-((np.sin(2 * np.pi * (x * 7 - np.abs(y - 0.5) * 5)) * 5) ** 2))
    return tinted(
        0.45 + 0.3 * middle + 0.16 * sides + 0.1 * cloud(rng, 4, 4),
        shade(colour, 0.5),
        shade(colour, 1.7),
    )


def plain(rng: np.random.Generator, colour: Colour, grain: float = 0.012) -> U8:
    """Lacquer, plastic or ceramic: one colour with a trace of unevenness."""
    value = 0.5 + grain * 6 * cloud(rng, 3, 3, 64)
    return tinted(value, shade(colour, 0.9), shade(colour, 1.1))
