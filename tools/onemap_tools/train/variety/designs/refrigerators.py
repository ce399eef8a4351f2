"""Refrigerators: retro, bottom or top freezer, small, with notes; and wide and open ones."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import Mesh, box, cylinder, ellipsoid, rod, rounded_box, tube
from onemap_simulator.generation.model import Model, assemble
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.appliance_parts import (
    disc,
    feet,
    grip,
    round_rect,
    rubber,
    slab,
    slats,
)
from onemap_tools.train.variety.designs.open_refrigerators import ajar, both_open, drinks, wine
from onemap_tools.train.variety.designs.refrigerator_parts import (
    CATEGORY,
    Size,
    closed_body,
    door_leaf,
    hinge_covers,
)
from onemap_tools.train.variety.designs.wide_refrigerators import (
    american,
    french_door,
    panelled,
    side_by_side,
    wide_steel,
)


def retro(sampler: Sampler) -> Model:
    """A rounded refrigerator of the 1950s with a lever handle, a chrome badge and hinges."""
    width, depth = sampler.size(0.54, 0.7), sampler.size(0.58, 0.7)
    height, low = sampler.size(1.2, 1.75), sampler.uniform(0.06, 0.14)
    crown, y = sampler.uniform(0.09, 0.2), -depth / 2
    paint, chrome, dark = sampler.enamel(), sampler.metal(), sampler.dark()
    outline = round_rect(width, height - low, 0.03, crown)
    casing = [slab(outline, depth - 0.1, (0, depth / 2, low))]
    seal = slab(round_rect(width - 0.03, height - low - 0.03, 0.03, crown), 0.02)
    gasket = [seal.translated(0, y + 0.11, low + 0.015)]
    splits = [(low + 0.015, height - 0.005)]
    if sampler.chance(0.5):
        cut = low + (height - low) * sampler.uniform(0.66, 0.74)
        splits = [(low + 0.015, cut - 0.006), (cut + 0.006, height - 0.005)]
    side, doors, bright = sampler.choice([-1, 1]), [], []
    for bottom, top in splits:
        round_top = crown if top > height - 0.01 else 0.02
        for inset, front in ((0.0, 0.055), (0.022, 0.032), (0.05, 0.014)):
            shape = round_rect(
                width - 2 * inset, top - bottom - 2 * inset, 0.02, max(round_top - inset, 0.02)
            )
            doors.append(slab(shape, 0.05, (0, y + front + 0.042, bottom + inset)))
        z = (bottom + top) / 2 if len(splits) == 1 else bottom + (top - bottom) * 0.4
        bright += _lever(sampler, (side * (width / 2 - 0.1), y + 0.006, z), -side)
        for hinge in (bottom + 0.1, top - 0.16):
            bright.append(cylinder(0.012, 0.06, (-side * width / 2, y + 0.09, hinge), 8))
    badge = rounded_box((width * sampler.uniform(0.15, 0.5), 0.015, 0.035), radius=0.006)
    bright.append(badge.translated(0, y + 0.01, height - crown - 0.06))
    skirt = box((width - 0.04, depth - 0.14, low), (0, 0.05, 0))
    legs = [m.translated(0, 0.05) for m in feet(width, depth - 0.1, low + 0.005, 0.03)]
    base = [skirt] if sampler.chance(0.5) else legs
    return assemble(CATEGORY, (paint, [*casing, *doors]), (chrome, bright), (dark, gasket + base))


def _lever(sampler: Sampler, at: Size, towards: int) -> list[Mesh]:
    """A chrome lever: a boss and a bent arm, upright or pointing ``towards`` -1 or 1."""
    x, y, z = at
    boss = ellipsoid((0.026, 0.02, 0.05), (x, y, z), 10)
    reach = sampler.uniform(0.12, 0.22)
    if sampler.chance(0.5):
        path = [(x, y, z), (x, y - 0.05, z - 0.03), (x, y - 0.055, z - reach)]
    else:
        path = [(x, y, z), (x + towards * 0.02, y - 0.05, z), (x + towards * reach, y - 0.045, z)]
    return [boss, tube(path, 0.012)]


def bottom_freezer(sampler: Sampler) -> Model:
    """A slim one with the freezer below: grips sunk into the edges between the doors."""
    width, depth = sampler.size(0.54, 0.64), sampler.size(0.58, 0.68)
    height, low, y = sampler.size(1.6, 2.02), 0.06, -depth / 2
    casing, dark = closed_body(sampler, (width, depth, height), 0.06, low)
    split = low + (height - low) * sampler.uniform(0.28, 0.45)
    gap = sampler.uniform(0.025, 0.05)
    leaves = [door_leaf(sampler, (width, 0.06, split - low - gap / 2), (0, y, low))]
    leaves.append(
        door_leaf(sampler, (width, 0.06, height - split - gap / 2), (0, y, split + gap / 2))
    )
    dark.append(box((width - 0.012, 0.02, gap), (0, y + 0.05, split - gap / 2)))
    trim = [box((width * 0.96, 0.012, 0.012), (0, y + 0.012, split - gap / 2 - 0.004))]
    side = sampler.choice([-1, 1])
    for z in (split + 0.18, split - 0.3):
        if sampler.chance(0.5):
            dark.append(box((0.028, 0.02, 0.16), (side * (width / 2 - 0.006), y + 0.02, z)))
    if sampler.chance(0.5):
        dark.append(box((0.13, 0.006, 0.035), (0, y - 0.001, height - 0.13)))
        trim += [box((0.012, 0.006, 0.012), (x, y - 0.004, height - 0.12)) for x in (-0.03, 0.03)]
    trim.append(box((0.07, 0.006, 0.018), (-side * width * 0.3, y - 0.001, height - 0.09)))
    dark += hinge_covers(width, depth, height, (-side,))
    return assemble(
        CATEGORY,
        (sampler.enamel(), leaves),
        (sampler.enamel(), casing),
        (sampler.metal(), trim),
        (rubber(sampler), dark),
    )


def mini(sampler: Sampler) -> Model:
    """A knee-high refrigerator under a thick top, with one door and at times a freezer flap."""
    width, depth = sampler.size(0.42, 0.58), sampler.size(0.44, 0.58)
    height, low, y = sampler.size(0.55, 0.9), sampler.uniform(0.03, 0.08), -depth / 2
    lid = sampler.uniform(0.02, 0.05)
    casing, dark = closed_body(sampler, (width, depth, height - lid), 0.05, low)
    top = rounded_box((width + 0.006, depth, lid), (0, 0, height - lid), 0.01)
    side = sampler.choice([-1, 1])
    spans = [(low, height - lid - 0.008)]
    if sampler.chance(0.35):
        cut = height * sampler.uniform(0.62, 0.72)
        spans = [(low, cut - 0.005), (cut + 0.005, height - lid - 0.008)]
    leaves, handles = [], []
    x = side * (width / 2 - 0.045)
    for bottom, upper in spans:
        leaves.append(door_leaf(sampler, (width, 0.05, upper - bottom), (0, y, bottom)))
        tall = min(0.22, (upper - bottom) * 0.6)
        if sampler.chance(0.7):
            handles += grip(sampler, tall, (x, y, upper - tall / 2 - 0.03), True)
        else:
            handles += grip(sampler, width * 0.4, (0, y, upper - 0.04), False)
    handles.append(box((0.08, 0.008, 0.02), (-side * width * 0.25, y - 0.002, height - lid - 0.07)))
    if sampler.chance(0.3):
        dark.append(disc(0.022, 0.02, (-side * width * 0.3, y, low + 0.08)))
    second = sampler.wood() if sampler.chance(0.4) else sampler.enamel()
    return assemble(
        CATEGORY,
        (sampler.enamel(), [*casing, *leaves]),
        (second, [top]),
        (sampler.metal(), handles),
        (rubber(sampler), dark),
    )


def noted(sampler: Sampler) -> Model:
    """A family's two-door refrigerator with notes, photographs and magnets on its doors."""
    width, depth = sampler.size(0.56, 0.7), sampler.size(0.58, 0.68)
    height, low, y = sampler.size(1.5, 1.85), 0.07, -depth / 2
    casing, dark = closed_body(sampler, (width, depth, height), 0.06, low)
    split = low + (height - low) * sampler.choice([0.35, 0.66, 0.72])
    side = sampler.choice([-1, 1])
    leaves, handles = [], []
    for bottom, top, sign in ((low, split - 0.005, -1), (split + 0.005, height, 1)):
        leaves.append(door_leaf(sampler, (width, 0.06, top - bottom), (0, y, bottom)))
        tall = min(0.4, (top - bottom) * 0.6)
        z = split + sign * (tall / 2 + 0.05)
        handles += grip(sampler, tall, (side * (width / 2 - 0.05), y, z), True)
    papers: list[list[Mesh]] = [[], [], []]
    magnets: list[Mesh] = []
    for index in range(sampler.integer(4, 12)):
        wide, tall = sampler.uniform(0.06, 0.18), sampler.uniform(0.06, 0.2)
        x = -side * width * 0.08 + sampler.uniform(-0.3, 0.3) * (width - 0.12)
        z = (
            sampler.uniform(split + 0.03, height - 0.27)
            if split < height * 0.5
            else (sampler.uniform(height * 0.3, split - 0.24))
        )
        sheet = box((wide, 0.002, tall), (0, 0, -tall)).rotated("y", sampler.uniform(-9, 9))
        front = y - 0.003 - index * 0.002
        papers[index % 3].append(sheet.translated(x, front, z + tall))
        magnets.append(
            disc(sampler.uniform(0.009, 0.018), 0.01, (x, front - 0.001, z + tall - 0.02), 8)
        )
    dark += hinge_covers(width, depth, height, (-side,))
    notes = [(sampler.fabric() if i else sampler.pale(), p) for i, p in enumerate(papers)]
    return assemble(
        CATEGORY,
        (sampler.enamel(), [*casing, *leaves]),
        (sampler.metal(), handles),
        (rubber(sampler), dark),
        (sampler.plastic(), magnets),
        *notes,
    )


