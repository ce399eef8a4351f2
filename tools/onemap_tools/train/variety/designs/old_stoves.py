"""Ovens of other times: enamelled stoves and iron ranges."""

from __future__ import annotations

from onemap_simulator.generation.mesh import (
    Mesh,
    Vec,
    box,
    cylinder,
    lathe,
    rod,
    rounded_box,
    torus,
)
from onemap_simulator.generation.model import Model, assemble
from onemap_simulator.generation.sampler import Sampler
from onemap_tools.train.variety.designs.appliance_parts import disc, grip, round_rect, slab, slats
from onemap_tools.train.variety.designs.oven_parts import CATEGORY, DEPTH_M, FRONT_Y, TOP_M


def _hot_plates(z: float) -> list[Mesh]:
    """Four hot plates of two rings each, at height z."""
    return [
        m
        for x in (-0.15, 0.15)
        for deep in (-0.13, 0.1)
        for m in (
            torus(0.08, 0.008, (x, deep, z), 14),
            torus(0.045, 0.008, (x, deep, z), 12),
        )
    ]


def _curved_legs(width: float, height: float) -> list[Mesh]:
    """Turned legs under the corners, swollen above."""
    legs = []
    for x in (-1, 1):
        for deep in (FRONT_Y + 0.09, DEPTH_M / 2 - 0.06):
            foot = lathe(
                [(0.022, 0), (0.013, height * 0.3), (0.016, height * 0.6), (0.034, height + 0.01)],
                segments=8,
            )
            legs.append(foot.translated(x * (width / 2 - 0.1), deep))
    return legs


def retro_stove(sampler: Sampler) -> Model:
    """A stove of the 1940s or 1950s: curved legs, two enamel doors, a high back with a shelf."""
    width, y = sampler.size(0.6, 0.85), FRONT_Y
    low, top = sampler.uniform(0.12, 0.3), TOP_M - 0.02
    radius = sampler.uniform(0.03, 0.09)
    casing = [
        slab(round_rect(width, top - low, radius, 0.03), DEPTH_M - 0.04, (0, DEPTH_M / 2, low))
    ]
    seam = width * sampler.uniform(-0.05, 0.18)
    fronts, glass, bright = [], [], []
    face = top - sampler.uniform(0.1, 0.14)
    for x0, x1 in ((-width / 2 + 0.015, seam), (seam, width / 2 - 0.015)):
        wide, x = x1 - x0 - 0.02, (x0 + x1) / 2
        spans = (
            [(low + 0.03, face)]
            if sampler.chance(0.4)
            else [
                (low + 0.03, low + 0.03 + (face - low) * 0.4),
                (low + 0.03 + (face - low) * 0.4, face),
            ]
        )
        for bottom, upper in spans:
            tall, corner = upper - bottom - 0.02, min(0.05, wide * 0.2)
            fronts.append(slab(round_rect(wide, tall, corner, corner), 0.04, (x, y + 0.05, bottom)))
            bright += grip(sampler, wide * 0.6, (x, y + 0.012, bottom + tall - 0.045), False)
            if tall > 0.3 and sampler.chance(0.5):
                hole = round_rect(wide * 0.5, tall * 0.4, 0.03, 0.03)
                glass.append(slab(hole, 0.012, (x, y + 0.014, bottom + tall * 0.22)))
    count = sampler.integer(4, 6)
    xs = [(step / (count - 1) - 0.5) * width * 0.8 for step in range(count)]
    bright += [disc(0.024, 0.03, (x, y + 0.042, (face + top) / 2), 12) for x in xs]
    plate = [rounded_box((width + 0.01, DEPTH_M, 0.03), (0, 0, top - 0.01), 0.012)]
    back = sampler.uniform(0.15, 0.4)
    casing.append(slab(round_rect(width, back, 0.005, 0.05), 0.05, (0, DEPTH_M / 2, top + 0.015)))
    if sampler.chance(0.5):
        casing.append(rounded_box((width, 0.16, 0.03), (0, DEPTH_M / 2 - 0.08, top + back), 0.012))
    bright.append(disc(0.05, 0.015, (0, DEPTH_M / 2 - 0.045, top + back * 0.55), 16))
    return assemble(
        CATEGORY,
        (sampler.enamel(), casing),
        (sampler.enamel(), fronts),
        (sampler.metal(), bright),
        (sampler.dark(), _hot_plates(top + 0.024) + glass),
        (sampler.enamel(), plate),
        (sampler.metal(), _curved_legs(width, low)),
    )


