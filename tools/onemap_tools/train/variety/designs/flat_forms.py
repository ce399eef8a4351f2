"""Flat and skinned forms that several designs share: plates, rings, skins over outlines."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from onemap_shared.geometry import F64
from onemap_simulator.generation.mesh import Mesh, from_faces, prism
from onemap_simulator.generation.model import Material, Model, assemble


def rounded_outline(width: float, height: float, radius: float, steps: int = 3) -> F64:
    """A rectangle with round corners about the origin (N, 2), counter-clockwise."""
    radius = min(radius, min(width, height) / 2 * 0.98)
    angle = np.radians(np.linspace(0, 90, steps + 1))
    corners = []
    for index, (x, y) in enumerate(((1, 1), (-1, 1), (-1, -1), (1, -1))):
        turned = angle + index * np.pi / 2
        centre = np.array([x * (width / 2 - radius), y * (height / 2 - radius)])
        corners.append(centre + radius * np.stack([np.cos(turned), np.sin(turned)], axis=1))
    return np.concatenate(corners)


def ellipse_outline(width: float, height: float, segments: int = 24) -> F64:
    """An ellipse about the origin (N, 2), counter-clockwise."""
    angle = np.linspace(0, 2 * np.pi, segments, endpoint=False)
    return np.stack([np.cos(angle) * width / 2, np.sin(angle) * height / 2], axis=1)


def upright(outline: ArrayLike, depth: float, at: tuple[float, float, float]) -> Mesh:
    """A plate of the outline (x, z) about ``at``, from its back at y to its front at y - depth."""
    return prism(outline, depth).rotated("x", 90).translated(*at)


def skin(rings: F64, *, closed: bool = False) -> Mesh:
    """The skin over rings (R, N, 3); ``closed`` joins the last to the first, else both are capped.

    Rings run counter-clockwise seen from the last one.
    """
    count, around = rings.shape[:2]
    vertices = rings.reshape(-1, 3)
    index = np.arange(count * around).reshape(count, around)
    after = np.roll(index, -1, axis=0) if closed else index[1:]
    before = index if closed else index[:-1]
    a, b = before, np.roll(before, -1, axis=1)
    c, d = np.roll(after, -1, axis=1), after
    faces = [np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)]
    if not closed:
        ends = np.stack([rings[0].mean(axis=0), rings[-1].mean(axis=0)])
        vertices = np.concatenate([vertices, ends])
        low, high = np.full(around, count * around), np.full(around, count * around + 1)
        faces.append(np.stack([low, np.roll(index[0], -1), index[0]], axis=1))
        faces.append(np.stack([high, index[-1], np.roll(index[-1], -1)], axis=1))
    return from_faces(vertices, np.concatenate(faces))


def moulding(
    outline: F64, steps: list[tuple[float, float]], at: tuple[float, float, float]
) -> Mesh:
    """An upright frame: the outline grown by each (growth factor, depth to the front) in a loop."""
    rings = np.zeros((len(steps), len(outline), 3))
    for ring, (growth, depth) in zip(rings, steps, strict=True):
        ring[:, 0], ring[:, 2] = (outline * growth).T
        ring[:, 1] = -depth
    return skin(rings, closed=True).translated(*at)


def window(size: tuple[float, float], bar: float, depth: float, back: float = 0.0) -> Mesh:
    """A plain rectangular frame (width, height) of ``bar``, standing on z = 0, mitred."""
    width, height = size
    rings = []
    for inset, y in ((0.0, back), (0.0, back - depth), (bar, back - depth), (bar, back)):
        x, low, high = width / 2 - inset, inset, height - inset
        rings.append([(x, y, high), (-x, y, high), (-x, y, low), (x, y, low)])
    return skin(np.array(rings), closed=True)


def settled(category: str, *groups: tuple[Material, list[Mesh]]) -> Model:
    """A model from groups of meshes, moved to stand on z = 0 with its middle at x = y = 0."""
    points = np.concatenate([mesh.vertices for _, meshes in groups for mesh in meshes])
    low, high = points.min(axis=0), points.max(axis=0)
    x, y = (-(low + high) / 2)[:2]
    moved = [(m, [mesh.translated(x, y, -low[2]) for mesh in meshes]) for m, meshes in groups]
    return assemble(category, *moved)
