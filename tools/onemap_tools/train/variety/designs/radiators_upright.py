"""Tall radiators: ladders for towels, slabs and upright tubes."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import Mesh, box, cylinder, rod, rounded_box, tube
from onemap_simulator.generation.model import Model
from onemap_simulator.generation.sampler import Sampler
from onemap_tools.train.variety.designs.radiator_parts import radiator_paint
from onemap_tools.train.variety.designs.sanitary import stand


def towel_ladder(sampler: Sampler) -> Model:
    """A tall ladder of round or flat bars in groups, straight or bowed to the front."""
    width, height, lift = (
        sampler.size(0.42, 0.62),
        sampler.size(0.8, 1.55),
        sampler.uniform(0.12, 0.35),
    )
    bow, flat = sampler.choice((0.0, 0.0, 0.05)), sampler.chance(0.35)
    groups_of, gaps = sampler.integer(3, 7), sampler.integer(1, 4)
    pitch = sampler.uniform(0.038, 0.05)
    rungs: list[Mesh] = []
    steps = np.linspace(0.03, height - 0.03, int(height / pitch))
    skip = groups_of + sampler.integer(1, gaps)
    for i, z in enumerate(steps.tolist()):
        if i % skip >= groups_of and 0 < i < len(steps) - 1:
            continue
        if flat:
            rungs.append(box((width, 0.014, pitch * 0.6), (0, -0.012, lift + z - pitch * 0.3)))
        else:
            path = [
                (x * width / 2, -bow * (1 - x * x), lift + z)
                for x in np.linspace(-1, 1, 7 if bow else 2)
            ]
            rungs.append(tube(path, 0.011, 6))
    posts = [rounded_box((0.035, 0.03, height), (s * (width / 2), 0, lift), 0.012) for s in (-1, 1)]
    posts += [
        rod((s * width / 2, 0, z), (s * width / 2, 0.07, z), 0.012)
        for s in (-1, 1)
        for z in (lift + 0.12, lift + height - 0.12)
    ]
    pipes: list[Mesh] = []
    for s in (-1, 1):
        pipes += [
            cylinder(0.011, lift, (s * width / 2, 0, 0), 8),
            cylinder(0.022, 0.012, (s * width / 2, 0, 0), 10),
        ]
    head = [
        cylinder(0.022, 0.07, segments=10)
        .rotated("x", 90)
        .translated(sampler.choice((-1, 1)) * width / 2, -0.01, lift - 0.04)
    ]
    return stand(
        "radiator",
        (radiator_paint(sampler), [*rungs, *posts]),
        (sampler.metal(), pipes),
        (sampler.plastic(), head),
    )


def _upright_front(sampler: Sampler, width: float, height: float, lift: float) -> list[Mesh]:
    """A slab, or upright slats or tubes on two cross bars."""
    kind = sampler.integer(0, 3)
    if kind == 0:
        parts = [rounded_box((width, 0.035, height), (0, -0.02, lift), 0.012)]
        parts += [box((width * 0.8, 0.03, height * 0.9), (0, 0.01, lift + height * 0.05))]
        parts += [
            box((width * 0.8, 0.012, 0.03), (0, -0.04, lift + height * 0.4 + i * 0.12))
            for i in range(sampler.integer(0, 3))
        ]
    else:
        count = sampler.integer(4, 9)
        pitch = width / count
        fill = sampler.uniform(0.5, 0.88)
        xs = [(i - (count - 1) / 2) * pitch for i in range(count)]
        ends = [height * (1 - (0.06 * abs(x) / width if kind == 3 else 0)) for x in xs]
        if kind == 1:
            parts = [
                rounded_box((pitch * fill, 0.025, e), (x, -0.02, lift), 0.008)
                for x, e in zip(xs, ends, strict=True)
            ]
        else:
            parts = [
                cylinder(min(pitch * fill / 2, 0.03), e, (x, -0.02, lift), 10)
                for x, e in zip(xs, ends, strict=True)
            ]
        parts += [box((width, 0.03, 0.04), (0, 0.012, lift + z)) for z in (0.05, height - 0.16)]
    return parts


def vertical(sampler: Sampler) -> Model:
    """A tall narrow design radiator: a bare slab, upright slats or tubes, or with a mirror gap."""
    width, height, lift = (
        sampler.size(0.32, 0.6),
        sampler.size(1.2, 1.85),
        sampler.uniform(0.08, 0.2),
    )
    parts = _upright_front(sampler, width, height, lift)
    parts += [
        rod(
            (s * width * 0.3, 0.01, lift + height * z),
            (s * width * 0.3, 0.07, lift + height * z),
            0.014,
        )
        for s in (-1, 1)
        for z in (0.1, 0.85)
    ]
    pipes = [cylinder(0.011, lift + 0.03, (s * 0.025, 0.0, 0), 8) for s in (-1, 1)]
    pipes.append(box((0.1, 0.04, 0.045), (0, 0, lift * 0.45)))
    head = [
        cylinder(0.022, 0.07, segments=10)
        .rotated("y", 90)
        .translated(0.045, 0, lift * 0.45 + 0.022)
    ]
    rail = [
        tube(
            [
                (-width / 2, -0.03, lift + height * 0.6),
                (-width / 2, -0.09, lift + height * 0.6),
                (width / 2, -0.09, lift + height * 0.6),
                (width / 2, -0.03, lift + height * 0.6),
            ],
            0.01,
        )
    ]
    return stand(
        "radiator",
        (radiator_paint(sampler), parts),
        (sampler.metal(), [*pipes, *(rail if sampler.chance(0.4) else [])]),
        (sampler.plastic(), head),
    )
