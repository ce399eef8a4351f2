"""Toasters of today: for four slices, with long slots, with flat sides."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import Mesh, box, cylinder, ellipsoid, rod, rounded_box, tube
from onemap_simulator.generation.model import Model, assemble
from onemap_simulator.generation.sampler import Sampler
from onemap_tools.train.variety.designs.appliance_parts import centred, disc, extruded, feet, rubber
from onemap_tools.train.variety.designs.toaster_parts import (
    CATEGORY,
    bread_slots,
    crust,
    lead,
    slice_of_bread,
)


def four_slot(sampler: Sampler) -> Model:
    """A wide one for four slices: two pairs of slots, two levers and dials on the front."""
    width, depth, height = (
        sampler.size(0.3, 0.38),
        sampler.size(0.24, 0.3),
        sampler.size(0.18, 0.22),
    )
    low, y = 0.018, -depth / 2
    body = [rounded_box((width, depth, height - low), (0, 0, low), sampler.uniform(0.012, 0.05))]
    plate = [rounded_box((width * 0.86, depth * 0.8, 0.008), (0, 0, height - 0.004), 0.003)]
    slots = [
        box((0.028, depth * 0.6, 0.01), (x * width, 0, height)) for x in (-0.32, -0.16, 0.16, 0.32)
    ]
    bread: list[Mesh] = []
    if sampler.chance(0.5):
        for x in (-0.32, -0.16, 0.16, 0.32):
            if sampler.chance(0.7):
                piece = slice_of_bread(sampler, 0.11, (0, 0, 0)).rotated("z", 90)
                bread.append(piece.translated(x * width, 0, height - 0.03))
    face = [rounded_box((width * 0.86, 0.014, height * 0.7), (0, y, low + height * 0.1), 0.005)]
    knobs = []
    for x in (-0.24, 0.24):
        z = low + height * sampler.choice([0.35, 0.6])
        knobs.append(rounded_box((0.05, 0.03, 0.016), (x * width, y - 0.016, z), 0.006))
        knobs.append(disc(0.016, 0.016, (x * width, y - 0.006, low + height * 0.2), 12))
        slots.append(
            box((0.008, 0.004, height * 0.42), (x * width, y - 0.0075, low + height * 0.33))
        )
    foot = feet(width, depth, low + 0.008, 0.014)
    return centred(
        assemble(
            CATEGORY,
            (sampler.enamel(), body),
            (sampler.metal(), plate),
            (sampler.metal(), face),
            (sampler.dark(), slots),
            (sampler.plastic(), knobs),
            (rubber(sampler), [*foot, lead(depth, 0.05)]),
            *([(crust(sampler), bread)] if bread else []),
        )
    )


def long_slot(sampler: Sampler) -> Model:
    """A long narrow one with one or two full-length slots, a bun rack above, a stepped base."""
    width, depth, height = (
        sampler.size(0.34, 0.42),
        sampler.size(0.11, 0.18),
        sampler.size(0.16, 0.2),
    )
    low = 0.03
    body = [
        rounded_box((width * 0.97, depth, height - low), (0, 0, low), sampler.uniform(0.008, 0.035))
    ]
    base = [rounded_box((width, depth * 1.06, low), (0, 0, 0.006), 0.008)]
    at = [(0.0, 0.0)] if depth < 0.14 else [(0.0, -0.033), (0.0, 0.033)]
    slots, bread = bread_slots(sampler, width * 0.8, at, height + 0.003)
    rack: list[Mesh] = []
    if sampler.chance(0.55) and not bread:
        z = height + sampler.uniform(0.03, 0.05)
        for y in (-0.4, -0.13, 0.13, 0.4):
            rack.append(rod((-width * 0.36, y * depth, z), (width * 0.36, y * depth, z), 0.003, 6))
        for x in (-0.36, 0.36):
            points = [(x * width, -depth * 0.3, height - 0.004), (x * width, -depth * 0.4, z)]
            points += [(x * width, depth * 0.4, z), (x * width, depth * 0.3, height - 0.004)]
            rack.append(tube(points, 0.0035, 6))
        for x in np.linspace(-0.2, 0.2, sampler.integer(1, 2)):
            bread.append(ellipsoid((0.05, 0.04, 0.028), (float(x) * width, 0, z + 0.028), 10))
    side = width / 2
    lever = rounded_box((0.03, 0.045, 0.016), (side + 0.006, 0, height * 0.6), 0.006)
    knobs = [lever, disc(0.018, 0.018, (width * 0.32, -depth / 2 + 0.002, height * 0.35), 12)]
    knobs += [
        disc(0.007, 0.01, (width * (0.2 - 0.07 * i), -depth / 2 + 0.002, height * 0.35), 8)
        for i in range(3)
    ]
    feet_ = feet(width, depth, 0.008, 0.012)
    groups = [(sampler.metal(), rack)] if rack else []
    groups += [(crust(sampler), bread)] if bread else []
    return centred(
        assemble(
            CATEGORY,
            (sampler.enamel(), body),
            (sampler.plastic(), base),
            (sampler.dark(), slots),
            (sampler.metal(), knobs),
            (rubber(sampler), [*feet_, lead(depth, -0.1)]),
            *groups,
        )
    )


def _bun_rack(width: float, height: float, gap: float) -> list[Mesh]:
    """Rods and brackets above two slots at y = -gap and gap."""
    rack: list[Mesh] = []
    for y in (-gap, gap):
        for dy in (-0.02, 0.02):
            rack.append(
                rod(
                    (-width * 0.26, y + dy, height + 0.012),
                    (width * 0.26, y + dy, height + 0.012),
                    0.0025,
                    5,
                )
            )
        rack += [box((0.006, 0.044, 0.014), (x * width * 0.26, y, height - 0.002)) for x in (-1, 1)]
    return rack


def boxy_toaster(sampler: Sampler) -> Model:
    """Flat steel sides between end blocks of wood or plastic, a crumb tray, buttons in front."""
    width, depth, height = (
        sampler.size(0.26, 0.34),
        sampler.size(0.16, 0.22),
        sampler.size(0.18, 0.22),
    )
    low, end = 0.015, sampler.uniform(0.03, 0.06)
    flare = sampler.uniform(0.78, 1.0)
    outline = [
        (-depth / 2, low),
        (depth / 2, low),
        (depth / 2 * flare, height),
        (-depth / 2 * flare, height),
    ]
    body = [extruded(outline, width - 2 * end + 0.004)]
    block = [(y * 1.06, z if z < 0.1 else z + 0.006) for y, z in outline]
    ends = [extruded(block, end, side * (width - end) / 2) for side in (-1, 1)]
    gap = depth * 0.2 * flare
    slots, bread = bread_slots(
        sampler, (width - 2 * end) * 0.9, [(0.0, -gap), (0.0, gap)], height + 0.004
    )
    right = width / 2
    knobs = [box((0.028, 0.06, 0.016), (right + 0.012, 0, height * sampler.choice([0.45, 0.75])))]
    knobs.append(
        cylinder(0.016, 0.016, segments=12)
        .rotated("y", 90)
        .translated(right - 0.002, 0.03, height * 0.25)
    )
    tray = [
        box((width * 0.55, 0.03, 0.01), (0, -depth / 2, 0.004)),
        *feet(width, depth, low + 0.004, 0.012),
    ]
    if sampler.chance(0.4):
        knobs += _bun_rack(width, height, gap)
    return centred(
        assemble(
            CATEGORY,
            (sampler.metal(), body),
            (sampler.wood(), ends),
            (sampler.dark(), slots),
            (sampler.metal(), knobs),
            (rubber(sampler), [*tray, lead(depth, 0.0)]),
            *([(crust(sampler), bread)] if bread else []),
        )
    )
