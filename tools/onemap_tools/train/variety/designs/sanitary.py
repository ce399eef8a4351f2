"""Shared by the designs of the bathroom: skins over rings, taps, showers; no designs."""

from __future__ import annotations

import numpy as np

from onemap_shared.geometry import F64
from onemap_simulator.generation.furniture.kitchen import tap
from onemap_simulator.generation.mesh import Mesh, Vec, box, cylinder, from_faces, lathe, rod, tube
from onemap_simulator.generation.model import Material, Model, assemble
from onemap_simulator.generation.sampler import Sampler

SQUARE = 60.0  # a power at which a superellipse is a rectangle
Group = tuple[Material, list[Mesh]]


def stand(category: str, *groups: Group) -> Model:
    """The groups assembled, moved so that they stand centred on the floor."""
    used = [group for group in groups if group[1]]
    points = np.concatenate([mesh.vertices for _, meshes in used for mesh in meshes])
    lower, upper = points.min(axis=0), points.max(axis=0)
    x, y = (-(lower + upper) / 2)[:2].tolist()
    z = -float(lower[2])
    return assemble(category, *[(mat, [m.translated(x, y, z) for m in ms]) for mat, ms in used])


def ring(size: tuple[float, float], z: float, power: float = 2.0, back: float = 0.0) -> F64:
    """A superellipse (24, 3) of width and depth at height z; ``back``: power of the +y half."""
    angle = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    c, s = np.cos(angle), np.sin(angle)
    powers = np.where(s > 1e-9, back or power, power)
    r = (np.abs(c) ** powers + np.abs(s) ** powers) ** (-1 / powers)
    return np.stack([r * c * size[0] / 2, r * s * size[1] / 2, np.full(24, z)], axis=1)


def skin(rings: list[F64], capped: bool = True) -> Mesh:
    """A surface over rings of equal length, from the bottom of the outside."""
    count = len(rings[0])
    stack = lathe([(1.0, float(i)) for i in range(len(rings))], segments=count, capped=capped)
    vertices = np.concatenate(rings)
    if capped:
        vertices = np.concatenate([vertices, [rings[0].mean(axis=0), rings[-1].mean(axis=0)]])
    return from_faces(vertices, stack.faces)


def shell(
    profile: list[tuple[float, float]],
    size: tuple[float, float],
    power: float = 2.0,
    back: float = 0.0,
    capped: bool = True,
) -> Mesh:
    """A skin over one superellipse at (share, height) pairs, from the bottom of the outside."""
    rings = [ring((size[0] * share, size[1] * share), z, power, back) for share, z in profile]
    return skin(rings, capped)


def rim(size: tuple[float, float], z: float, thick: float, power: float = 2.0) -> Mesh:
    """A round roll along a superellipse."""
    return tube(ring(size, z, power), thick, 6, closed=True)


def faucet(sampler: Sampler, at: Vec) -> list[Mesh]:
    """A tap of any make on a basin or counter; it reaches towards -y."""
    kind = sampler.integer(0, 3)
    if kind == 0:
        return tap(sampler, at)
    reach, rise = sampler.size(0.11, 0.17), sampler.size(0.09, 0.24)
    if kind == 1:
        meshes = [
            cylinder(0.024, rise, segments=12),
            rod((0, 0, rise * 0.75), (0, -reach, rise * 0.85), 0.014),
            rod((0, 0.0, rise), (0, -0.09, rise + 0.035), 0.009),
        ]
    elif kind == 2:
        meshes = [
            box((0.045, 0.045, rise)),
            box((0.045, reach, 0.018), (0, -reach / 2, rise * 0.85)),
            box((0.03, 0.08, 0.012), (0, -0.02, rise + 0.006)),
        ]
    else:
        neck = [(0.0, -reach * 0.5 * (1 - np.cos(a)), rise + 0.07 * np.sin(a)) for a in _ARCH]
        meshes = [tube([(0, 0, 0), *neck], 0.012)]
        for x in (-0.1, 0.1):
            meshes += [cylinder(0.016, 0.05, (x, 0, 0), 8)]
            meshes += [rod((x - 0.03, 0, 0.055), (x + 0.03, 0, 0.055), 0.008, 6)]
            meshes += [rod((x, -0.03, 0.055), (x, 0.03, 0.055), 0.008, 6)]
    return [mesh.translated(*at) for mesh in meshes]


def shower_set(sampler: Sampler, at: Vec, top: float) -> list[Mesh]:
    """A mixer with riser, overhead rose and hand shower on a wall at +y, from ``at`` upwards."""
    reach, rose = sampler.size(0.28, 0.4), sampler.size(0.08, 0.15)
    rise = top - at[2]
    meshes = [
        tube([(0, -0.04, 0), (0, -0.04, rise), (0, -reach, rise)], 0.012),
        box((0.26, 0.05, 0.05), (0, -0.04, 0.0)),
    ]
    if sampler.chance(0.5):
        meshes.append(cylinder(rose, 0.015, (0, -reach, rise - 0.03), 16))
    else:
        meshes.append(box((rose * 2, rose * 2, 0.015), (0, -reach, rise - 0.025)))
    if sampler.chance(0.7):
        hand = [(0, -0.06, 0.55), (0.02, -0.16, 0.68)]
        meshes.append(rod(hand[0], hand[1], 0.014))
        head = cylinder(0.05, 0.025, segments=12).rotated("x", 60)
        meshes.append(head.translated(0.02, -0.17, 0.66))
        meshes.append(
            tube([(0.08, -0.06, 0.0), (0.18, -0.1, -0.3), (0.1, -0.1, 0.1), hand[0]], 0.008)
        )
    return [mesh.translated(*at) for mesh in meshes]


_ARCH = np.linspace(0, np.pi, 8).tolist()
