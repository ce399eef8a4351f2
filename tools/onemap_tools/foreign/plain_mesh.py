"""Triangle meshes without a material, by lofts: rings of points joined to a skin.

Axes of a piece of furniture: x to its right, y to its back, z up; its front looks along -y.
All lengths are metres.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from onemap_shared.geometry import F64, I64

WELD_M = 1e-6  # points nearer than this are one
MIN_AREA_M2 = 1e-12  # smaller triangles are dropped


@dataclass(frozen=True, slots=True, eq=False)
class PlainMesh:
    """vertices (V, 3) float64 metres; faces (F, 3) int64."""

    vertices: F64
    faces: I64

    def at(self, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> PlainMesh:
        """Moved by metres."""
        return PlainMesh(self.vertices + (x, y, z), self.faces)

    def turned(self, yaw: float = 0.0, pitch: float = 0.0, roll: float = 0.0) -> PlainMesh:
        """Rotated by radians: about y (roll), then x (pitch), then z (yaw)."""
        R = _rotation(2, yaw) @ _rotation(0, pitch) @ _rotation(1, roll)
        return PlainMesh(self.vertices @ R.T, self.faces)

    def scaled(self, x: float = 1.0, y: float = 1.0, z: float = 1.0) -> PlainMesh:
        """Stretched along the axes by positive factors."""
        return PlainMesh(self.vertices * (x, y, z), self.faces)

    def bent(self, change: Callable[[F64], F64]) -> PlainMesh:
        """With every vertex moved: ``change`` takes (V, 3) and returns (V, 3)."""
        return PlainMesh(change(self.vertices.copy()), self.faces)


def joined(meshes: Sequence[PlainMesh]) -> PlainMesh:
    """All meshes as one mesh."""
    offsets = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes[:-1])])
    faces = [mesh.faces + offset for mesh, offset in zip(meshes, offsets, strict=True)]
    return PlainMesh(np.concatenate([mesh.vertices for mesh in meshes]), np.concatenate(faces))


def welded(vertices: F64, faces: I64) -> PlainMesh:
    """The mesh with equal points joined and triangles without area dropped."""
    _, first, index = np.unique(
        np.round(vertices / WELD_M).astype(np.int64), axis=0, return_index=True, return_inverse=True
    )
    points, joined_faces = vertices[first], index.reshape(-1)[faces]
    corners = points[joined_faces]
    area = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    return PlainMesh(points, joined_faces[area > 2 * MIN_AREA_M2])


def loft(rings: Sequence[F64], caps: bool = True) -> PlainMesh:
    """The closed skin through rings (K, 3) of equally many points; caps fan from their centres."""
    stack = np.stack(rings)
    count, around = stack.shape[:2]
    vertices = [stack.reshape(-1, 3)]
    here = np.arange(count - 1)[:, None] * around + np.arange(around)
    beside = np.arange(count - 1)[:, None] * around + (np.arange(around) + 1) % around
    faces = [
        np.stack([here, beside, beside + around], axis=-1).reshape(-1, 3),
        np.stack([here, beside + around, here + around], axis=-1).reshape(-1, 3),
    ]
    if caps:
        for number, (ring, start) in enumerate(((stack[0], 0), (stack[-1], around * (count - 1)))):
            vertices.append(ring.mean(axis=0)[None])
            centre = np.full(around, count * around + number)
            edge, following = start + np.arange(around), start + (np.arange(around) + 1) % around
            order = (edge, centre, following) if number == 0 else (edge, following, centre)
            faces.append(np.stack(order, axis=-1))
    return welded(np.concatenate(vertices), np.concatenate(faces).astype(np.int64))


def ring(width: float, depth: float, z: float, power: float = 2.0, points: int = 32) -> F64:
    """A superellipse (points, 3) at height z: power 2 is an ellipse, 8 nearly a rectangle."""
    angle = np.linspace(0, 2 * np.pi, points, endpoint=False)
    c, s = np.cos(angle), np.sin(angle)
    x = np.sign(c) * np.abs(c) ** (2 / power) * width / 2
    y = np.sign(s) * np.abs(s) ** (2 / power) * depth / 2
    return np.stack([x, y, np.full(points, z)], axis=1)


def revolved(profile: Sequence[tuple[float, float]], points: int = 28) -> PlainMesh:
    """The surface of revolution about z of (radius, height) pairs, closed at both ends."""
    return loft([ring(2 * max(r, 1e-5), 2 * max(r, 1e-5), z, 2.0, points) for r, z in profile])


def smooth_profile(
    profile: Sequence[tuple[float, float]], steps: int = 6
) -> list[tuple[float, float]]:
    """A Catmull-Rom curve through (radius, height) pairs, ``steps`` points between two of them."""
    points = curve([(r, 0.0, z) for r, z in profile], steps)
    return [(max(float(p[0]), 0.0), float(p[2])) for p in points]


def curve(points: Sequence[tuple[float, float, float]], steps: int = 6) -> F64:
    """A Catmull-Rom curve (N, 3) through points, ``steps`` samples between two of them."""
    p = np.array(points, np.float64)
    p = np.concatenate([2 * p[:1] - p[1:2], p, 2 * p[-1:] - p[-2:-1]])
    t = np.linspace(0, 1, steps, endpoint=False)[:, None]
    pieces = [
        0.5
        * (
            2 * b
            + (c - a) * t
            + (2 * a - 5 * b + 4 * c - d) * t**2
            + (3 * b - a - 3 * c + d) * t**3
        )
        for a, b, c, d in zip(p, p[1:], p[2:], p[3:], strict=False)
    ]
    return np.concatenate([*pieces, p[-2:-1]])


def tube(
    path: F64 | Sequence[tuple[float, float, float]], radius: object, points: int = 10
) -> PlainMesh:
    """A round rod along a path (N, 3); radius: one or (N,) metres."""
    at = np.asarray(path, np.float64)
    radii = np.broadcast_to(np.asarray(radius, np.float64), (len(at),))
    along = np.gradient(at, axis=0)
    along /= np.maximum(np.linalg.norm(along, axis=1), 1e-9)[:, None]
    side = np.cross(along[0], [0.0, 0.0, 1.0] if abs(along[0, 2]) < 0.9 else [0.0, 1.0, 0.0])
    angle = np.linspace(0, 2 * np.pi, points, endpoint=False)[:, None]
    rings = []
    for centre, direction, r in zip(at, along, radii, strict=True):
        side = side - direction * (side @ direction)
        side = side / max(float(np.linalg.norm(side)), 1e-9)
        up = np.cross(direction, side)
        rings.append(centre + r * (np.cos(angle) * side + np.sin(angle) * up))
    return loft(rings)


def block(
    width: float, depth: float, height: float, bevel: float = 0.006, steps: int = 2
) -> PlainMesh:
    """A box with round edges that stands on z = 0, its middle at x = y = 0."""
    return cushion(width, depth, height, bevel, steps=steps)


def cushion(
    width: float,
    depth: float,
    height: float,
    bevel: float,
    *,
    steps: int = 3,
    puff: float = 0.0,
) -> PlainMesh:
    """A box with round edges; its top and bottom bulge by ``puff`` metres in the middle."""
    half = np.array([width, depth, height]) / 2
    r = min(bevel, 0.999 * float(half.min()))
    inner = 6 if puff else 1
    lines = [
        np.unique(
            np.concatenate(
                [
                    np.linspace(-h, r - h, steps + 1),
                    np.linspace(r - h, h - r, inner + 1),
                    np.linspace(h - r, h, steps + 1),
                ]
            ).round(9)
        )
        for h in half
    ]
    vertices, faces, used = [], [], 0
    for axis in range(3):
        u, v = lines[(axis + 1) % 3], lines[(axis + 2) % 3]
        for side in (-1.0, 1.0):
            points = np.empty((len(u), len(v), 3))
            points[..., axis] = side * half[axis]
            points[..., (axis + 1) % 3], points[..., (axis + 2) % 3] = u[:, None], v[None]
            grid = np.arange(len(u) * len(v)).reshape(len(u), len(v)) + used
            faces.append(_grid_faces(grid, flip=side < 0))
            vertices.append(points.reshape(-1, 3))
            used += grid.size
    points = np.concatenate(vertices)
    core = np.clip(points, -(half - r), half - r)
    away = points - core
    points = core + r * away / np.maximum(np.linalg.norm(away, axis=1), 1e-9)[:, None]
    if puff:
        bulge = (1 - (points[:, 0] / half[0]) ** 2) * (1 - (points[:, 1] / half[1]) ** 2)
        points[:, 2] += puff * np.sign(points[:, 2]) * np.clip(bulge, 0, 1)
    return welded(points + (0.0, 0.0, float(half[2])), np.concatenate(faces))


def sheet(points: F64) -> PlainMesh:
    """An open surface through a grid of points (N, M, 3)."""
    grid = np.arange(points.shape[0] * points.shape[1]).reshape(points.shape[:2])
    return welded(points.reshape(-1, 3), _grid_faces(grid, flip=False))


def _grid_faces(grid: I64, flip: bool) -> I64:
    a, b, c, d = grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]
    faces = np.concatenate(
        [np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)]
    )
    return faces[:, ::-1] if flip else faces


def _rotation(axis: int, angle: float) -> F64:
    c, s = np.cos(angle), np.sin(angle)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    R = np.eye(3)
    R[i, i], R[i, j], R[j, i], R[j, j] = c, -s, s, c
    return R
