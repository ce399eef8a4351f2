"""Suitcases upright: hard and soft trolley cases, vintage cases, wheeled duffels."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import (
    Mesh,
    box,
    cylinder,
    lathe,
    rod,
    rounded_box,
    tube,
)
from onemap_simulator.generation.model import Material, Model, assemble
from onemap_simulator.generation.sampler import Sampler


def any_skin(sampler: Sampler) -> Material:
    """Plastic, cloth, metal or leather."""
    return sampler.choice([sampler.plastic, sampler.fabric, sampler.metal, sampler.upholstery])()


def carrying_grip(width: float, z: float, y: float = 0.0, thick: float = 0.01) -> Mesh:
    """A carrying handle that bows up from a top at height z."""
    x = width / 2
    path = [(-x, y, z - 0.01), (-x * 0.8, y, z + 0.03), (x * 0.8, y, z + 0.03), (x, y, z - 0.01)]
    return tube(path, thick)


def trolley(y: float, z: float, pull: float, wide: float) -> tuple[list[Mesh], list[Mesh]]:
    """Telescopic bars that stand ``pull`` above z, and the crossbar a hand holds."""
    bars = [rod((s * wide, y, z - 0.03), (s * wide, y, z + pull), 0.009) for s in (-1, 1)]
    bar = rounded_box((2 * wide + 0.05, 0.035, 0.032), (0, y, z + pull - 0.012), 0.014)
    return bars, [bar, rounded_box((2 * wide + 0.06, 0.05, 0.014), (0, y, z - 0.006), 0.006)]


def _wheel(radius: float, width: float, x: float, y: float) -> Mesh:
    """A wheel on the floor whose axle runs along x."""
    wheel = cylinder(radius, width, segments=12).rotated("y", 90)
    return wheel.translated(x - width / 2, y, radius)


def hard_shell(sampler: Sampler) -> Model:
    """A hard trolley case: grooves upright, across or slanted, corner caps, four double wheels."""
    w, d, h = sampler.size(0.34, 0.52), sampler.size(0.2, 0.31), sampler.size(0.48, 0.74)
    base, half = 0.055, d / 2 - 0.004
    shell = [rounded_box((w, half, h), (0, s * (half / 2 + 0.004), base), d * 0.2) for s in (-1, 1)]
    pattern, count = sampler.integer(0, 2), sampler.integer(4, 9)
    for k in np.linspace(-0.36, 0.36, count):
        for s in (-1, 1):
            if pattern == 0:
                rib = rounded_box((w * 0.04, 0.02, h * 0.86), (k * w, 0, base + h * 0.07), 0.008)
            elif pattern == 1:
                rib = rounded_box((w * 0.84, 0.02, h * 0.03), (0, 0, base + h * (0.5 + k)), 0.008)
            else:
                slant = rounded_box((w * 0.035, 0.02, h * 0.5), (0, 0, -h * 0.25), 0.008)
                rib = slant.rotated("y", 20).translated(k * w * 0.75, 0, base + h / 2)
            shell.append(rib.translated(0, s * (d / 2), 0))
    zip_band = [rounded_box((w - 0.012, 0.03, h - 0.012), (0, 0, base + 0.006), 0.012)]
    dark = [
        _wheel(0.026, 0.016, x * w * 0.38 + o, y * d * 0.3)
        for x in (-1, 1)
        for y in (-1, 1)
        for o in (-0.012, 0.012)
    ]
    dark += [
        box((0.05, 0.05, 0.03), (x * w * 0.38, y * d * 0.3, 0.04)) for x in (-1, 1) for y in (-1, 1)
    ]
    bars, grip = trolley(
        d * 0.3, base + h, sampler.choice([0.02, sampler.uniform(0.2, 0.45)]), w * 0.2
    )
    dark += [*grip, carrying_grip(0.16, base + h, -d * 0.1)]
    if sampler.chance(0.5):
        dark.append(carrying_grip(0.16, 0, 0).rotated("y", 90).translated(w / 2, 0, base + h * 0.5))
    trim = [
        rounded_box((w * 0.1, d + 0.012, w * 0.1), (x * w * 0.46, 0, base + z), 0.02)
        for x in (-1, 1)
        for z in (-0.004, h - w * 0.1 + 0.004)
    ]
    groups = [
        (any_skin(sampler), shell),
        (sampler.dark(), [*zip_band, *dark]),
        (sampler.metal(), bars),
    ]
    if sampler.chance(0.4):
        groups.append((sampler.plastic(), trim))
    return assemble("suitcase", *groups)


def soft_case(sampler: Sampler) -> Model:
    """A soft trolley case: bulging cloth, two front pockets with zips and pulls, two wheels."""
    w, d, h = sampler.size(0.36, 0.48), sampler.size(0.2, 0.27), sampler.size(0.5, 0.7)
    base = 0.03
    body = [rounded_box((w, d, h), (0, 0, base), 0.05)]
    split = sampler.uniform(0.45, 0.65)
    deep = sampler.uniform(0.03, 0.06)
    pockets = [
        rounded_box((w * 0.84, deep * 2, h * split - 0.03), (0, -d / 2, base + 0.03), deep * 0.6)
    ]
    top = h * (1 - split) - 0.05
    pockets.append(
        rounded_box((w * 0.78, deep * 1.4, top), (0, -d / 2, base + h * split + 0.02), deep * 0.4)
    )
    y = -d / 2 - deep
    zips = [
        box((w * 0.74, 0.008, 0.012), (0, y - 0.002, base + h * split - 0.07)),
        box((0.012, 0.01, 0.05), (w * 0.3, y - 0.004, base + h * split - 0.11)),
        box((w * 0.66, 0.008, 0.01), (0, -d / 2 - deep * 0.7 - 0.002, base + h - 0.075)),
    ]
    piping = [box((w + 0.008, 0.012, h - 0.07), (0, s * d * 0.3, base + 0.035)) for s in (-1, 1)]
    dark = [_wheel(0.036, 0.03, x * w * 0.38, d * 0.36) for x in (-1, 1)]
    dark += [box((0.05, 0.03, 0.04), (x * w * 0.36, -d * 0.38, 0)) for x in (-1, 1)]
    bars, grip = trolley(
        d * 0.42, base + h, sampler.choice([0.015, sampler.uniform(0.2, 0.42)]), w * 0.22
    )
    dark += [*grip, carrying_grip(0.17, base + h, 0, 0.012), *piping]
    cloth = sampler.fabric()
    return assemble(
        "suitcase",
        (cloth, body),
        (cloth if sampler.chance(0.6) else sampler.fabric(), pockets),
        (sampler.metal(), [*zips, *bars]),
        (sampler.dark(), dark),
    )


def vintage_case(sampler: Sampler) -> Model:
    """An old leather or fibre suitcase that stands upright: corners, two straps, locks, a grip."""
    w, h, d = sampler.size(0.45, 0.68), sampler.size(0.3, 0.45), sampler.size(0.14, 0.2)
    skin = (
        sampler.material("leather", 0.3, sampler.colour())
        if sampler.chance(0.6)
        else sampler.fabric()
    )
    groups: list[tuple[Material, list[Mesh]]] = [(skin, [rounded_box((w, d, h), radius=0.018)])]
    leather = [box((0.045, d + 0.016, h + 0.012), (x * w * 0.3, 0, -0.0)) for x in (-1, 1)]
    c = h * 0.16
    corners = [
        rounded_box((c, d + 0.01, c), (x * (w / 2 - c / 2 + 0.004), 0, z), 0.012)
        for x in (-1, 1)
        for z in (0.0, h - c + 0.004)
    ]
    metal = [box((0.05, 0.03, 0.05), (x * w * 0.17, -d * 0.05, h - 0.03)) for x in (-1, 1)]
    metal += [
        rod((x, -d / 2 - 0.014, h * 0.6), (x, -d / 2 - 0.014, h * 0.72), 0.01, 6)
        for x in (-w * 0.3, w * 0.3)
    ]
    seam = [box((w + 0.004, 0.01, h + 0.003), (0, d * 0.05, 0.0))]
    grip = [carrying_grip(0.15, h + 0.004, 0, 0.013)]
    strap = sampler.material("leather", 0.3, sampler.colour())
    groups += [
        (strap, [*grip, *(leather if sampler.chance(0.7) else [])]),
        (sampler.metal(), metal),
    ]
    groups.append((strap if sampler.chance(0.5) else sampler.metal(), corners))
    groups.append((sampler.dark(), seam))
    if sampler.chance(0.4):
        stickers = [
            box((w * 0.16, 0.004, h * 0.2), (x * w, -d / 2, z * h))
            for x, z in ((-0.08, 0.3), (0.12, 0.55), (0.06, 0.08))
        ]
        groups.append((sampler.fabric(), stickers))
    return assemble("suitcase", *groups)


def wheeled_duffel(sampler: Sampler) -> Model:
    """A duffel on wheels, lying: a barrel of cloth, end caps, two loops on top, a trolley grip."""
    w, r = sampler.size(0.55, 0.75), sampler.size(0.14, 0.19)
    tall = sampler.uniform(0.85, 1.1)
    turn = np.radians(np.linspace(0, 360, 17)[:-1])
    x = np.array([-0.5, -0.47, -0.4, 0.4, 0.47, 0.5]) * w
    swell = np.array([0.8, 0.94, 1.0, 1.0, 0.94, 0.8]) * r
    profile = list(zip(swell.tolist(), (x + w / 2).tolist(), strict=True))
    lift = 0.035
    body = _barrel(profile, w, tall, r, lift)
    ring = np.stack([0 * turn, r * 1.01 * np.cos(turn), r * 1.01 * tall * np.sin(turn)], axis=1)
    straps = [
        tube(ring + (s * w * 0.2, 0, lift + r * tall), 0.013, 4, closed=True) for s in (-1, 1)
    ]
    top = lift + 2 * r * tall
    for side in (-1, 1):
        y = side * r * 0.35
        straps.append(
            tube(
                [
                    (-w * 0.2, y, top - 0.03),
                    (-w * 0.13, y * 0.6, top + 0.07),
                    (w * 0.13, y * 0.6, top + 0.07),
                    (w * 0.2, y, top - 0.03),
                ],
                0.011,
            )
        )
    zips = [box((w * 0.72, 0.02, 0.012), (0, 0, top - 0.006))]
    pocket = rounded_box((w * 0.34, 0.06, r * 1.0), (0, -r * 0.97, lift + r * tall * 0.6), 0.02)
    dark = [_wheel(0.045, 0.035, w * 0.44 - 0.03, s * r * 0.7) for s in (-1, 1)]
    dark += [
        box((0.05, r * 0.9, lift + 0.03), (-w * 0.36, 0, 0)),
        box((w * 0.7, r * 0.9, 0.03), (0, 0, lift - 0.012)),
    ]
    cloth = sampler.fabric()
    groups = [
        (cloth, body),
        (sampler.fabric(), straps),
        (sampler.metal(), zips),
        (sampler.dark(), dark),
        (cloth if sampler.chance(0.5) else sampler.fabric(), [pocket]),
    ]
    return assemble("suitcase", *groups)


def _barrel(
    profile: list[tuple[float, float]], w: float, tall: float, r: float, z: float
) -> list[Mesh]:
    barrel = lathe(profile, segments=16).rotated("y", 90).translated(-w / 2, 0, 0)
    return [barrel.scaled(1.0, 1.0, tall).translated(0, 0, z + r * tall)]