def top_freezer(sampler: Sampler) -> Model:
    """A 1970s pair of doors with a full-length edge grip, trim strips and coils at the back."""
    width, depth = sampler.size(0.56, 0.74), sampler.size(0.6, 0.7)
    height, low, y = sampler.size(1.4, 1.75), 0.09, -depth / 2
    side = sampler.choice([-1, 1])
    casing = [box((width, depth - 0.11, height - low), (0, 0.025, low))]
    cut = low + (height - low) * sampler.uniform(0.64, 0.75)
    leaves, trims, dark = [], [], []
    for bottom, top in ((low, cut - 0.007), (cut + 0.007, height)):
        leaves.append(rounded_box((width, 0.06, top - bottom), (0, y + 0.03, bottom), 0.018))
        edge = (side * (width / 2 - 0.02), y - 0.008, bottom + 0.01)
        trims.append(rounded_box((0.04, 0.03, top - bottom - 0.02), edge, 0.008))
        dark.append(box((width - 0.02, 0.02, top - bottom - 0.03), (0, y + 0.065, bottom + 0.015)))
        trims.append(box((0.05, 0.05, 0.012), (-side * (width / 2 - 0.025), y + 0.04, top)))
    if sampler.chance(0.6):
        trims.append(box((width * 0.9, 0.01, 0.02), (-side * 0.02, y - 0.001, cut + 0.03)))
    trims.append(box((0.14, 0.01, 0.03), (-side * width * 0.22, y - 0.001, height - 0.1)))
    back = depth / 2 - 0.012
    for z in np.linspace(low + 0.2, height - 0.15, 9):
        dark.append(rod((-width * 0.42, back, float(z)), (width * 0.42, back, float(z)), 0.006, 5))
    for x in (-0.4, 0.4):
        dark.append(box((0.015, 0.034, height - low - 0.3), (x * width, back - 0.008, low + 0.18)))
    dark += [box((width - 0.04, depth - 0.16, low - 0.02), (0, 0.02, 0.02))]
    dark += slats(width - 0.06, low - 0.03, (0, y + 0.09, 0.02), 4)
    dark += [disc(0.02, 0.03, (x * width * 0.4, y + 0.14, 0.0198), 10) for x in (-1, 1)]
    second = sampler.wood() if sampler.chance(0.5) else sampler.metal()
    return assemble(
        CATEGORY, (sampler.enamel(), casing + leaves), (second, trims), (rubber(sampler), dark)
    )


DESIGNS: dict[str, tuple[ModelFactory, ...]] = {
    CATEGORY: (
        retro,
        french_door,
        side_by_side,
        bottom_freezer,
        mini,
        american,
        noted,
        wide_steel,
        ajar,
        both_open,
        wine,
        drinks,
        panelled,
        top_freezer,
    )
}
