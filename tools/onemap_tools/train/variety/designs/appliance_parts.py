"""Parts that kitchen appliances share: slabs, handles, grilles, open shells, food."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from onemap_simulator.generation.mesh import (
    ORIGIN,
    Mesh,
    Vec,
    box,
    box_between,
    cylinder,
    ellipsoid,
    from_faces,
    lathe,
    prism,
    rod,
    rounded_box,
    torus,
    tube,
)
from onemap_simulator.generation.model import Material, Model, Part
from onemap_simulator.generation.sampler import Sampler

Outline = list[tuple[float, float]]


def round_rect(width: float, height: float, low: float, high: float) -> Outline:
    """A rectangle on z = 0 with corners rounded by ``low`` below and ``high`` above."""
    points: Outline = []
    half = width / 2
    upper = height - high
    corners = ((1, low, low, -90), (1, upper, high, 0), (-1, upper, high, 90), (-1, low, low, 180))
    for side, z, radius, start in corners:
        for angle in np.radians(np.linspace(start, start + 90, 6)):
            x = side * (half - radius) + radius * float(np.cos(angle))
            points.append((x, z + radius * float(np.sin(angle))))
    return points


def slab(outline: Sequence[tuple[float, float]], thick: float, at: Vec = ORIGIN) -> Mesh:
    """An upright outline (x, z) that reaches from ``at`` towards the front by ``thick``."""
    return prism(outline, thick).rotated("x", 90).translated(*at)


def extruded(outline: Sequence[tuple[float, float]], width: float, x: float = 0.0) -> Mesh:
    """A side view (y, z), counter-clockwise and star-shaped, drawn out to ``width`` about x."""
    body = prism(outline, width)
    return from_faces(body.vertices[:, [2, 0, 1]] + (x - width / 2, 0, 0), body.faces)


def disc(radius: float, thick: float, at: Vec, segments: int = 14) -> Mesh:
    """A disc that faces the front: ``at`` is the centre of its back."""
    return cylinder(radius, thick, segments=segments).rotated("x", 90).translated(*at)


def ring(radius: float, thick: float, at: Vec, segments: int = 22) -> Mesh:
    """An upright ring that faces the front."""
    return torus(radius, thick, segments=segments).rotated("x", 90).translated(*at)


def turned(meshes: list[Mesh], degrees: float, pivot: tuple[float, float]) -> list[Mesh]:
    """Swung about the upright line through (x, y)."""
    x, y = pivot
    return [m.translated(-x, -y).rotated("z", degrees).translated(x, y) for m in meshes]


def tilted(meshes: list[Mesh], degrees: float, pivot: tuple[float, float]) -> list[Mesh]:
    """Swung about the level line along x through (y, z); positive folds the top to the front."""
    y, z = pivot
    return [m.translated(0, -y, -z).rotated("x", degrees).translated(0, y, z) for m in meshes]


def centred(model: Model) -> Model:
    """The model moved so that its bounding box is centred; for those with an open door."""
    x, y = (-(model.lower + model.upper) / 2)[:2]
    parts = tuple(Part(p.mesh.translated(float(x), float(y)), p.material) for p in model.parts)
    return Model(model.category, parts)


def rubber(sampler: Sampler) -> Material:
    """Rubber or grey plastic of gaskets, plinths and hinges."""
    return sampler.material("plain", 0.5, sampler.grey(0.05, 0.5))


def grip(sampler: Sampler, length: float, at: Vec, upright: bool) -> list[Mesh]:
    """A handle on a front whose middle is ``at``: tube, plate, bow, bracket or ledge."""
    half, out = length / 2, sampler.uniform(0.03, 0.055)
    thick = sampler.uniform(0.007, 0.014)
    kind = sampler.integer(0, 4)
    if kind == 0:
        meshes = [rod((0, -out, -half), (0, -out, half), thick)]
        for end in (-0.8, 0.8):
            meshes.append(rod((0, 0.005, end * half), (0, -out, end * half), thick * 0.8, 6))
    elif kind == 1:
        meshes = [rounded_box((thick * 4, 0.014, length), (0, -out, -half), 0.006)]
        for end in (-0.75, 0.75):
            meshes.append(box((thick * 2, out, 0.03), (0, -out / 2, end * half - 0.015)))
    elif kind == 2:
        angle = np.linspace(0, np.pi, 9)
        arc = [(0.0, -out * np.sin(a) + 0.004, -half * np.cos(a)) for a in angle]
        meshes = [tube(arc, thick)]
    elif kind == 3:
        bend = [(0.0, 0.005, -half), (0.0, -out, -half + 0.012), (0.0, -out, half - 0.012)]
        meshes = [tube([*bend, (0.0, 0.005, half)], thick)]
    else:
        meshes = [box((0.014, out, length), (0, -out / 2 + 0.002, -half))]
        meshes.append(box((0.035, 0.01, length), (0.0105, -out, -half)))
    if not upright:
        meshes = [m.rotated("y", 90) for m in meshes]
    return [m.translated(*at) for m in meshes]


def slats(width: float, height: float, at: Vec, count: int) -> list[Mesh]:
    """Level slats one above another from ``at``, the middle of the lower edge."""
    pitch = height / count
    x, y, z = at
    return [box((width, 0.012, pitch * 0.55), (x, y, z + i * pitch)) for i in range(count)]


def shell(lower: Vec, upper: Vec, wall: float) -> list[Mesh]:
    """A box without its front: floor, top, back and sides."""
    (x0, y0, z0), (x1, y1, z1) = lower, upper
    return [
        box_between((x0, y0, z0), (x1, y1, z0 + wall)),
        box_between((x0, y0, z1 - wall), (x1, y1, z1)),
        box_between((x0, y0, z0 + wall), (x0 + wall, y1, z1 - wall)),
        box_between((x1 - wall, y0, z0 + wall), (x1, y1, z1 - wall)),
        box_between((x0 + wall, y1 - wall, z0 + wall), (x1 - wall, y1, z1 - wall)),
    ]


def feet(width: float, depth: float, height: float, radius: float = 0.022) -> list[Mesh]:
    """Four round feet under the corners."""
    return [
        cylinder(radius, height, (x * (width / 2 - 0.06), y * (depth / 2 - 0.07), 0), 10)
        for x in (-1, 1)
        for y in (-1, 1)
    ]


def provisions(sampler: Sampler, width: float, depth: float, room: float, at: Vec) -> list[Mesh]:
    """Bottles, cartons, jars, dishes and fruit on a shelf centred on ``at``, ``room`` high."""
    meshes: list[Mesh] = []
    x = -width / 2 + 0.04
    while x < width / 2 - 0.06:
        tall = room * sampler.uniform(0.4, 0.85)
        wide = min(sampler.uniform(0.03, 0.055), (width / 2 - x) / 2)
        place = (at[0] + x + wide, at[1] + sampler.uniform(-0.15, 0.15) * depth, at[2])
        kind = sampler.integer(0, 4)
        if kind == 0:
            neck = [(wide, 0), (wide, tall * 0.6), (wide * 0.35, tall * 0.8), (wide * 0.35, tall)]
            meshes.append(lathe(neck, place, 10))
        elif kind == 1:
            meshes.append(box((wide * 2, wide * 1.8, tall), place))
        elif kind == 2:
            meshes.append(cylinder(wide, tall * 0.6, place, 10))
        elif kind == 3:
            ball = min(wide, room * 0.4)
            meshes.append(ellipsoid((ball, ball, ball), (place[0], place[1], at[2] + ball), 8))
        else:
            meshes.append(rounded_box((wide * 2, depth * 0.5, tall * 0.5), place, 0.012))
        x += 2 * wide + sampler.uniform(0.01, 0.06)
    return meshes
