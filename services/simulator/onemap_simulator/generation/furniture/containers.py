"""Boxes, baskets, trash cans and suitcases."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import box, cylinder, ellipsoid, lathe, rod, rounded_box, tube
from onemap_simulator.generation.model import Model, assemble
from onemap_simulator.generation.sampler import Sampler


def cardboard_box(sampler: Sampler) -> Model:
    """A carton, closed with tape or open with four flaps."""
    width, depth, height = (
        sampler.size(0.32, 0.5),
        sampler.size(0.26, 0.38),
        sampler.size(0.22, 0.36),
    )
    tan = sampler.uniform(0.75, 1.1)
    brown = (0.72 * tan, 0.55 * tan, 0.36 * tan)
    card = sampler.material("noise", 0.3, brown) if sampler.chance(0.6) else sampler.plastic()
    if sampler.chance(0.5):
        tape = [
            box((width + 0.004, 0.05, 0.006), (0, 0, height)),
            box((width + 0.006, 0.05, height * 0.3), (0, 0, height * 0.7)),
        ]
        label = box((0.14, 0.005, 0.1), (width * 0.15, -depth / 2, height * 0.4))
        body = [box((width, depth, height))]
        return assemble("box", (card, body), (sampler.pale(), [*tape, label]))
    t = 0.008
    walls = [
        box((width, depth, t)),
        *(box((width, t, height), (0, s * (depth - t) / 2, 0)) for s in (-1, 1)),
        *(box((t, depth, height), (s * (width - t) / 2, 0, 0)) for s in (-1, 1)),
    ]
    for s in (-1, 1):
        flap = box((width, depth * 0.45, t), (0, s * depth * 0.225, 0))
        walls.append(flap.rotated("x", -s * 25).translated(0, s * depth / 2, height))
        flap = box((width * 0.3, depth, t), (s * width * 0.15, 0, 0))
        walls.append(flap.rotated("y", s * 35).translated(s * width / 2, 0, height))
    return assemble("box", (card, walls))


def basket(sampler: Sampler) -> Model:
    """A woven basket, round or oval, with two handles or a rim, at times with cloth in it."""
    radius, height = sampler.size(0.18, 0.25), sampler.size(0.24, 0.34)
    hue = sampler.uniform(0.6, 1.1)
    straw = (0.78 * hue, 0.6 * hue, 0.36 * hue) if sampler.chance(0.6) else sampler.colour()
    weave = sampler.material("checks" if sampler.chance(0.5) else "weave", 0.12, straw)
    low = radius * sampler.uniform(0.7, 0.95)
    rows = 8
    profile = []
    for row in range(rows + 1):  # bulging courses of wicker
        share = row / rows
        r = low + (radius - low) * share
        profile += [(r, height * share), (r + 0.012, height * (share + 0.4 / rows))]
    profile = [*profile[:-1], (radius - 0.02, height), (low - 0.02, 0.03), (0.0, 0.03)]
    oval = sampler.uniform(0.75, 1.0)
    body = [lathe(profile, segments=18).scaled(1.0, oval, 1.0)]
    angle = np.linspace(0, np.pi, 7)
    for side in (-1, 1):
        loop = [(side * radius * 0.97, 0.07 * np.cos(a), height + 0.06 * np.sin(a)) for a in angle]
        body.append(tube(loop, 0.014))
    groups = [(weave, body)]
    if sampler.chance(0.5):
        cloth = ellipsoid((radius * 0.85, radius * oval * 0.85, 0.08), (0, 0, height - 0.02), 10)
        groups.append((sampler.fabric(), [cloth]))
    return assemble("basket", *groups)


def trash_can(sampler: Sampler) -> Model:
    """A bin: a tapered bucket with a dark inside, or a pedal bin with a domed lid."""
    radius, height = sampler.size(0.13, 0.18), sampler.size(0.32, 0.48)
    skin = sampler.metal() if sampler.chance(0.5) else sampler.plastic()
    dark = sampler.dark()
    if sampler.chance(0.5):
        body = lathe(
            [
                (radius * 0.8, 0),
                (radius, height),
                (radius * 1.05, height),
                (radius * 0.95, height - 0.02),
                (radius * 0.75, 0.05),
            ]
        )
        bag = lathe(
            [
                (radius * 1.07, height - 0.07),
                (radius * 1.08, height + 0.012),
                (radius * 0.92, height + 0.005),
                (0, height - 0.12),
            ]
        )
        return assemble(
            "trash can", (skin, [body]), (dark if sampler.chance(0.6) else sampler.pale(), [bag])
        )
    body = cylinder(radius, height, (0, 0, 0.02), 18)
    lid = ellipsoid((radius * 1.03, radius * 1.03, 0.09), (0, 0, height + 0.02), 16)
    band = [cylinder(radius * 1.03, 0.03, (0, 0, height - 0.01), 18), cylinder(radius * 1.02, 0.03)]
    pedal = box((0.09, 0.07, 0.02), (0, -radius - 0.02, 0.015))
    return assemble("trash can", (skin, [body, lid]), (dark, [*band, pedal]))


def suitcase(sampler: Sampler) -> Model:
    """An upright trolley case: ribbed shell, wheels, a side grip and a pulled-out handle."""
    width, depth, height = (
        sampler.size(0.38, 0.48),
        sampler.size(0.22, 0.28),
        sampler.size(0.55, 0.7),
    )
    shell, dark, metal = (
        sampler.plastic() if sampler.chance(0.6) else sampler.fabric(),
        sampler.dark(),
        sampler.metal(),
    )
    body = [rounded_box((width, depth, height), (0, 0, 0.05), 0.05)]
    for x in np.linspace(-width * 0.32, width * 0.32, sampler.integer(3, 6)):
        body.append(
            rounded_box(
                (0.025, depth + 0.02, height * 0.86), (float(x), 0, 0.05 + height * 0.07), 0.012
            )
        )
    trim = [box((width + 0.006, 0.02, height * 0.9), (0, 0, 0.05 + height * 0.05))]
    wheels = [
        cylinder(0.03, 0.03, segments=10)
        .rotated("y", 90)
        .translated(x * width * 0.36 - 0.015, y * depth * 0.33, 0.03)
        for x in (-1, 1)
        for y in (-1, 1)
    ]
    top, pull = height + 0.05, sampler.size(0.12, 0.35)
    bars = [rod((x * 0.09, 0.04, top - 0.02), (x * 0.09, 0.04, top + pull), 0.01) for x in (-1, 1)]
    grip = [rounded_box((0.24, 0.035, 0.035), (0, 0.04, top + pull - 0.015), 0.015)]
    grip.append(
        tube(
            [
                (-0.08, -0.03, top - 0.01),
                (-0.06, -0.03, top + 0.035),
                (0.06, -0.03, top + 0.035),
                (0.08, -0.03, top - 0.01),
            ],
            0.012,
        )
    )
    return assemble("suitcase", (shell, body), (metal, bars), (dark, [*trim, *wheels, *grip]))
