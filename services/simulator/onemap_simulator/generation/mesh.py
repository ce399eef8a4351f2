"""Meshes, the primitives they are made of, and models: the meshes and materials of one object.

Metres, z up. Bodies stand on ``at``, the centre of their lowest face, unless said otherwise; faces
wind counter-clockwise seen from outside. A model's base is at z = 0, its width along x, its front
towards -y and its back towards +y, where a wall would be.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from onemap_shared.geometry import F64, I64, U8

Vec = tuple[float, float, float]
ORIGIN: Vec = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Mesh:
    """vertices (V, 3) float64 metres; faces (F, 3) int64; uv (F, 3, 2) float64.

    uv is in metres along the surface (a texture then repeats by its tile size), or
    0 to 1 across a panel that shows one whole image.
    """

    vertices: F64
    faces: I64
    uv: F64

    def translated(self, x: float, y: float, z: float = 0.0) -> Mesh:
        """The mesh shifted by metres."""
        return Mesh(self.vertices + (x, y, z), self.faces, self.uv)

    def rotated(self, axis: str, degrees: float) -> Mesh:
        """The mesh rotated about the origin, counter-clockwise seen against axis x, y or z."""
        return Mesh(self.vertices @ rotation(axis, degrees).T, self.faces, self.uv)

    def scaled(self, x: float, y: float, z: float) -> Mesh:
        """The mesh scaled about the origin by positive factors."""
        return Mesh(self.vertices * (x, y, z), self.faces, self.uv)


def rotation(axis: str, degrees: float) -> F64:
    """Rotation matrix (3, 3) about x, y or z."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    i, j = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    R = np.eye(3)
    R[i, i], R[i, j], R[j, i], R[j, j] = c, -s, s, c
    return R


def _cross(a: F64, b: F64) -> F64:
    """As ``np.cross`` of vectors (..., 3), several times faster for the few of one model."""
    (x, y, z), (u, v, w) = ([each[..., k] for k in range(3)] for each in (a, b))
    return np.stack([y * w - z * v, z * u - x * w, x * v - y * u], axis=-1)


def from_faces(vertices: ArrayLike, faces: ArrayLike) -> Mesh:
    """A mesh with metric box-mapped uv: each face is projected along its dominant normal axis."""
    points = np.asarray(vertices, dtype=np.float64)
    index = np.asarray(faces, dtype=np.int64)
    corners = points[index]
    normals = _cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    keep = np.linalg.norm(normals, axis=1) > 1e-12
    index, corners, normals = index[keep], corners[keep], normals[keep]
    axis = np.abs(normals).argmax(axis=1)
    along = np.array([[1, 2], [0, 2], [0, 1]])[axis]
    uv = corners[np.arange(len(corners))[:, None, None], np.arange(3)[:, None], along[:, None]]
    upright = axis < 2
    uv[upright, :, 1] *= -1  # image rows run downwards
    return Mesh(points, index, uv)


def box(size: Vec, at: Vec = ORIGIN) -> Mesh:
    """A cuboid of width (x), depth (y) and height (z)."""
    unit = np.array([[x, y, z] for z in (0, 1) for y in (-0.5, 0.5) for x in (-0.5, 0.5)])
    quads = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    return from_faces(unit * size + at, _split(np.array(quads)))


def box_between(lower: Vec, upper: Vec) -> Mesh:
    """The cuboid between two opposite corners."""
    (x0, y0, z0), (x1, y1, z1) = lower, upper
    return box((x1 - x0, y1 - y0, z1 - z0), ((x0 + x1) / 2, (y0 + y1) / 2, z0))


def rounded_box(size: Vec, at: Vec = ORIGIN, radius: float = 0.04) -> Mesh:
    """A cuboid with edges and corners rounded by ``radius`` (at most half its thinnest side)."""
    half = np.asarray(size, dtype=np.float64) / 2
    radius = min(radius, float(half.min()) * 0.99)
    longitude = np.radians([0, 45, 90, 90, 135, 180, 180, 225, 270, 270, 315, 360])
    latitude = np.radians([-90, -45, 0, 0, 45, 90])
    sign_x, sign_y = np.repeat([1, -1, -1, 1], 3), np.repeat([1, 1, -1, -1], 3)
    sign_z = np.repeat([-1, 1], 3)
    inner = half - radius
    rings = np.empty((6, 12, 3))
    rings[..., 0] = radius * np.outer(np.cos(latitude), np.cos(longitude)) + inner[0] * sign_x
    rings[..., 1] = radius * np.outer(np.cos(latitude), np.sin(longitude)) + inner[1] * sign_y
    rings[..., 2] = (radius * np.sin(latitude) + inner[2] * sign_z)[:, None]
    return _loft(rings).translated(at[0], at[1], at[2] + half[2])


