"""Bodies that the seats share: bent sheets, swept tubes, turned legs, slabs and cushions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from onemap_shared.geometry import F64
from onemap_simulator.generation.mesh import Mesh, Vec, cylinder, from_faces
from onemap_simulator.generation.model import Material, Model, SupportSurface, assemble

SIDES = (-1.0, 1.0)
Profile = Sequence[tuple[float, float]]


def skin(rings: F64, *, joined: bool = False) -> Mesh:
    """Faces over rings (R, N, 3) with filled ends, or the last ring ``joined`` to the first."""
    count, around = rings.shape[:2]
    index = np.arange(count * around).reshape(count, around)
    if joined:
        index = np.concatenate([index, index[:1]])
    ahead = np.roll(index, -1, axis=1)
    low = np.stack([index[:-1], ahead[:-1], ahead[1:]], axis=-1).reshape(-1, 3)
    high = np.stack([index[:-1], ahead[1:], index[1:]], axis=-1).reshape(-1, 3)
    vertices, faces = rings.reshape(-1, 3), [low, high]
    if not joined:
        ends = np.stack([rings[0].mean(axis=0), rings[-1].mean(axis=0)])
        vertices = np.concatenate([vertices, ends])
        first, last = np.full(around, count * around), np.full(around, count * around + 1)
        faces.append(np.stack([first, ahead[0], index[0]], axis=1))
        faces.append(np.stack([last, index[-1], ahead[-1]], axis=1))
    return from_faces(vertices, np.concatenate(faces))


def swept(path: ArrayLike, radius: float, segments: int = 8, *, closed: bool = False) -> Mesh:
    """A round tube along (N, 3) points that may bend in every direction."""
    points = np.asarray(path, dtype=np.float64)
    if closed:
        tangents = np.roll(points, -1, axis=0) - np.roll(points, 1, axis=0)
    else:
        tangents = np.gradient(points, axis=0)
    tangents = tangents / np.linalg.norm(tangents, axis=1, keepdims=True)
    side = np.cross(tangents[0], np.eye(3)[np.abs(tangents[0]).argmin()])
    angle = np.linspace(0, 2 * np.pi, segments, endpoint=False)
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    rings = np.empty((len(points), segments, 3))
    for at, (point, tangent) in enumerate(zip(points, tangents, strict=True)):
        side = side - tangent * (side @ tangent)
        side = side / np.linalg.norm(side)
        other = np.cross(tangent, side)
        rings[at] = point + radius * (circle @ np.stack([side, other]))
    return skin(rings, joined=closed)


def bent(corners: Sequence[Vec], bend: float, steps: int = 4) -> F64:
    """A polyline (N, 3) whose inner corners are rounded by up to ``bend`` metres."""
    points = np.asarray(corners, dtype=np.float64)
    path = [points[0]]
    for before, here, after in zip(points[:-2], points[1:-1], points[2:], strict=True):
        back, ahead = before - here, after - here
        reach = min(bend, 0.48 * float(np.linalg.norm(back)), 0.48 * float(np.linalg.norm(ahead)))
        start = here + back / np.linalg.norm(back) * reach
        end = here + ahead / np.linalg.norm(ahead) * reach
        for t in np.linspace(0, 1, steps + 1):
            path.append((1 - t) ** 2 * start + 2 * t * (1 - t) * here + t**2 * end)
    return np.array([*path, points[-1]])


def sheet(grid: F64, thickness: float) -> Mesh:
    """A bent sheet around a grid (U, V, 3) of points, its front towards du x dv."""
    u, v = np.gradient(grid, axis=0), np.gradient(grid, axis=1)
    normals = np.cross(u, v)
    normals /= np.maximum(np.linalg.norm(normals, axis=2, keepdims=True), 1e-9)
    rows, columns = grid.shape[:2]
    front = np.arange(rows * columns).reshape(rows, columns)
    back = front + rows * columns
    half = normals * thickness / 2
    quads = []
    for index, flip in ((front, False), (back, True)):
        corner = [index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]]
        quads.append(np.stack(corner[::-1] if flip else corner, axis=-1).reshape(-1, 4))
    edge = np.concatenate([front[0, :-1], front[:-1, -1], front[-1, :0:-1], front[:0:-1, 0]])
    ahead = np.roll(edge, -1)
    under = rows * columns
    quads.append(np.stack([edge, ahead, ahead + under, edge + under], axis=-1))
    faces = np.concatenate(quads)
    triangles = np.concatenate([faces[:, [0, 1, 2]], faces[:, [0, 2, 3]]])
    vertices = np.concatenate([(grid + half).reshape(-1, 3), (grid - half).reshape(-1, 3)])
    return from_faces(vertices, triangles)


def strip(left: Vec, right: Vec, height: float, curve: float, thickness: float) -> Mesh:
    """An upright board between two points, bowed backwards (+y) by ``curve``; faces -y."""
    t = np.linspace(0, 1, 7)
    middle = np.outer(1 - t, left) + np.outer(t, right)
    middle[:, 1] += curve * 4 * t * (1 - t)
    lift = np.array([0.0, 0.0, height])
    return sheet(np.stack([middle, middle + lift], axis=1), thickness)


def turned(start: Vec, end: Vec, profile: Profile, segments: int = 10) -> Mesh:
    """A turned bar between two points; profile of (radius, fraction of the way)."""
    low, high = np.asarray(start, dtype=np.float64), np.asarray(end, dtype=np.float64)
    axis = (high - low) / np.linalg.norm(high - low)
    side = np.cross(axis, np.eye(3)[np.abs(axis).argmin()])
    side /= np.linalg.norm(side)
    other = np.cross(axis, side)
    angle = np.linspace(0, 2 * np.pi, segments, endpoint=False)
    circle = np.outer(np.cos(angle), side) + np.outer(np.sin(angle), other)
    return skin(np.stack([low + (high - low) * t + radius * circle for radius, t in profile]))


def grounded(start: Vec, end: Vec, radii: tuple[float, float], segments: int = 10) -> Mesh:
    """A slanting round leg with a flat horizontal foot; (lower, upper) radius."""
    angle = np.linspace(0, 2 * np.pi, segments, endpoint=False)
    circle = np.stack([np.cos(angle), np.sin(angle), np.zeros(segments)], axis=1)
    return skin(
        np.stack([np.asarray(start) + radii[0] * circle, np.asarray(end) + radii[1] * circle])
    )


def beam(start: Vec, end: Vec, size: tuple[float, float]) -> Mesh:
    """A slanting board with horizontal ends, ``size`` along x and y."""
    x, y = size[0] / 2, size[1] / 2
    section = np.array([(-x, -y, 0), (x, -y, 0), (x, y, 0), (-x, y, 0)])
    low, high = (np.asarray(p, dtype=np.float64) for p in (start, end))
    if low[2] > high[2]:
        low, high = high, low
    return skin(np.stack([low + section, high + section]))


def outline(front: float, back: float, depth: float, square: float = 4.0) -> F64:
    """A rounded trapezoid (N, 2) around the origin; ``square`` 2 is an ellipse, 8 sharp."""
    quarter = np.arange(6) * 15.0 if square < 3.5 else np.array([0, 18, 32, 40, 45, 50, 58, 72.0])
    angle = np.radians(np.concatenate([quarter + turn for turn in (0, 90, 180, 270)]))
    c, s = np.cos(angle), np.sin(angle)
    reach = (np.abs(c) ** square + np.abs(s) ** square) ** (-1 / square)
    y = s * reach
    width = front + (back - front) * (y + 1) / 2
    return np.stack([c * reach * width / 2, y * depth / 2], axis=1)


def slab(shape: F64, height: float, at: Vec, bevel: float = 0.2) -> Mesh:
    """A plate of an outline (N, 2), its edges bevelled by a share of its height."""
    inset = 1 - 2 * bevel * height / max(float(np.ptp(shape[:, 0])), 0.05)
    levels = [(inset, 0.0), (1.0, bevel), (1.0, 1 - bevel), (inset, 1.0)]
    return _stacked(shape, levels, height, at)


def cushion(shape: F64, height: float, at: Vec) -> Mesh:
    """A stuffed pad of an outline (N, 2): round sides and a crowned top."""
    levels = [(0.93, 0.0), (0.99, 0.2), (1.0, 0.4), (0.97, 0.65), (0.88, 0.84), (0.6, 0.97)]
    return _stacked(shape, levels, height, at)


def _stacked(shape: F64, levels: Profile, height: float, at: Vec) -> Mesh:
    rings = np.zeros((len(levels), len(shape), 3))
    for ring, (scale, level) in zip(rings, levels, strict=True):
        ring[:, :2] = shape * scale
        ring[:, 2] = level * height
    return skin(rings).translated(*at)


def tufts(xs: ArrayLike, ys: ArrayLike, z: float, radius: float = 0.012) -> list[Mesh]:
    """Flat buttons at every crossing of xs and ys on a top at height ``z``."""
    return [
        cylinder(radius, 0.008, (float(x), float(y), z - 0.003), 8)
        for x in np.asarray(xs)
        for y in np.asarray(ys)
    ]


def corners(width: float, depth: float) -> list[tuple[float, float]]:
    """The four corners of a centred rectangle."""
    return [(sx * width / 2, sy * depth / 2) for sx in SIDES for sy in SIDES]


def standing(
    category: str,
    *groups: tuple[Material, list[Mesh]],
    support_surfaces: tuple[SupportSurface, ...] = (),
) -> Model:
    """``assemble``, then moved so that it stands on z = 0 with its middle at the origin."""
    model = assemble(category, *groups)
    lower, upper = model.lower, model.upper
    x, y = (-(lower + upper)[:2] / 2).tolist()
    z = -float(lower[2])
    moved = tuple((m, [mesh.translated(x, y, z) for mesh in meshes]) for m, meshes in groups)
    surfaces = tuple(
        SupportSurface(s.x_min + x, s.y_min + y, s.x_max + x, s.y_max + y, s.z + z)
        for s in support_surfaces
    )
    return assemble(category, *moved, support_surfaces=surfaces)
