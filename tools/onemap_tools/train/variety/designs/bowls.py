"""Bowls: footed, salad, flared, wire, mixing and many-sided ones."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import (
    ORIGIN,
    Mesh,
    cylinder,
    ellipsoid,
    lathe,
    rod,
    torus,
    tube,
)
from onemap_simulator.generation.model import Material, Model, assemble
from onemap_simulator.generation.sampler import Sampler

Profile = list[tuple[float, float]]


def _fruit(sampler: Sampler, reach: float, z: float) -> list[tuple[Material, list[Mesh]]]:
    """Apples, oranges, eggs or pears heaped about height z."""
    long = sampler.uniform(0.9, 1.3)
    groups: list[tuple[Material, list[Mesh]]] = [(sampler.plastic(), []), (sampler.plastic(), [])]
    for index in range(sampler.integer(4, 7)):
        r = sampler.uniform(0.03, 0.04)
        angle, out = index * 1.2, reach * 0.5 * (index < 5)
        at = (out * float(np.cos(angle)), out * float(np.sin(angle)), z + 0.02 * (index >= 5))
        groups[index % 2][1].append(ellipsoid((r, r * long, r), at, 8))
    return groups


def _glaze(sampler: Sampler) -> Material:
    return sampler.choice([sampler.ceramic, sampler.plastic, sampler.fabric, sampler.metal])()


def _curved(low: float, radius: float, height: float, power: float) -> Profile:
    """An outside that opens from the foot to the rim; power below 1 is full, above 1 flared."""
    share = np.linspace(0, 1, 6)
    r = low + (radius - low) * share**power
    return list(zip(r.tolist(), (height * share).tolist(), strict=True))


def _open(outer: Profile, wall: float, floor: float, sides: int = 20) -> Mesh:
    inner = [(max(r - wall, 0.01), z) for r, z in reversed(outer) if z > floor]
    return lathe([*outer, *inner, (0.0, floor)], ORIGIN, sides)


def footed_bowl(sampler: Sampler) -> Model:
    """A rice or soup bowl on a tall foot ring, empty or full."""
    r, h = sampler.size(0.075, 0.12), sampler.size(0.07, 0.1)
    foot = r * sampler.uniform(0.4, 0.55)
    rise = h * sampler.uniform(0.12, 0.25)
    side = _curved(foot, r, h - rise, sampler.uniform(0.4, 0.7))
    outer = [(foot * 1.08, 0.0), *((x, z + rise) for x, z in side)]
    groups = [(_glaze(sampler), [_open(outer, 0.006, rise + 0.01)])]
    if sampler.chance(0.5):
        food = lathe([(r * 0.86, h * 0.8), (r * 0.5, h * 0.9), (0, h * 0.92)], segments=16)
        groups.append((sampler.material("noise", 0.1, sampler.colour()), [food]))
    if sampler.chance(0.35):
        sticks = [
            rod((-r * 1.2, y, h + 0.004), (r * 1.3, y - 0.01, h + 0.005), 0.004, 6)
            for y in (-r * 0.35, -r * 0.5)
        ]
        groups.append((sampler.wood(), sticks))
    return assemble("bowl", *groups)


def salad_bowl(sampler: Sampler) -> Model:
    """A wide thick wooden or glazed bowl, at times with two servers standing in it."""
    r, h = sampler.size(0.13, 0.19), sampler.size(0.08, 0.12)
    outer = _curved(r * 0.4, r, h, sampler.uniform(0.4, 0.6))
    body = [_open(outer, sampler.uniform(0.008, 0.018), 0.015)]
    groups = [(sampler.wood() if sampler.chance(0.5) else _glaze(sampler), body)]
    if sampler.chance(0.5):
        servers = []
        for side in (-1, 1):
            servers.append(rod((side * r * 0.2, 0, 0.03), (side * r * 1.1, 0.04, h * 1.6), 0.007))
            servers.append(ellipsoid((0.03, 0.02, 0.01), (side * r * 1.1, 0.04, h * 1.6), 8))
        groups.append((sampler.wood(), servers))
    if sampler.chance(0.5):
        leaves = [
            ellipsoid((r * 0.4, r * 0.25, 0.03), (0, 0, 0), 8)
            .rotated("z", k * 67)
            .translated(r * 0.38 * float(np.cos(k)), r * 0.38 * float(np.sin(k)), h * 0.75)
            for k in range(6)
        ]
        groups.append((sampler.foliage(), leaves))
    return assemble("bowl", *groups)


def flared_bowl(sampler: Sampler) -> Model:
    """A shallow fruit dish that flares to a wide rim, on a foot or a stem."""
    r, h = sampler.size(0.13, 0.19), sampler.size(0.05, 0.08)
    stem = sampler.uniform(0.03, 0.09) if sampler.chance(0.5) else 0.008
    side = [(x, z + stem) for x, z in _curved(0.03, r, h, sampler.uniform(0.9, 1.6))]
    base = [(r * 0.42, 0.0), (r * 0.42, 0.006), (0.022, 0.012 if stem > 0.02 else 0.007)]
    body = [_open([*base, *side], 0.005, stem + 0.006)]
    groups = [(_glaze(sampler), body)]
    if sampler.chance(0.7):
        groups += _fruit(sampler, r * 0.8, stem + h * 0.75)
    return assemble("bowl", *groups)


def wire_bowl(sampler: Sampler) -> Model:
    """A fruit bowl of bent wire: rings and ribs, with fruit in it."""
    r, h = sampler.size(0.13, 0.18), sampler.size(0.09, 0.13)
    side = _curved(r * 0.45, r, h - 0.004, sampler.uniform(0.5, 1.0))
    wire = [torus(x, 0.004, (0, 0, z + 0.004), 20) for x, z in (side[0], side[3], side[5])]
    count = sampler.integer(10, 18)
    for angle in np.linspace(0, 360, count, endpoint=False):
        path = [(x, 0.0, z + 0.004) for x, z in side]
        wire.append(tube(path, 0.003, 4).rotated("z", float(angle)))
    wire.append(cylinder(r * 0.45, 0.004, (0, 0, 0.002), 16))
    return assemble("bowl", (sampler.metal(), wire), *_fruit(sampler, r * 0.75, h * 0.6))


def mixing_bowl(sampler: Sampler) -> Model:
    """A deep mixing bowl with a rolled rim and a loop grip or a pouring lip; nested at times."""
    r, h = sampler.size(0.11, 0.15), sampler.size(0.11, 0.15)
    outer = _curved(r * 0.55, r, h, sampler.uniform(0.35, 0.6))
    skin = sampler.metal() if sampler.chance(0.5) else sampler.plastic()
    body = [_open(outer, 0.004, 0.008), torus(r, 0.005, (0, 0, h), 20)]
    if sampler.chance(0.5):
        angle = np.linspace(-np.pi / 2, np.pi / 2, 7)
        loop = np.stack([r + 0.03 * np.cos(angle), 0.035 * np.sin(angle), 0 * angle + h], axis=1)
        body.append(tube(loop, 0.005))
    groups = [(skin, body)]
    if sampler.chance(0.5):
        inner = _open([(x * 0.86, z) for x, z in outer], 0.004, 0.008).translated(0, 0, 0.05)
        groups.append((sampler.plastic(), [inner, torus(r * 0.86, 0.005, (0, 0, h + 0.05), 20)]))
    else:
        whisk = [rod((0, 0, 0.03), (-r * 1.1, 0.03, h * 1.7), 0.006)]
        groups.append((sampler.metal(), whisk))
    return assemble("bowl", *groups)


def square_bowl(sampler: Sampler) -> Model:
    """A bowl of four or six flat sides that open upwards."""
    r, h = sampler.size(0.12, 0.17), sampler.size(0.06, 0.1)
    sides = sampler.choice([4, 4, 6, 8])
    outer = [(r * sampler.uniform(0.5, 0.8), 0.0), (r, h)]
    body = _open(outer, 0.01, 0.012, sides).rotated("z", 180 / sides)
    groups = [(_glaze(sampler), [body])]
    if sampler.chance(0.6):
        groups += _fruit(sampler, r * 0.6, h * 0.7)
    return assemble("bowl", *groups)
