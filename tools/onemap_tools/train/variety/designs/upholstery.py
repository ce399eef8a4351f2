"""Soft bodies, bent sheets and walls that furniture of many designs shares."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from onemap_shared.geometry import F64, I64
from onemap_simulator.generation.mesh import Mesh, Vec, box, ellipsoid, from_faces, lathe
from onemap_simulator.generation.model import Material, Model, Part, SupportSurface
from onemap_simulator.generation.sampler import Sampler

Group = tuple[Material, list[Mesh]]


def loft(rings: F64, capped: bool = True) -> Mesh:
    """Skin over rings (R, N, 3) of either winding, turned outside out."""
    count, around = rings.shape[:2]
    index = np.arange(count * around).reshape(count, around)
    ahead = np.roll(index, -1, axis=1)
    quads = np.stack([index[:-1], ahead[:-1], ahead[1:], index[1:]], axis=-1).reshape(-1, 4)
    faces = [quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]
    vertices = rings.reshape(-1, 3)
    if capped:
        vertices = np.concatenate([vertices, rings[[0, -1]].mean(axis=1)])
        low, high = np.full(around, count * around), np.full(around, count * around + 1)
        faces.append(np.stack([low, ahead[0], index[0]], axis=1))
        faces.append(np.stack([high, index[-1], ahead[-1]], axis=1))
    return _outside_out(vertices, np.concatenate(faces))


def _outside_out(vertices: F64, faces: I64) -> Mesh:
    a, b, c = (vertices - vertices.mean(axis=0))[faces].transpose(1, 0, 2)
    inside_out = np.einsum("ij,ij->", a, np.cross(b, c)) < 0
    return from_faces(vertices, faces[:, ::-1] if inside_out else faces)


def puff(
    size: Vec, at: Vec = (0, 0, 0), plan: float = 6.0, rise: float = 3.0, around: int = 20
) -> Mesh:
    """A stuffed body on ``at``: the exponents make its outline and its side round (2) or square."""
    turn = np.linspace(0, 2 * np.pi, around, endpoint=False)
    up = np.linspace(-np.pi / 2, np.pi / 2, 9 if around > 16 else 7)
    reach = np.abs(np.cos(up)) ** (2 / rise)
    reach[[0, -1]] = 0.0
    height = np.sign(np.sin(up)) * np.abs(np.sin(up)) ** (2 / rise)
    rings = np.empty((len(up), len(turn), 3))
    rings[..., 0] = np.outer(reach, np.sign(np.cos(turn)) * np.abs(np.cos(turn)) ** (2 / plan))
    rings[..., 1] = np.outer(reach, np.sign(np.sin(turn)) * np.abs(np.sin(turn)) ** (2 / plan))
    rings[..., 2] = height[:, None]
    body = loft(rings * (np.asarray(size) / 2), capped=False)
    return body.translated(at[0], at[1], at[2] + size[2] / 2)


def wall(
    path: ArrayLike, lower: ArrayLike, upper: ArrayLike, thickness: float, soft: float = 0.03
) -> Mesh:
    """An upright board along the plan ``path`` (N, 2), between heights given along it."""
    plan = np.asarray(path, dtype=np.float64)
    low = np.broadcast_to(np.asarray(lower, dtype=np.float64), len(plan))
    high = np.broadcast_to(np.asarray(upper, dtype=np.float64), len(plan))
    tangent = np.gradient(plan, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    half, r = thickness / 2, min(soft, thickness * 0.49, float((high - low).min()) * 0.49)
    k = 0.3 * r
    section = [(-half, 0, r), (-half, 1, -r), (-half + k, 1, -k), (-half + r, 1, 0)]
    section += [(half - r, 1, 0), (half - k, 1, -k), (half, 1, -r), (half, 0, r)]
    section += [(half - r, 0, 0), (-half + r, 0, 0)]
    rings = np.empty((len(plan), len(section), 3))
    for i, (across, top, dz) in enumerate(section):
        rings[:, i, 0] = plan[:, 0] - across * tangent[:, 1]
        rings[:, i, 1] = plan[:, 1] + across * tangent[:, 0]
        rings[:, i, 2] = (high if top else low) + dz
    return loft(rings)


def bent(path: ArrayLike, thickness: float, width: float) -> Mesh:
    """A sheet of constant thickness and width (x) along a side view ``path`` (N, 2) of y, z."""
    side = np.asarray(path, dtype=np.float64)
    tangent = np.gradient(side, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    normal = np.stack([-tangent[:, 1], tangent[:, 0]], axis=1) * thickness / 2
    rings = np.empty((len(side), 4, 3))
    for i, (x, s) in enumerate(((-0.5, -1), (0.5, -1), (0.5, 1), (-0.5, 1))):
        rings[:, i, 0] = x * width
        rings[:, i, 1:] = side + s * normal
    return loft(rings)


def shell(grid: F64, thickness: float) -> Mesh:
    """A sheet through the points of ``grid`` (U, V, 3), thickened on the side of its normals."""
    along, across = np.gradient(grid, axis=0), np.gradient(grid, axis=1)
    normal = np.cross(along, across)
    normal /= np.maximum(np.linalg.norm(normal, axis=2, keepdims=True), 1e-9)
    rows, columns = grid.shape[:2]
    front = np.arange(rows * columns).reshape(rows, columns)
    behind = front + rows * columns
    rim = [front[0], front[1:, -1], front[-1, -2::-1], front[-2:0:-1, 0]]
    edge = np.concatenate(rim)
    ahead, deep = np.roll(edge, -1), rows * columns
    quads = [
        np.stack([f[:-1, :-1], f[:-1, 1:], f[1:, 1:], f[1:, :-1]], axis=-1).reshape(-1, 4)
        for f in (front, behind[::-1])
    ]
    quads.append(np.stack([ahead, edge, edge + deep, ahead + deep], axis=-1))
    flat = np.concatenate(quads)
    faces = np.concatenate([flat[:, [0, 1, 2]], flat[:, [0, 2, 3]]])
    points = np.concatenate([grid.reshape(-1, 3), (grid + thickness * normal).reshape(-1, 3)])
    return _outside_out(points, faces)


def tufted(size: Vec, columns: int, rows: int) -> list[Mesh]:
    """A buttoned pad that faces -y, its back at y = 0, standing on z = 0, and its buttons."""
    width, depth, height = size
    u = np.linspace(0, 1, 4 * columns + 1)
    v = np.linspace(0, 1, 4 * rows + 1)
    a, b = np.meshgrid(u * columns, v * rows, indexing="xy")
    quilt = np.sqrt(np.abs(np.sin(np.pi * (a + b) / 2) * np.sin(np.pi * (a - b) / 2)))
    edge = np.minimum(1, 6 * np.minimum.reduce([a, b, columns - a, rows - b]) + 0.25)
    out = -depth * (0.55 + 0.45 * quilt) * edge
    x, z = (a / columns - 0.5) * width, b / rows * height
    index = np.arange(x.size).reshape(x.shape)
    quads = np.stack([index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]], axis=-1)
    flat = quads.reshape(-1, 4)
    faces = np.concatenate([flat[:, [0, 1, 2]], flat[:, [0, 2, 3]]])
    pad = from_faces(np.stack([x, out, z], axis=-1).reshape(-1, 3), faces)
    inset = box((width, depth * 0.14, height), (0, -depth * 0.06, 0))
    buttons = [
        ellipsoid(
            (0.014, 0.012, 0.014),
            (width * (i / columns - 0.5), -depth * 0.56, height * j / rows),
            6,
        )
        for i in range(1, columns)
        for j in range(1, rows)
        if (i + j) % 2 == 0
    ]
    return [pad, inset, *buttons]


def seat_area(inner: float, z: float) -> tuple[SupportSurface, ...]:
    """The strip of the seat on which something may lie."""
    half = max(inner / 2 - 0.1, 0.1)
    return (SupportSurface(-half, -0.2, half, 0.05, z),)


def leaning(size: Vec, x: float, y: float, z: float, slant: float = 10.0) -> Mesh:
    """A loose back cushion whose back stands at y."""
    rest = puff(size, (0, -size[1] / 2, 0), 6, 3.4)
    return rest.rotated("x", -slant).translated(x, y, z)


def roll(radius: float, length: float, axis: str, at: Vec, segments: int = 14) -> Mesh:
    """A bolster with rounded ends about ``at``, its centre, along axis x or y."""
    r, k = radius, min(radius * 0.35, length * 0.2)
    profile = [(r - k, 0.0), (r - 0.3 * k, 0.3 * k), (r, k), (r, length - k)]
    profile += [(r - 0.3 * k, length - 0.3 * k), (r - k, length)]
    body = lathe(profile, (0, 0, -length / 2), segments)
    turned = body.rotated("y", 90) if axis == "x" else body.rotated("x", 90)
    return turned.translated(*at)


def other(sampler: Sampler, cover: Material, same: float = 0.6) -> Material:
    """The same cover with that probability, otherwise one of its own."""
    return cover if sampler.chance(same) else sampler.upholstery()


def sideways(model: Model) -> Model:
    """The model turned so that its right side becomes its back."""
    parts = tuple(Part(part.mesh.rotated("z", 90), part.material) for part in model.parts)
    surfaces = tuple(
        SupportSurface(-s.y_max, s.x_min, -s.y_min, s.x_max, s.z) for s in model.support_surfaces
    )
    return Model(model.category, parts, surfaces)


def settled(model: Model) -> Model:
    """The model moved so that it stands on z = 0, centred about x = 0 and y = 0."""
    x, y, _ = (-(model.lower + model.upper) / 2).tolist()
    z = -float(model.lower[2])
    parts = tuple(Part(part.mesh.translated(x, y, z), part.material) for part in model.parts)
    surfaces = tuple(
        SupportSurface(s.x_min + x, s.y_min + y, s.x_max + x, s.y_max + y, s.z + z)
        for s in model.support_surfaces
    )
    return Model(model.category, parts, surfaces)
