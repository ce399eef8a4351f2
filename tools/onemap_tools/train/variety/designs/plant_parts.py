"""Pots, plant stands and leaves."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from onemap_simulator.generation.mesh import Mesh, box, cylinder, from_faces, lathe, rod, torus
from onemap_simulator.generation.model import Material, Model
from onemap_simulator.generation.sampler import Sampler
from onemap_tools.train.variety.designs.flat_forms import settled

Groups = list[tuple[Material, list[Mesh]]]

# Half widths of a leaf from its base to its tip, of the widest.
LANCE = (0.15, 0.8, 1.0, 0.75, 0.4, 0.02)
OVAL = (0.1, 0.75, 1.0, 0.95, 0.65, 0.02)
STRAP = (0.7, 0.9, 1.0, 0.95, 0.7, 0.02)
HEART = (0.75, 1.0, 0.9, 0.65, 0.35, 0.02)
SPLIT = (0.7, 1.0, 0.5, 1.0, 0.45, 0.9, 0.35, 0.7, 0.25, 0.02)
FERN = (0.25, 0.75, 0.3, 1.0, 0.4, 1.0, 0.4, 0.9, 0.35, 0.75, 0.25, 0.55, 0.2, 0.3, 0.02)


class Pot(NamedTuple):
    """A pot's parts, the height of its soil and the radius there."""

    groups: Groups
    soil_z: float
    radius: float


def pot(sampler: Sampler, radius: float, *, low: bool = False) -> Pot:
    """A pot of earthenware, a cylinder, bowl, belly, cube, trough or basket, some on a stand."""
    kind, lift = sampler.integer(0, 5), 0.0
    high = radius * (sampler.uniform(0.6, 1.0) if low else sampler.uniform(1.3, 2.1))
    r = radius
    walls = {
        0: [(r * 0.65, 0), (r * 0.9, high * 0.78), (r, high * 0.78), (r * 1.02, high)],
        1: [(r * 0.97, 0), (r, high * 0.02), (r, high)],
        2: [(r * 0.4, 0), (r * 0.75, high * 0.25), (r * 0.95, high * 0.65), (r, high)],
        3: [(r * 0.6, 0), (r * 1.1, high * 0.4), (r * 0.98, high * 0.85), (r * 0.9, high)],
    }
    if kind in walls:
        edge = walls[kind][-1][0]
        inside = [(edge - 0.012, high), (edge - 0.014, high * 0.86), (0.003, high * 0.86)]
        bodies = [lathe([*walls[kind], *inside], segments=18)]
    elif kind == 4:
        side = 0.88 * r * 2**0.5
        flare = sampler.uniform(0.75, 1.0)
        edge = side - 0.018
        profile = [
            (side * flare, 0),
            (side, high),
            (edge, high),
            (edge, high * 0.86),
            (0.003, high * 0.86),
        ]
        bodies = [lathe(profile, segments=4).rotated("z", 45)]
    else:
        bulge = [r * (0.8 + 0.25 * np.sin(np.pi * s)) for s in np.linspace(0, 1, 6)]
        wall = [(b, high * i / 5) for i, b in enumerate(bulge)]
        inside = [(r * 0.74, high), (r * 0.74, high * 0.86), (0.003, high * 0.86)]
        bodies = [lathe([*wall, *inside], segments=16)]
        bodies += [
            torus(b * 1.0, 0.007, (0, 0, high * i / 5), 16) for i, b in enumerate(bulge[1:], 1)
        ]
    groups: Groups = []
    if sampler.chance(0.25):
        lift, stand = _stand(sampler, r * 1.05, high)
        groups.append((sampler.wood() if sampler.chance(0.6) else sampler.metal(), stand))
        bodies = [mesh.translated(0, 0, lift) for mesh in bodies]
    elif sampler.chance(0.3):
        groups.append((sampler.ceramic(), [cylinder(r * 1.15, 0.012, (0, 0, -0.01), 18)]))
    glaze = sampler.ceramic() if sampler.chance(0.5) else sampler.plastic()
    soil_z = lift + high * 0.88
    soil = cylinder(r * 0.72, high * 0.03, (0, 0, soil_z - high * 0.01), 12)
    earth = sampler.material("noise", 0.2, (0.25, 0.17, 0.11))
    groups += [(sampler.fabric() if kind == 5 else glaze, bodies), (earth, [soil])]
    return Pot(groups, soil_z, r * 0.7)


