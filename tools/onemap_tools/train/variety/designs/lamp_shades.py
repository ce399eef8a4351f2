"""Lamp shades and bulbs."""

from __future__ import annotations

import numpy as np

from onemap_shared.geometry import F64
from onemap_simulator.generation.mesh import Mesh, Vec, ellipsoid, lathe
from onemap_simulator.generation.sampler import Sampler


def shell(profile: list[tuple[float, float]], at: Vec = (0, 0, 0), wall: float = 0.006) -> Mesh:
    """A thin open surface of revolution: the profile outside and back inside."""
    inner = [(max(r - wall, 0.002), z) for r, z in reversed(profile)]
    return lathe([*profile, *inner, profile[0]], at, 20, capped=False)


def shade_of(sampler: Sampler, radius: float, z: float) -> Mesh:
    """A cloth shade above ``z``: drum, cone, coolie, bell, tapered square or pleats."""
    kind, high = sampler.integer(0, 5), radius * sampler.uniform(0.8, 1.5)
    upper = radius * sampler.uniform(0.55, 0.8)
    if kind == 0:
        return shell([(radius, 0), (radius, high)], (0, 0, z))
    if kind == 1:
        return shell([(radius, 0), (upper, high)], (0, 0, z))
    if kind == 2:
        return shell([(radius, 0), (radius * 0.28, high * 0.8)], (0, 0, z))
    if kind == 3:
        bell = [(radius, 0), (radius * 0.78, high * 0.3), (upper * 0.85, high * 0.7)]
        return shell([*bell, (upper * 0.75, high)], (0, 0, z))
    if kind == 4:
        wide = radius * 1.2
        flare = [(wide, 0.0), (upper * 1.2, high), (upper * 1.2 - 0.008, high), (wide - 0.008, 0)]
        square = lathe([*flare, (wide, 0.0)], segments=4, capped=False)
        return square.rotated("z", 45).translated(0, 0, z)
    return pleated((radius, upper), high, z)


def pleated(radii: tuple[float, float], height: float, z: float) -> Mesh:
    """A shade in folds, wider below."""
    mesh = lathe([(radii[0], 0), (radii[1], height)], segments=48, capped=False)
    angle = np.arctan2(mesh.vertices[:, 1], mesh.vertices[:, 0])
    fold: F64 = 1 + 0.05 * np.cos(angle * 24)
    folded = mesh.vertices * np.stack([fold, fold, np.ones_like(fold)], axis=1)
    return Mesh(folded + (0, 0, z), mesh.faces, mesh.uv)


def bulb(at: Vec, radius: float = 0.035) -> Mesh:
    """A bulb around ``at``."""
    return ellipsoid((radius, radius, radius * 1.3), at, 10)
