"""Parts of bathtubs: hollow tubs, taps, water and racks; x is the length."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import Mesh, box, cylinder, from_faces, rod, tube
from onemap_simulator.generation.sampler import Sampler
from onemap_tools.train.variety.designs.sanitary import Group, faucet, shell

Size = tuple[float, float]


def bath_size(sampler: Sampler) -> tuple[float, float, float]:
    """Length, width and height."""
    return sampler.size(1.4, 1.8), sampler.size(0.66, 0.85), sampler.size(0.48, 0.64)


def raised_ends(meshes: list[Mesh], length: float, lift: float, both: bool) -> list[Mesh]:
    """The meshes with their upper part pulled up towards one end or both (a slipper bath)."""
    result = []
    for mesh in meshes:
        v = mesh.vertices.copy()
        share = v[:, 0] / (length / 2)
        share = np.abs(share) if both else np.maximum(share, 0)
        v[:, 2] *= 1 + lift * share**2
        result.append(from_faces(v, mesh.faces))
    return result


def oval_tub(size: Size, height: float, power: float, foot: float, low: float) -> Mesh:
    """A hollow oval from ``low`` to ``height``, its base a share of its rim."""
    h = height - low
    outside = [
        (foot * 0.9, 0.0),
        (foot, 0.08),
        ((foot + 1) / 2 + 0.03, 0.5),
        (0.98, 0.93),
        (1.0, 1.0),
    ]
    inside = [(0.94, 1.0), ((foot + 1) / 2 - 0.06, 0.5), (foot * 0.85, 0.18), (0.0, 0.14)]
    return shell([(s, low + z * h) for s, z in [*outside, *inside]], size, power)


def floor_tap(sampler: Sampler, at: tuple[float, float], top: float) -> list[Mesh]:
    """A mixer on one or two pipes from the floor, its spout towards -y."""
    x, y = at
    arch = [
        (x, y - 0.09 * (1 - np.cos(a)), top + 0.09 * np.sin(a)) for a in np.linspace(0, np.pi, 7)
    ]
    if sampler.chance(0.5):
        pipes = [cylinder(0.045, 0.012, (x, y, 0), 12), rod((x, y, 0), (x, y, top), 0.016)]
        pipes.append(rod((x, y, top * 0.9), (x + 0.08, y, top * 0.92), 0.01))
    else:
        pipes = [rod((x + s, y, 0), (x + s, y, top - 0.02), 0.012) for s in (-0.09, 0.09)]
        pipes += [rod((x - 0.1, y, top - 0.02), (x + 0.1, y, top - 0.02), 0.018)]
        pipes += [rod((x + s, y, top - 0.03), (x + s, y, top + 0.05), 0.022) for s in (-0.09, 0.09)]
    return [*pipes, tube([*arch, (x, y - 0.18, top - 0.03)], 0.013)]


def tap_on_rim(sampler: Sampler, x: float, z: float) -> list[Mesh]:
    """A tap at the end -x of a bath, its spout towards +x."""
    return [m.rotated("z", 90).translated(x, 0, z) for m in faucet(sampler, (0, 0, 0))]


def bath_extras(sampler: Sampler, size: Size, height: float) -> list[Group]:
    """Perhaps water, perhaps a rack across the rim."""
    groups: list[Group] = []
    if sampler.chance(0.35):
        water = shell([(0.7, height * 0.7), (0.7, height * 0.7 + 0.01)], size, 2.4)
        groups.append((sampler.material("noise", 0.5, (0.6, 0.8, 0.88)), [water]))
    if sampler.chance(0.3):
        x = sampler.uniform(-0.15, 0.15) * size[0]
        slats = [
            box((0.035, size[1] * 1.02, 0.018), (x + i * 0.05, 0, height + 0.012)) for i in range(4)
        ]
        groups.append((sampler.wood(), slats))
    return groups
