"""Shapes that tables, desks and chests share: outlines, skins, leaning bars, turned legs."""

from __future__ import annotations

import numpy as np

from onemap_shared.geometry import F64
from onemap_simulator.generation.mesh import Mesh, box, from_faces, lathe, prism, tube
from onemap_simulator.generation.model import Material, Model, assemble
from onemap_simulator.generation.sampler import Sampler

Spot = tuple[float, float]
SIDES = (-1, 1)


def corners(width: float, depth: float, inset: float = 0.0) -> list[Spot]:
    """The four corners of a rectangle, pulled inwards by ``inset``."""
    x, y = width / 2 - inset, depth / 2 - inset
    return [(sx * x, sy * y) for sx in SIDES for sy in SIDES]


def oval(width: float, depth: float, power: float = 2.0, count: int = 28) -> F64:
    """A superellipse (count, 2): power 2 is an ellipse, larger is squarer."""
    angle = np.linspace(0, 2 * np.pi, count, endpoint=False)
    c, s = np.cos(angle), np.sin(angle)
    x = np.sign(c) * np.abs(c) ** (2 / power) * width / 2
    y = np.sign(s) * np.abs(s) ** (2 / power) * depth / 2
    return np.stack([x, y], axis=1)


def racetrack(width: float, depth: float, radius: float, steps: int = 5) -> F64:
    """A rectangle with rounded corners, counter-clockwise."""
    radius = min(radius, width / 2 - 0.002, depth / 2 - 0.002)
    arc = np.radians(np.linspace(0, 90, steps))
    points = []
    for quarter, (sx, sy) in enumerate(((1, 1), (-1, 1), (-1, -1), (1, -1))):
        angle = arc + quarter * np.pi / 2
        x = sx * (width / 2 - radius) + radius * np.cos(angle)
        y = sy * (depth / 2 - radius) + radius * np.sin(angle)
        points.append(np.stack([x, y], axis=1))
    return np.concatenate(points)


def skin(rings: F64) -> Mesh:
    """A closed body over rings (R, N, 3), counter-clockwise seen from above, lowest first."""
    count, around = rings.shape[:2]
    index = np.arange(count * around).reshape(count, around)
    ahead = np.roll(index, -1, axis=1)
    a, b, c, d = (q.ravel() for q in (index[:-1], ahead[:-1], ahead[1:], index[1:]))
    low, high = np.full(around, count * around), np.full(around, count * around + 1)
    triangles = [(a, b, c), (a, c, d), (low, ahead[0], index[0]), (high, index[-1], ahead[-1])]
    faces = np.concatenate([np.stack(each, axis=1) for each in triangles])
    ends = np.stack([rings[0].mean(axis=0), rings[-1].mean(axis=0)])
    return from_faces(np.concatenate([rings.reshape(-1, 3), ends]), faces)


def slab(outline: F64, thickness: float, z: float, under: float = 0.0) -> Mesh:
    """A board of an outline; its lower half is chamfered inwards by ``under`` metres."""
    if under <= 0.0:
        return prism(outline, thickness, (0.0, 0.0, z))
    shrunk = outline * (1 - 2 * under / np.ptp(outline, axis=0))
    levels = [(shrunk, z), (outline, z + thickness * 0.5), (outline, z + thickness)]
    return skin(np.stack([np.column_stack([flat, np.full(len(flat), h)]) for flat, h in levels]))


def lean(mesh: Mesh, x: float, y: float) -> Mesh:
    """The mesh sheared so that its top moves by (x, y); its ends stay level."""
    z = mesh.vertices[:, 2]
    share = (z - z.min()) / np.ptp(z)
    return from_faces(mesh.vertices + share[:, None] * np.array([x, y, 0.0]), mesh.faces)


def stretch(section: Spot, start: tuple[float, float, float], end: Spot, height: float) -> Mesh:
    """A bar with a level ``section`` from ``start`` up by ``height`` to (x, y) ``end``."""
    bar = box((section[0], section[1], height))
    return lean(bar, end[0] - start[0], end[1] - start[1]).translated(*start)


def turned(sampler: Sampler, radius: float, height: float) -> Mesh:
    """A leg or column turned on a lathe: beads, waists and a vase, drawn at random."""
    levels, profile = [0.0], [(radius * 0.6, 0.0)]
    while levels[-1] < 0.8:
        levels.append(levels[-1] + sampler.uniform(0.06, 0.22))
        profile.append((radius * sampler.uniform(0.45, 1.0), levels[-1]))
        if sampler.chance(0.5):
            profile.append((radius * 0.5, levels[-1] + 0.02))
            levels.append(levels[-1] + 0.04)
            profile.append((radius, levels[-1]))
    profile += [(radius, levels[-1] + 0.05)]
    top = profile[-1][1]
    return lathe([(r, h / top * height) for r, h in profile], segments=10)


def claw(reach: float, height: float, radius: float, degrees: float) -> list[Mesh]:
    """A curved foot from the axis outwards to the floor, with a pad."""
    share = np.linspace(0, 1, 7)
    path = np.stack(
        [0.02 + share * (reach - 0.02), share * 0, radius + (height - radius) * (1 - share) ** 2],
        axis=1,
    )
    pad = lathe([(radius * 1.1, 0), (radius * 1.3, radius * 0.6), (radius, radius * 1.6)])
    return [m.rotated("z", degrees) for m in (tube(path, radius, 7), pad.translated(reach, 0, 0))]


def frame(sampler: Sampler) -> Material:
    """What legs are made of: wood or metal."""
    return sampler.wood() if sampler.chance(0.5) else sampler.metal()


def board(sampler: Sampler) -> Material:
    """What a top is made of: wood mostly, else stone, lacquer or glass."""
    if sampler.chance(0.6):
        return sampler.wood()
    return sampler.choice([sampler.ceramic, sampler.enamel, sampler.pale, sampler.dark])()


def centred(model: Model) -> Model:
    """The model with the middle of its bounding box, from above, at the origin."""
    x, y = (-(model.lower + model.upper) / 2)[:2].tolist()
    groups = [(part.material, [part.mesh.translated(x, y)]) for part in model.parts]
    tops = tuple(
        top._replace(
            x_min=top.x_min + x, x_max=top.x_max + x, y_min=top.y_min + y, y_max=top.y_max + y
        )
        for top in model.support_surfaces
    )
    return assemble(model.category, *groups, support_surfaces=tops)
