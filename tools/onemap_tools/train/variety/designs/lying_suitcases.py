"""Suitcases that lie: a closed one, and one open for packing."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import (
    Mesh,
    box,
    cylinder,
    rounded_box,
    torus,
)
from onemap_simulator.generation.model import Material, Model, assemble
from onemap_simulator.generation.sampler import Sampler
from onemap_tools.train.variety.designs.suitcases import any_skin, carrying_grip, trolley


def lying_case(sampler: Sampler) -> Model:
    """A closed suitcase flat on its back: ribs or straps on top, side grip, wheels at one end."""
    w, d, h = sampler.size(0.55, 0.75), sampler.size(0.38, 0.5), sampler.size(0.2, 0.3)
    half = h / 2 - 0.004
    shell = [rounded_box((w, d, half), (0, 0, z), 0.045) for z in (0.0, half + 0.008)]
    band = [rounded_box((w - 0.012, d - 0.012, 0.03), (0, 0, h / 2 - 0.015), 0.012)]
    ribs = []
    if sampler.chance(0.6):
        for y in np.linspace(-0.36, 0.36, sampler.integer(3, 8)):
            ribs.append(rounded_box((w * 0.85, d * 0.05, 0.02), (0, y * d, h - 0.01), 0.008))
    else:
        ribs += [box((0.05, d + 0.01, h + 0.008), (x * w * 0.25, 0, 0)) for x in (-1, 1)]
    grip = carrying_grip(0.17, 0, 0, 0.012).rotated("x", 90).translated(0, -d / 2, h / 2)
    dark = [grip, *band]
    for y in (-1, 1):
        for z in (0.22, 0.78):
            dark.append(
                cylinder(0.026, 0.03, segments=10)
                .rotated("x", 90)
                .translated(w / 2 + 0.018, y * d * 0.36 + 0.015, z * h)
            )
    bars, bar = trolley(0, 0, sampler.choice([0.02, sampler.uniform(0.05, 0.12)]), d * 0.2)
    turn = [
        m.rotated("z", 90).rotated("y", -90).translated(-w / 2, 0, h * 0.3) for m in (*bars, *bar)
    ]
    skin = any_skin(sampler)
    return assemble(
        "suitcase",
        (skin, shell),
        (skin if sampler.chance(0.5) else sampler.plastic(), ribs),
        (sampler.dark(), [*dark, *turn[2:]]),
        (sampler.metal(), turn[:2]),
    )


def open_case(sampler: Sampler) -> Model:
    """A suitcase opened for packing: a filled lower half, its lid up, piles of clothes."""
    w, d, h = sampler.size(0.5, 0.7), sampler.size(0.36, 0.46), sampler.size(0.1, 0.15)
    t = 0.012
    tray = [
        box((w, d, t)),
        *(box((w, t, h), (0, s * (d - t) / 2, 0)) for s in (-1, 1)),
        *(box((t, d, h), (s * (w - t) / 2, 0, 0)) for s in (-1, 1)),
    ]
    angle = sampler.uniform(80, 120)
    lid = [
        m.translated(0, -d / 2, 0).rotated("x", -angle).translated(0, d / 2, h + 0.004)
        for m in (box((w, d, t), (0, 0, h - t)), *(m for m in tray[1:]))
    ]
    shift = -(max(float(m.vertices[:, 1].max()) for m in lid) - d / 2) / 2
    piles: list[list[Mesh]] = [[], []]
    for k, (x, y) in enumerate(
        ((-0.3, -0.22), (0.02, -0.22), (0.32, -0.22), (-0.3, 0.24), (0.1, 0.24))
    ):
        for n in range(sampler.integer(1, 3)):
            size = (w * 0.29, d * 0.4, h * 0.42)
            piles[k % 2].append(rounded_box(size, (x * w, y * d, t + n * h * 0.43), 0.02))
    skin = any_skin(sampler)
    ring = torus(0.012, 0.004, (0, 0, 0), 8).rotated("x", 90)
    ring = ring.translated(0, -d / 2 - 0.004, h * 0.6)
    grip = carrying_grip(0.15, 0, 0, 0.011).rotated("x", 90).translated(0, -d / 2, h * 0.6)
    groups: list[tuple[Material, list[Mesh]]] = [
        (skin, [*tray, *lid]),
        (sampler.fabric(), piles[0]),
    ]
    groups += [(sampler.fabric(), piles[1]), (sampler.dark(), [grip]), (sampler.metal(), [ring])]
    return assemble("suitcase", *((m, [p.translated(0, shift, 0) for p in ps]) for m, ps in groups))
