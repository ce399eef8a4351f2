"""Parts of washbasins: slabs with a basin, free bowls, siphons."""

from __future__ import annotations

from onemap_simulator.generation.mesh import Mesh, cylinder, rod, tube
from onemap_tools.train.variety.designs.sanitary import SQUARE, ring, shell, skin

Size = tuple[float, float]


def basin_slab(size: Size, hole: Size, z: Size, deep: float, power: float) -> Mesh:
    """A slab from z[0] to z[1] with a basin of depth ``deep`` in it, shifted to the front."""
    low, top = z
    shift = (0.0, -min(0.035, (size[1] - hole[1]) / 2 - 0.02), 0.0)
    rings = [ring(size, low, SQUARE), ring(size, top, SQUARE), ring(hole, top, power) + shift]
    for share, down in ((0.93, deep * 0.5), (0.75, deep * 0.95), (0.01, deep)):
        rings.append(ring((hole[0] * share, hole[1] * share), top - down, power) + shift)
    return skin(rings, capped=deep < top - low)


def free_bowl(size: Size, low: float, top: float, power: float, foot: float) -> Mesh:
    """A free bowl from ``low`` to ``top``: narrow at its foot, hollow."""
    h = top - low
    outside = [(foot, 0.0), ((1 + foot) / 2 + 0.06, 0.4), (1.0, 0.95), (1.0, 1.0), (0.9, 1.0)]
    inside = [((1 + foot) / 2 - 0.08, 0.5), (foot * 0.7, 0.22), (0.0, 0.18)]
    return shell([(s, low + z * h) for s, z in [*outside, *inside]], size, power)


def siphon(at: tuple[float, float], top: float, floor: bool, wall_y: float) -> list[Mesh]:
    """A bottle trap or a pipe from a basin to the floor, or to the wall."""
    x, y = at
    low = top - 0.2
    meshes = [rod((x, y, top), (x, y, low), 0.017), cylinder(0.034, 0.09, (x, y, low - 0.04), 10)]
    if floor:
        bend = [(x, y, low), (x, y + 0.1, low + 0.02), (x, y + 0.12, low - 0.06), (x, y + 0.12, 0)]
        return [*meshes, tube(bend, 0.016), cylinder(0.035, 0.012, (x, y + 0.12, 0), 12)]
    return [*meshes, rod((x, y, low + 0.03), (x, wall_y, low + 0.03), 0.016)]