def lathe(
    profile: Sequence[tuple[float, float]],
    at: Vec = ORIGIN,
    segments: int = 16,
    *,
    capped: bool = True,
) -> Mesh:
    """The surface of revolution about z of (radius, height) pairs, from the bottom of the outside.

    ``capped`` closes the first and last ring with discs; a closed profile needs no caps.
    """
    radius, height = np.asarray(profile, dtype=np.float64).T
    angle = np.linspace(0, 2 * np.pi, segments, endpoint=False)
    rings = np.empty((len(radius), segments, 3))
    rings[..., 0] = np.outer(radius, np.cos(angle))
    rings[..., 1] = np.outer(radius, np.sin(angle))
    rings[..., 2] = height[:, None]
    return _loft(rings, capped=capped).translated(*at)


def cylinder(radius: float, height: float, at: Vec = ORIGIN, segments: int = 14) -> Mesh:
    """An upright cylinder."""
    return lathe([(radius, 0.0), (radius, height)], at, segments)


def knob(radius: float, length: float, at: Vec, segments: int = 10, *, axis: str = "x") -> Mesh:
    """A cylinder from ``at`` towards -y, or towards +x if it is turned about y."""
    return cylinder(radius, length, segments=segments).rotated(axis, 90).translated(*at)


def cone(radii: tuple[float, float], height: float, at: Vec = ORIGIN, segments: int = 14) -> Mesh:
    """An upright truncated cone with (lower, upper) radius."""
    return lathe([(radii[0], 0.0), (radii[1], height)], at, segments)


