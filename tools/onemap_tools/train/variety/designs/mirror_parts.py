"""Parts of mirrors: what the glass shows, outlines, bands and boards."""

from __future__ import annotations

import cv2
import numpy as np

from onemap_shared.geometry import F64, U8
from onemap_simulator.generation.mesh import Mesh, prism
from onemap_simulator.generation.model import Material
from onemap_simulator.generation.sampler import Sampler
from onemap_tools.train.variety.designs.sanitary import ring, skin


def reflection(rng: np.random.Generator) -> U8:
    """What a mirror shows (96, 96, 3): a soft gradient with glints, or a blurred room."""
    rows, columns = np.mgrid[0:96, 0:96] / 96.0
    tone = rng.uniform(0.45, 0.85) + rng.uniform(-0.25, 0.25) * rows
    image = (tone[..., None] * rng.uniform(0.88, 1.06, 3)).astype(np.float32)
    if rng.random() < 0.6:
        floor = int(rng.integers(55, 85))
        image[floor:] *= rng.uniform(0.5, 0.9)
        for _ in range(int(rng.integers(1, 5))):
            x, y = (int(v) for v in rng.integers(0, 80, 2))
            w, h = (int(v) for v in rng.integers(8, 45, 2))
            colour = tuple(float(v) for v in rng.uniform(0.2, 0.95) * rng.uniform(0.6, 1.0, 3))
            cv2.rectangle(image, (x, y), (x + w, y + h), colour, -1)
        image = cv2.GaussianBlur(image, (0, 0), float(rng.uniform(1.0, 5.0)))
    for at in rng.uniform(0.2, 1.8, int(rng.integers(0, 4))):
        streak = np.exp(-(((rows + columns - at) / rng.uniform(0.02, 0.09)) ** 2))
        image = image + 0.2 * streak[..., None]
    return np.asarray(np.clip(image, 0, 1) * 255).astype(np.uint8)


def glass_plate(outline: F64, y: float) -> Mesh:
    """The glass: a star-shaped outline (N, 2) in x and z at depth y, under one whole image."""
    lower, upper = outline.min(axis=0), outline.max(axis=0)
    middle = (lower + upper) / 2
    vertices = np.concatenate([outline, [middle]])
    count = len(outline)
    index = np.arange(count)
    faces = np.stack([index, np.roll(index, -1), np.full(count, count)], axis=1)
    share = (vertices - lower) / (upper - lower)
    uv = np.stack([share[:, 0], 1 - share[:, 1]], axis=1)
    points = np.stack([vertices[:, 0], np.full(count + 1, y), vertices[:, 1]], axis=1)
    return Mesh(points, faces, uv[faces])


def frame_band(outer: F64, inner: F64, depth: float) -> Mesh:
    """A frame between two outlines of equal length, from the wall at y = 0 to -depth."""
    pairs = ((inner, 0.0), (outer, 0.0), (outer, -depth), (inner, -depth * 0.8), (inner, 0.0))
    rings = [np.stack([o[:, 0], np.full(len(o), y), o[:, 1]], axis=1) for o, y in pairs]
    return skin(rings, capped=False)


def back_board(outline: F64, depth: float) -> Mesh:
    """A thin board behind the glass."""
    return prism(outline, depth).rotated("x", 90)


def mirror_glass(sampler: Sampler) -> Material:
    """A material with a reflection of its own."""
    return Material(reflection(sampler.rng), 1.0)


def edge_material(sampler: Sampler) -> Material:
    """What a frame is made of."""
    kind = sampler.integer(0, 3)
    if kind == 0:
        return sampler.plastic()
    return sampler.metal() if kind == 1 else sampler.wood()


def oval(size: tuple[float, float], power: float = 2.0) -> F64:
    """A superellipse (24, 2) in x and z about the origin."""
    return np.asarray(ring(size, 0.0, power)[:, :2])
