"""Fans of many makes: on poles and feet, towers, rings, boxes and drums."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import (
    Mesh,
    box,
    cone,
    cylinder,
    lathe,
    rod,
    rounded_box,
    torus,
    tube,
)
from onemap_simulator.generation.model import Model
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.fan_parts import assembled_fan, caged_head, placed_head
from onemap_tools.train.variety.designs.fans_enclosed import box_fan, drum
from onemap_tools.train.variety.designs.sanitary import ring, skin, stand


def standing(sampler: Sampler) -> Model:
    """A pedestal fan: a cross, a ring, a disc or a tripod of wood below, buttons on the pole."""
    height, radius = sampler.size(0.95, 1.4), sampler.size(0.18, 0.26)
    z, kind = height - radius, sampler.integer(0, 3)
    base: list[Mesh] = []
    low = 0.0
    if kind == 0:
        base = [box((0.56, 0.05, 0.03)).rotated("z", a) for a in (45, 135)]
        base.append(cone((0.06, 0.025), 0.08, (0, 0, 0.02)))
    elif kind == 1:
        base = [
            cone((radius * 0.95, radius * 0.8), 0.03, segments=20),
            cone((radius * 0.4, 0.03), 0.06, (0, 0, 0.028)),
        ]
    elif kind == 2:
        base = [
            torus(0.22, 0.015, (0, 0, 0.015), 20),
            *(
                rod((0.22 * np.cos(a), 0.22 * np.sin(a), 0.015), (0, 0, 0.06), 0.012)
                for a in (0.5, 2.6, 4.7)
            ),
        ]
    else:
        low = z * sampler.uniform(0.5, 0.85)
        base = [
            rod(
                (0.27 * np.cos(a), 0.27 * np.sin(a), 0.0),
                (0.02 * np.cos(a), 0.02 * np.sin(a), low + 0.03),
                0.018,
            )
            for a in (0.52, 2.62, 4.71)
        ]
        base.append(cylinder(0.05, 0.05, (0, 0, low), 12))
    pole = [cylinder(0.014, z - low * 0.98, (0, 0, low * 0.98), 10)]
    if low == 0.0:
        pole.append(cylinder(0.022, z * 0.5, (0, 0, 0.04), 10))
    if sampler.chance(0.6):
        box_z = z - sampler.uniform(0.16, 0.3)
        base.append(rounded_box((0.08, 0.07, 0.13), (0, -0.015, box_z), 0.02))
        pole += [
            cylinder(0.008, 0.012, segments=8)
            .rotated("x", 90)
            .translated(0, -0.048, box_z + 0.025 + i * 0.025)
            for i in range(4)
        ]
    return assembled_fan(sampler, pole, base, placed_head(sampler, caged_head(sampler, radius), z))


def tall_foot(sampler: Sampler) -> Model:
    """A desk fan on a stout foot: a stepped 1950s base or a box with piano keys."""
    radius = sampler.size(0.12, 0.2)
    stem = sampler.uniform(0.03, 0.22)
    z = radius + 0.05 + stem
    base: list[Mesh]
    keys: list[Mesh] = []
    if sampler.chance(0.5):
        r = radius * 0.75
        base = [
            lathe(
                [
                    (r, 0),
                    (r, 0.02),
                    (r * 0.8, 0.035),
                    (r * 0.75, 0.055),
                    (r * 0.3, 0.08),
                    (0.02, z * 0.8),
                    (0.02, z - 0.02),
                ],
                segments=18,
            )
        ]
        keys = [cylinder(0.018, 0.015, (0, -r * 0.55, 0.055), 10)]
    else:
        w = radius * 1.1
        base = [
            rounded_box((w, w * 1.1, 0.06), (0, 0, 0), 0.02),
            cone((0.045, 0.03), z - 0.07, (0, 0.02, 0.05)),
        ]
        keys = [
            box((w * 0.18, 0.04, 0.018), ((i - 1.5) * w * 0.22, -w * 0.4, 0.054)) for i in range(4)
        ]
    if sampler.chance(0.3):
        x, tall = radius + 0.025, z
        loop = [
            (x * np.cos(a), 0.0, tall + x * np.sin(a)) for a in np.linspace(np.pi, 2 * np.pi, 13)
        ]
        keys += [
            tube(loop, 0.011),
            rod((-x, 0, tall), (-radius, 0, tall), 0.01),
            rod((radius, 0, tall), (x, 0, tall), 0.01),
        ]
    return assembled_fan(sampler, keys, base, placed_head(sampler, caged_head(sampler, radius), z))


def tower(sampler: Sampler) -> Model:
    """A slim column with upright slots, a disc below and buttons on top."""
    height, wide = sampler.size(0.7, 1.15), sampler.size(0.13, 0.22)
    deep, power = wide * sampler.uniform(0.85, 1.2), sampler.choice((2.0, 2.6, 6.0))
    waist = sampler.uniform(0.85, 1.05)
    rings = [
        ring((wide * s, deep * s), z, power)
        for s, z in (
            (1.0, 0.03),
            (waist, height * 0.5),
            (1.0, height - 0.02),
            (0.9, height),
            (0.6, height + 0.006),
        )
    ]
    body = [skin(rings)]
    foot = (
        [cone((wide * 0.95, wide * 0.8), 0.035, segments=20)]
        if sampler.chance(0.6)
        else [rounded_box((wide * 1.7, deep * 1.4, 0.04), (0, 0, 0), 0.018)]
    )
    slots: list[Mesh] = []
    low, tall = height * sampler.uniform(0.15, 0.35), height * sampler.uniform(0.5, 0.6)
    if sampler.chance(0.6):
        for x in np.linspace(-0.3, 0.3, sampler.integer(5, 9)).tolist():
            y = -deep / 2 * (1 - (2 * abs(x)) ** power) ** (1 / power)
            slots.append(rod((x * wide, y, low), (x * wide, y, low + tall), 0.005, 5))
    else:
        n = sampler.integer(14, 26)
        arc = np.linspace(-0.9, 0.9, 7)
        for z in np.linspace(low, low + tall, n).tolist():
            path = [
                (
                    x * 0.42 * wide,
                    -deep / 2 * (1 - abs(x * 0.84) ** power) ** (1 / power) - 0.001,
                    z,
                )
                for x in arc.tolist()
            ]
            slots.append(tube(path, 0.005, 4))
    keys = [cylinder(0.01, 0.01, ((i - 1) * wide * 0.17, 0, height + 0.002), 8) for i in range(3)]
    dial = box((wide * 0.3, 0.012, 0.04), (0, -deep / 2 * 1.0, height * 0.91))
    case = sampler.enamel() if sampler.chance(0.5) else sampler.plastic()
    return stand(
        "fan",
        (case, body),
        (sampler.dark(), [*slots, dial]),
        (sampler.plastic(), foot),
        (sampler.metal(), keys),
    )


def ring_fan(sampler: Sampler) -> Model:
    """A fan without blades: a hoop or a long loop of air on a drum with small holes."""
    wide, long = sampler.size(0.22, 0.34), sampler.choice((1.0, 1.0, 1.9, 2.6))
    tall, deep = wide * long, sampler.uniform(0.07, 0.13)
    drum, foot_h = sampler.uniform(0.065, 0.1), sampler.size(0.16, 0.4)
    power = 2.0 if long == 1.0 else 3.0
    hoop: list[Mesh] = []
    profile = (
        (1.0, -deep / 2),
        (1.0, deep / 2),
        (0.9, deep / 2),
        (0.8, -deep / 2),
        (1.0, -deep / 2),
    )
    rings = [
        ring((wide - 0.0 + (s - 1) * wide, tall + (s - 1) * wide), y, power) for s, y in profile
    ]
    hoop.append(
        skin(rings, capped=False).rotated("x", 90).translated(0, 0, foot_h + tall / 2 - 0.015)
    )
    base = [
        lathe(
            [
                (drum * 1.1, 0),
                (drum * 1.1, 0.02),
                (drum, 0.04),
                (drum * 0.95, foot_h * 0.8),
                (drum * 0.6, foot_h),
            ],
            segments=18,
        )
    ]
    holes: list[Mesh] = []
    rows = sampler.integer(3, 6)
    for i in range(rows):
        z = foot_h * (0.3 + 0.45 * i / rows)
        holes.append(torus(drum * 0.985, 0.004, (0, 0, z), 18))
    keys = [
        cylinder(0.014, 0.012, segments=10)
        .rotated("x", 90)
        .translated(0, -drum + 0.002, foot_h * 0.17)
    ]
    case = sampler.enamel()
    return stand(
        "fan",
        (case, hoop),
        (case if sampler.chance(0.4) else sampler.metal(), base),
        (sampler.dark(), [*holes, *keys]),
    )


DESIGNS: dict[str, tuple[ModelFactory, ...]] = {
    "fan": (standing, tall_foot, tower, ring_fan, box_fan, drum)
}