def ellipsoid(radii: Vec, at: Vec = ORIGIN, segments: int = 12) -> Mesh:
    """An ellipsoid around ``at``, its centre."""
    angle = np.linspace(-np.pi / 2, np.pi / 2, max(segments // 2, 3) + 1)
    profile = list(zip(np.cos(angle).tolist(), np.sin(angle).tolist(), strict=True))
    ball = lathe(profile, ORIGIN, segments).scaled(*radii)
    return from_faces(ball.vertices + at, ball.faces)


def tube(points: ArrayLike, radius: float, segments: int = 6, closed: bool = False) -> Mesh:
    """A round tube of constant radius along (N, 3) points; ``closed`` joins the ends."""
    path = np.asarray(points, dtype=np.float64)
    if closed:
        ahead, behind = np.roll(path, -1, axis=0), np.roll(path, 1, axis=0)
        tangents = ahead - behind
    else:
        tangents = np.gradient(path, axis=0)
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    # One reference for the whole tube: the axis least aligned with it, so that rings do not twist.
    reference = np.eye(3)[np.abs(tangents).max(axis=0).argmin()]
    side = _cross(tangents, reference)
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    other = _cross(tangents, side)
    angle = np.linspace(0, 2 * np.pi, segments, endpoint=False)
    circle = np.cos(angle)[:, None] * side[:, None] + np.sin(angle)[:, None] * other[:, None]
    rings = path[:, None] + radius * circle
    return _loft(np.concatenate([rings, rings[:1]]) if closed else rings, capped=not closed)


def rod(start: Vec, end: Vec, radius: float, segments: int = 8) -> Mesh:
    """A straight round bar between two points."""
    return tube([start, end], radius, segments)


def torus(radius: float, thickness: float, at: Vec = ORIGIN, segments: int = 20) -> Mesh:
    """A torus lying flat around ``at``: ring radius and tube radius."""
    angle = np.linspace(0, 2 * np.pi, segments, endpoint=False)
    circle = np.stack([np.cos(angle), np.sin(angle), np.zeros(segments)], axis=1) * radius
    return tube(circle + at, thickness, 6, closed=True)


def prism(outline: ArrayLike, height: float, at: Vec = ORIGIN) -> Mesh:
    """A star-shaped outline (N, 2), counter-clockwise about its mean, raised by ``height``."""
    flat = np.asarray(outline, dtype=np.float64)
    rings = np.zeros((2, len(flat), 3))
    rings[:, :, :2] = flat
    rings[1, :, 2] = height
    return _loft(rings).translated(*at)


def panel(corner: Vec, edge_u: Vec, edge_v: Vec) -> Mesh:
    """A rectangle that shows one whole image: its top left corner, right edge and down edge."""
    origin, u, v = np.asarray(corner, float), np.asarray(edge_u, float), np.asarray(edge_v, float)
    vertices = np.stack([origin, origin + v, origin + u + v, origin + u])
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    uv = np.array([[0.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, 0.0]])
    return Mesh(vertices, faces, uv[faces])


def front_panel(width: float, height: float, at: Vec) -> Mesh:
    """An upright panel that faces -y; ``at`` is the middle of its lower edge."""
    x, y, z = at
    return panel((x - width / 2, y, z + height), (width, 0.0, 0.0), (0.0, 0.0, -height))


def corners(x: float, y: float) -> list[tuple[float, float]]:
    """The four places (+-x, +-y)."""
    return [(-x, -y), (-x, y), (x, -y), (x, y)]


def spread(count: int, pitch: float) -> list[float]:
    """``count`` places ``pitch`` apart, around 0."""
    return [(index - (count - 1) / 2) * pitch for index in range(count)]


@dataclass(frozen=True, slots=True, eq=False)
class Material:
    """An albedo texture (h, w, 3) uint8 RGB that repeats every ``tile_m`` metres.

    A panel's uv runs from 0 to 1, so its material has ``tile_m`` 1. Compared by identity.
    """

    texture: U8
    tile_m: float = 1.0


class Part(NamedTuple):
    """A mesh and its material."""

    mesh: Mesh
    material: Material


class Top(NamedTuple):
    """A horizontal rectangle in the local frame, metres, on which small objects may stand."""

    x_min: float
    y_min: float
    x_max: float
    y_max: float
    z: float


@dataclass(frozen=True, slots=True, eq=False)
class Model:
    """One object in its local frame; small objects may stand on its tops."""

    category: str
    parts: tuple[Part, ...]
    tops: tuple[Top, ...] = ()

    @property
    def lower(self) -> F64:
        """The smallest x, y, z (3,) in metres."""
        least: F64 = np.min([part.mesh.vertices.min(axis=0) for part in self.parts], axis=0)
        return least

    @property
    def upper(self) -> F64:
        """The largest x, y, z (3,) in metres."""
        most: F64 = np.max([part.mesh.vertices.max(axis=0) for part in self.parts], axis=0)
        return most


def assemble(
    category: str, *groups: tuple[Material, list[Mesh]], tops: Sequence[Top] = ()
) -> Model:
    """A model from groups of meshes that share a material."""
    parts = tuple(Part(mesh, material) for material, meshes in groups for mesh in meshes)
    return Model(category, parts, tuple(tops))


def top(width: float, depth: float, z: float, margin: float = 0.04) -> Top:
    """A top centred on the local origin, with a margin to its edges."""
    x, y = max(width / 2 - margin, 0.01), max(depth / 2 - margin, 0.01)
    return Top(-x, -y, x, y, z)


def _split(quads: I64) -> I64:
    return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def _loft(rings: F64, capped: bool = True) -> Mesh:
    """Skin over rings (R, N, 3), counter-clockwise seen from the last; the end rings are filled."""
    count, around = rings.shape[:2]
    index = np.arange(count * around).reshape(count, around)
    ahead = np.roll(index, -1, axis=1)
    quads = np.stack([index[:-1], ahead[:-1], ahead[1:], index[1:]], axis=-1).reshape(-1, 4)
    faces = [_split(quads)]
    vertices = rings.reshape(-1, 3)
    if capped:
        centres = np.stack([rings[0].mean(axis=0), rings[-1].mean(axis=0)])
        vertices = np.concatenate([vertices, centres])
        low, high = np.full(around, count * around), np.full(around, count * around + 1)
        faces.append(np.stack([low, ahead[0], index[0]], axis=1))
        faces.append(np.stack([high, index[-1], ahead[-1]], axis=1))
    return from_faces(vertices, np.concatenate(faces))