def _iron_door(wide: float, tall: float, corner: float, at: Vec) -> tuple[list[Mesh], list[Mesh]]:
    """A door with a raised panel, ``at`` the middle of its lower edge; its hinges and latch."""
    x, y, z = at
    shape = round_rect(wide - 0.05, tall - 0.03, corner, corner)
    inner = round_rect(wide - 0.12, tall - 0.1, corner, corner)
    leaf = [slab(shape, 0.035, (x, y + 0.032, z)), slab(inner, 0.016, (x, y + 0.004, z + 0.035))]
    fittings: list[Mesh] = []
    for h in (0.2, 0.75):
        fittings.append(
            cylinder(0.009, 0.05, (x - wide / 2 + 0.024, y - 0.004, z + h * tall - 0.03), 8)
        )
    fittings.append(
        rod(
            (x + wide * 0.22, y - 0.03, z + tall * 0.5),
            (x + wide * 0.38, y - 0.03, z + tall * 0.5),
            0.011,
        )
    )
    fittings.append(disc(0.012, 0.035, (x + wide * 0.36, y, z + tall * 0.5), 8))
    return leaf, fittings


def iron_range(sampler: Sampler) -> Model:
    """A heavy cast-iron kitchen range: round lids on top, small doors with hinges, a rail."""
    width, y, top = sampler.size(0.7, 0.98), FRONT_Y, TOP_M
    casing = [box((width, DEPTH_M - 0.03, top - 0.14), (0, 0.015, 0.1))]
    plinth = [box((width - 0.06, DEPTH_M - 0.1, 0.1), (0, 0.03, 0))]
    plate = [rounded_box((width + 0.02, DEPTH_M + 0.02, 0.045), (0, 0, top - 0.045), 0.018)]
    doors, bright = [], []
    columns = sampler.integer(2, 3)
    wide = width / columns
    for index in range(columns):
        x = (index - (columns - 1) / 2) * wide
        rows = sampler.integer(1, 2)
        for row in range(rows):
            tall = (top - 0.22) / rows
            corner = sampler.choice([0.01, 0.04])
            leaf, fittings = _iron_door(wide, tall, corner, (x, y, 0.14 + row * tall))
            doors += leaf
            bright += fittings
    rail = top - 0.06
    bright.append(rod((-width / 2, y - 0.055, rail), (width / 2, y - 0.055, rail), 0.013))
    bright += [
        rod((x * width, y + 0.02, rail), (x * width, y - 0.055, rail), 0.011) for x in (-0.45, 0.45)
    ]
    lids = []
    for x in (-width / 4, width / 4):
        if sampler.chance(0.6):
            lids.append(
                lathe([(0.15, 0), (0.155, 0.02), (0.14, 0.05), (0.05, 0.065)], (x, 0, top), 18)
            )
            lids.append(
                torus(0.03, 0.006, (0, 0, 0), 10).rotated("x", 90).translated(x, -0.14, top + 0.04)
            )
        else:
            lids += [torus(0.11, 0.006, (x, 0, top), 16), torus(0.05, 0.006, (x, 0, top), 12)]
    if sampler.chance(0.5):
        pipe = cylinder(
            0.06, sampler.uniform(0.4, 1.0), (width * 0.3, DEPTH_M / 2 - 0.08, top - 0.01), 12
        )
        plinth.append(pipe)
    if sampler.chance(0.4):
        plinth += slats(width * 0.5, 0.08, (0, y + 0.07, 0.01), 3)
    return assemble(
        CATEGORY,
        (sampler.enamel(), casing),
        (sampler.enamel(), doors),
        (sampler.metal(), bright),
        (sampler.metal(), lids),
        (sampler.enamel(), plate),
        (sampler.dark(), plinth),
    )
