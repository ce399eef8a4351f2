"""Leafy potted plants: large leaves, palms, ferns, grasses, rubber plants, trees."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import Mesh, Vec, cylinder, ellipsoid, tube
from onemap_simulator.generation.model import Model
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.plant_parts import (
    FERN,
    HEART,
    LANCE,
    OVAL,
    SPLIT,
    STRAP,
    arch,
    leaf,
    pot,
    potted,
)


def _around(sampler: Sampler, count: int) -> list[float]:
    """Directions in degrees, spread evenly with some disorder."""
    spread = 137.5 if sampler.chance(0.6) else 360 / count
    return [index * spread + sampler.uniform(-20, 20) for index in range(count)]


def _polar(radius: float, degrees: float, z: float) -> tuple[float, float, float]:
    angle = np.radians(degrees)
    return float(radius * np.cos(angle)), float(radius * np.sin(angle)), z


def broad_leaves(sampler: Sampler) -> Model:
    """Large split or heart-shaped leaves on long arching stalks, like a monstera."""
    base = pot(sampler, sampler.size(0.1, 0.2))
    tall = sampler.size(0.35, 1.0)
    shape = SPLIT if sampler.chance(0.55) else HEART
    leaves: list[Mesh] = []
    stems: list[Mesh] = []
    count = sampler.integer(6, 14)
    for index, turn in enumerate(_around(sampler, count)):
        high = tall * (0.35 + 0.65 * (index + 1) / count)
        out = base.radius * sampler.uniform(0.8, 2.2)
        tip = _polar(out, turn, base.soil_z + high)
        start = _polar(base.radius * 0.2, turn, base.soil_z - 0.01)
        stems.append(tube(arch(start, tip, high * 0.15), 0.006, 5))
        wide = tall * sampler.uniform(0.25, 0.4)
        blade = leaf(
            (wide, wide * 1.25), (sampler.uniform(-20, 25), sampler.uniform(30, 80)), shape
        )
        leaves.append(blade.rotated("z", turn).translated(*tip))
    return potted(sampler, base, leaves, stems)


def palm(sampler: Sampler) -> Model:
    """A palm: arching fronds with narrow leaflets, or fans, from the soil or on a trunk."""
    base = pot(sampler, sampler.size(0.12, 0.2))
    long = sampler.size(0.4, 0.75)
    trunk = sampler.choice((0.0, 0.0, 0.3, 0.6)) * long
    top = base.soil_z + trunk
    fans = sampler.chance(0.3)
    stems: list[Mesh] = []
    leaves: list[Mesh] = []
    if trunk:
        rings = [
            (0.02 + 0.012 * (i % 2), base.soil_z - 0.01 + (trunk + 0.02) * i / 9) for i in range(10)
        ]
        stems += [cylinder(r, trunk / 9 + 0.004, (0, 0, z), 8) for r, z in rings[:-1]]
    for turn in _around(sampler, sampler.integer(6, 9)):
        rise = sampler.uniform(0.25, 1.0) * long
        tip = _polar(long * sampler.uniform(0.45, 0.75), turn, top + rise)
        path = arch((0, 0, top - 0.01), tip, long * sampler.uniform(0.15, 0.3), 9)
        stems.append(tube(path, 0.005, 4))
        if fans:
            for spread in range(-75, 76, 25):
                ray = leaf((0.045, long * 0.4), (sampler.uniform(0, 15), 50), LANCE)
                leaves.append(ray.rotated("z", turn + spread).translated(*path[-1]))
            continue
        for place, point in enumerate(path[2:], 2):
            share = (1.15 - abs(place - 5) / 5) * long * 0.38
            for side in (-1, 1):
                leaflet = leaf((0.042, share), (sampler.uniform(-5, 20), 45), LANCE[::2] + (0.02,))
                leaves.append(leaflet.rotated("z", turn + side * 55).translated(*point))
    return potted(sampler, base, leaves, stems)


def fern(sampler: Sampler) -> Model:
    """A fern: a dense tuft of toothed fronds that arch out and down over the pot."""
    base = pot(sampler, sampler.size(0.08, 0.16))
    long = sampler.size(0.25, 0.55)
    leaves = []
    for turn in _around(sampler, sampler.integer(18, 34)):
        bend = (sampler.uniform(40, 85), sampler.uniform(70, 140))
        frond = leaf(
            (long * sampler.uniform(0.2, 0.3), long * sampler.uniform(0.7, 1.1)), bend, FERN, 0.1
        )
        at = _polar(base.radius * 0.3, turn, base.soil_z)
        leaves.append(frond.rotated("z", turn).translated(*at))
    return potted(sampler, base, leaves, [])


def grass(sampler: Sampler) -> Model:
    """Long narrow arching blades: a spider plant, dracaena heads on canes, or grass."""
    base = pot(sampler, sampler.size(0.08, 0.17))
    long = sampler.size(0.25, 0.6)
    stems: list[Mesh] = []
    leaves: list[Mesh] = []
    heads = [(0.0, 0.0, base.soil_z)]
    if sampler.chance(0.5):
        heads = []
        for turn in _around(sampler, sampler.integer(1, 4)):
            top = _polar(base.radius * 0.5, turn, base.soil_z + long * sampler.uniform(0.5, 2.0))
            foot = _polar(base.radius * 0.3, turn, base.soil_z - 0.01)
            stems.append(tube([foot, top], sampler.uniform(0.01, 0.02), 7))
            heads.append(top)
    each = sampler.integer(12, 22) if len(heads) < 3 else 12
    for head in heads:
        for turn in _around(sampler, each):
            bend = (sampler.uniform(35, 88), sampler.uniform(40, 150))
            size = (sampler.uniform(0.015, 0.035), long * sampler.uniform(0.7, 1.1))
            leaves.append(leaf(size, bend, STRAP).rotated("z", turn).translated(*head))
    return potted(sampler, base, leaves, stems)


def rubber_plant(sampler: Sampler) -> Model:
    """Upright stems with oval leaves one above the other, like a rubber plant or fig."""
    base = pot(sampler, sampler.size(0.1, 0.19))
    tall = sampler.size(0.4, 1.05)
    leaves: list[Mesh] = []
    stems: list[Mesh] = []
    shape = sampler.choice((OVAL, HEART, OVAL[::-1][1:] + (0.02,)))
    long = tall * sampler.uniform(0.18, 0.3) + 0.06
    bare = sampler.choice((0.1, 0.1, 0.5))
    for turn in _around(sampler, sampler.integer(1, 3)):
        foot = _polar(base.radius * 0.3, turn, base.soil_z - 0.01)
        top = _polar(
            base.radius * sampler.uniform(0.3, 0.8),
            turn,
            base.soil_z + tall * sampler.uniform(0.7, 1),
        )
        stems.append(tube([foot, top], 0.01, 6))
        count = sampler.integer(9, 16)
        for index in range(count):
            share = bare + (1 - bare) * index / (count - 1)
            at = np.array(foot) * (1 - share) + np.array(top) * share
            bend = (sampler.uniform(10, 40) + 45 * (share > 0.95), sampler.uniform(20, 70))
            blade = leaf((long * sampler.uniform(0.4, 0.6), long), bend, shape)
            leaves.append(blade.rotated("z", index * 137.5).translated(*at.tolist()))
    return potted(sampler, base, leaves, stems)


def _clump(sampler: Sampler, centre: Vec, radii: Vec, count: int) -> list[Mesh]:
    """A solid cushion of foliage with single leaves that stick out of it."""
    solid = np.array(radii) * 0.86
    x, y, z = solid.tolist()
    leaves = [ellipsoid((x, y, z), centre, 10)]
    for _ in range(count):
        direction = sampler.rng.normal(size=3)
        direction /= np.linalg.norm(direction)
        spot = (np.array(centre) + direction * solid * 0.95).tolist()
        small = leaf(
            (max(radii) * 0.22, max(radii) * 0.36),
            (sampler.uniform(-30, 80), 30),
            OVAL[::2] + (0.02,),
        )
        turn = float(np.degrees(np.arctan2(direction[1], direction[0])))
        leaves.append(small.rotated("z", turn + sampler.uniform(-50, 50)).translated(*spot))
    return leaves


def crowned_tree(sampler: Sampler) -> Model:
    """A small tree: clipped ball or cone on a stem, loose crown, or a bonsai with cushions."""
    bonsai = sampler.chance(0.35)
    base = pot(sampler, sampler.size(0.1, 0.19), low=bonsai)
    tall = sampler.size(0.2, 0.4) if bonsai else sampler.size(0.5, 1.2)
    top = base.soil_z + tall
    leaves: list[Mesh] = []
    stems: list[Mesh] = []
    clumps: list[tuple[Vec, Vec]] = []
    if bonsai:
        path = [(0.0, 0.0, base.soil_z - 0.01)]
        path += [
            _polar(tall * 0.2, 180 * i + 20, base.soil_z + tall * 0.28 * (i + 1)) for i in range(3)
        ]
        stems.append(tube(path, 0.018, 7))
        for index, point in enumerate(path[1:]):
            r = tall * (0.34 - 0.05 * index)
            clumps.append((point, (r, r, r * 0.4)))
    else:
        r = tall * sampler.uniform(0.22, 0.34)
        kind = sampler.integer(0, 2)
        stems.append(tube([(0, 0, base.soil_z - 0.01), (0.01, 0, top - r)], 0.014, 7))
        if kind == 0:
            clumps.append(((0, 0, top - r), (r, r, r)))
            if sampler.chance(0.4):
                clumps.append(((0, 0, top - 2.6 * r), (r * 0.8, r * 0.8, r * 0.7)))
        elif kind == 1:
            clumps += [
                ((0, 0, top - r * (0.5 + i)), (r * (0.5 + 0.3 * i),) * 2 + (r * 0.8,))
                for i in range(3)
            ]
        else:
            for turn in _around(sampler, 5):
                at = _polar(r * 0.9, turn, top - r * sampler.uniform(0.2, 1.4))
                stems.append(tube([(0, 0, top - 1.9 * r), at], 0.006, 5))
                clumps.append((at, (r * 0.6, r * 0.6, r * 0.5)))
    each = 110 // len(clumps)
    for centre, radii in clumps:
        leaves += _clump(sampler, centre, radii, each)
    return potted(sampler, base, leaves, stems)


DESIGNS: dict[str, tuple[ModelFactory, ...]] = {
    "potted plant": (broad_leaves, palm, fern, grass, rubber_plant, crowned_tree)
}