def _stand(sampler: Sampler, radius: float, high: float) -> tuple[float, list[Mesh]]:
    """Three or four legs around the pot that carry it on a cross or ring."""
    lift = high * sampler.uniform(0.4, 1.6)
    count = sampler.choice((3, 4))
    up, thin = lift + high * sampler.uniform(0.1, 0.7), sampler.uniform(0.008, 0.014)
    meshes: list[Mesh] = []
    r, splay = radius + thin, sampler.choice((1.0, 1.2))
    for angle in np.linspace(0, 2 * np.pi, count, endpoint=False) + 0.5:
        x, y = r * float(np.cos(angle)), r * float(np.sin(angle))
        meshes.append(rod((x * splay, y * splay, 0.0), (x, y, up), thin, 6))
        meshes.append(rod((0, 0, lift - thin), (x, y, lift - thin), thin * 0.8, 6))
    meshes.append(box((radius * 0.5, radius * 0.5, 0.01), (0, 0, lift - 0.01)))
    return lift, meshes


def leaf(
    size: tuple[float, float],
    bend: tuple[float, float],
    shape: tuple[float, ...] = LANCE,
    fold: float = 0.25,
) -> Mesh:
    """A leaf (width, length) from the origin towards +x.

    ``bend``: its rise in degrees at the base, and how much it has drooped at the tip. It is
    folded along its midrib.
    """
    width, length = size
    rise = np.radians(bend[0] - bend[1] * np.linspace(0, 1, len(shape)))
    step = length / (len(shape) - 1)
    x = np.concatenate([[0.0], np.cumsum(np.cos(rise[:-1]) * step)])
    z = np.concatenate([[0.0], np.cumsum(np.sin(rise[:-1]) * step)])
    half = np.array(shape) * width / 2
    up = np.stack([-np.sin(rise), np.zeros_like(rise), np.cos(rise)], axis=1)
    middle = np.stack([x, np.zeros_like(x), z], axis=1)
    across = np.array([0.0, 1.0, 0.0])
    edges = [middle + side * half[:, None] * across + fold * half[:, None] * up for side in (-1, 1)]
    vertices = np.concatenate([edges[0], middle, edges[1]])
    count, faces = len(shape), []
    for index in range(count - 1):
        for row in (0, count):
            a, b = row + index, row + count + index
            faces += [(a, a + 1, b), (a + 1, b + 1, b)]
    return from_faces(vertices, faces)


def arch(start: ArrayLike, end: ArrayLike, lift: float, count: int = 6) -> list[list[float]]:
    """Points from start to end over a rise of ``lift`` beyond the straight line."""
    a, b = np.asarray(start, float), np.asarray(end, float)
    t = np.linspace(0, 1, count)[:, None]
    points = a * (1 - t) + b * t
    points[:, 2] += (4 * t * (1 - t))[:, 0] * lift
    result: list[list[float]] = points.tolist()
    return result


def potted(sampler: Sampler, base: Pot, leaves: list[Mesh], stems: list[Mesh]) -> Model:
    """A plant of leaves and stems in its pot."""
    groups: Groups = [*base.groups, (sampler.foliage(), leaves)]
    if stems:
        bark = sampler.foliage()
        if sampler.chance(0.5):
            bark = sampler.material("noise", 0.2, (0.35, 0.24, 0.15))
        groups.append((bark, stems))
    return settled("potted plant", *groups)
