"""Refrigerators that show their inside: with open doors, or doors of glass."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import box, lathe, rounded_box
from onemap_simulator.generation.model import Model, assemble
from onemap_simulator.generation.sampler import Sampler
from onemap_tools.train.variety.designs.appliance_parts import (
    centred,
    feet,
    grip,
    provisions,
    rubber,
    shell,
    slats,
    turned,
)
from onemap_tools.train.variety.designs.refrigerator_parts import (
    CATEGORY,
    Group,
    door_frame,
    stocked_shelves,
)


def _racks(sampler: Sampler, width: float, y: float, span: tuple[float, float]) -> list[Group]:
    """Trays on the inside of a closed door, whose inner face is at y, with bottles in them."""
    low, high = span
    trays, bottles = [], []
    for z in np.linspace(low + 0.05, high - 0.25, max(2, int((high - low) / 0.32))):
        trays += [
            box((width - 0.09, 0.09, 0.01), (0, y + 0.05, float(z))),
            box((width - 0.09, 0.01, 0.07), (0, y + 0.095, float(z))),
        ]
        if sampler.chance(0.8):
            at = (0.0, y + 0.05, float(z) + 0.012)
            bottles += provisions(sampler, width - 0.12, 0.05, 0.22, at)
    return (
        [(sampler.pale(), trays), (sampler.plastic(), bottles)]
        if bottles
        else [(sampler.pale(), trays)]
    )


def ajar(sampler: Sampler) -> Model:
    """A refrigerator with its door open: lit shelves, drawers, food, bottles in the door."""
    width, depth = sampler.size(0.54, 0.68), sampler.size(0.54, 0.64)
    height, low = sampler.size(0.8, 1.85), 0.07
    y, side, door = -depth / 2, sampler.choice([-1, 1]), 0.055
    split = low + (height - low) * sampler.uniform(0.28, 0.4) if height > 1.3 else low
    paint, inner = sampler.enamel(), sampler.pale()
    casing = shell((-width / 2, y, split), (width / 2, depth / 2, height), 0.02)
    inside, back = width / 2 - 0.022, depth / 2 - 0.022
    lining = shell((-inside, y + 0.006, split + 0.022), (inside, back, height - 0.022), 0.022)
    span = (split + 0.05, height - 0.05)
    shelves, groups = stocked_shelves(sampler, width - 0.092, depth - 0.16, span)
    leaf = [rounded_box((width, door, height - split - 0.006), (0, y - door / 2, split), 0.012)]
    seal = box((width - 0.05, 0.014, height - split - 0.05), (0, y + 0.005, split + 0.025))
    hand = grip(
        sampler,
        min(0.4, height * 0.3),
        (side * (width / 2 - 0.05), y - door, (split + height) / 2),
        True,
    )
    racks = _racks(sampler, width, y + 0.012, (split, height))
    angle, pivot = side * sampler.uniform(28, 95), (-side * width / 2, y)
    # The side away from the handle is the hinge; the handle's edge swings to the front.
    swing = [turned(meshes, -angle, pivot) for meshes in (leaf, [seal], hand)]
    groups += [(material, turned(meshes, -angle, pivot)) for material, meshes in racks]
    if split > low:
        casing.append(box((width, depth, split - low), (0, 0, low)))
        casing.append(rounded_box((width, door, split - low - 0.01), (0, y - door / 2, low), 0.012))
        at = (side * (width / 2 - 0.05), y - door, split - 0.2)
        swing[2] += grip(sampler, min(0.3, (split - low) * 0.6), at, True)
    dark = [
        *feet(width, depth, low + 0.002),
        box((width - 0.04, depth - 0.08, low - 0.01), (0, 0, 0.008)),
    ]
    return centred(
        assemble(
            CATEGORY,
            (paint, casing + swing[0]),
            (inner, lining + shelves),
            (rubber(sampler), dark + swing[1]),
            (sampler.metal(), swing[2]),
            *groups,
        )
    )


def both_open(sampler: Sampler) -> Model:
    """A wide one with both upper doors open over freezer drawers."""
    width, depth = sampler.size(0.7, 0.88), sampler.size(0.56, 0.66)
    height, low, y = sampler.size(1.6, 1.85), 0.07, -depth / 2
    split = low + (height - low) * sampler.uniform(0.28, 0.42)
    casing = shell((-width / 2, y, split), (width / 2, depth / 2, height), 0.035)
    shelves, groups = stocked_shelves(
        sampler, width - 0.075, depth - 0.14, (split + 0.04, height - 0.04)
    )
    casing.append(box((width, depth, split - low - 0.002), (0, 0, low)))
    each, door = width / 2 - 0.003, 0.06
    leaves, handles, seals = [], [], []
    for side in (-1, 1):
        angle = sampler.uniform(20 if side == 1 else 60, 95)
        x, pivot = side * width / 4, (side * width / 2, y)
        leaf = rounded_box((each, door, height - split), (x, y - door / 2, split), 0.012)
        hand = grip(sampler, 0.5, (side * 0.045, y - door, (split + height) / 2), True)
        racks = _racks(sampler, each, y + 0.012, (split, height))
        seal = box((each - 0.04, 0.014, height - split - 0.05), (x, y + 0.005, split + 0.025))
        leaves += turned([leaf], side * angle, pivot)
        handles += turned(hand, side * angle, pivot)
        seals += turned([seal], side * angle, pivot)
        for material, meshes in racks:
            moved = [mesh.translated(x, 0) for mesh in meshes]
            groups.append((material, turned(moved, side * angle, pivot)))
    count = sampler.integer(1, 2)
    for row in range(count):
        tall = (split - low) / count
        z = low + row * tall
        leaves.append(rounded_box((width, door, tall - 0.01), (0, y - door / 2, z), 0.012))
        handles += grip(sampler, width * 0.7, (0, y - door, z + tall - 0.07), False)
    dark = [
        *feet(width, depth, low + 0.002),
        *slats(width - 0.04, low - 0.02, (0, y + 0.03, 0.01), 4),
    ]
    return centred(
        assemble(
            CATEGORY,
            (sampler.enamel(), leaves + casing),
            (sampler.pale(), shelves),
            (rubber(sampler), dark + seals),
            (sampler.metal(), handles),
            *groups,
        )
    )


def wine(sampler: Sampler) -> Model:
    """A wine refrigerator: a framed glass door before racks of lying bottles."""
    width, depth = sampler.size(0.4, 0.62), sampler.size(0.52, 0.62)
    height, low, y = sampler.size(0.8, 1.75), 0.08, -depth / 2
    rail = sampler.uniform(0.04, 0.07)
    casing = shell((-width / 2, y + 0.045, low), (width / 2, depth / 2, height), 0.03)
    frame = door_frame(width, height - low, (0, y, low), rail)
    racks, bottles = [], []
    count, radius = max(2, int((width - 0.1) / 0.092)), 0.037
    profile = [(radius, 0.0), (radius, 0.19), (0.014, 0.25), (0.014, 0.31)]
    lying = lathe(profile, segments=7).rotated("x", 90)
    for z in np.arange(low + rail, height - rail - 0.09, sampler.uniform(0.112, 0.15)):
        racks.append(box((width - 0.062, 0.018, 0.022), (0, y + 0.075, float(z))))
        racks.append(box((width - 0.062, 0.018, 0.022), (0, depth / 2 - 0.12, float(z))))
        for x in np.linspace(-1, 1, count) * (width / 2 - 0.035 - 0.05):
            if sampler.chance(0.85):
                turn = (
                    lying if sampler.chance(0.7) else lying.rotated("z", 180).translated(0, -0.31)
                )
                bottles.append(
                    turned([turn], 0, (0, 0))[0].translated(float(x), y + 0.4, float(z) + 0.06)
                )
    side = sampler.choice([-1, 1])
    hand = grip(
        sampler,
        (height - low) * sampler.uniform(0.3, 0.85),
        (side * (width / 2 - rail / 2), y, (height + low) / 2),
        True,
    )
    dark = [box((width - 0.03, depth - 0.1, low), (0, 0.04, 0))]
    dark += slats(width - 0.06, low - 0.02, (0, y + 0.08, 0.01), 4)
    wood = sampler.wood() if sampler.chance(0.6) else sampler.metal()
    return assemble(
        CATEGORY,
        (sampler.enamel(), frame),
        (sampler.enamel(), casing),
        (wood, racks),
        (sampler.dark(), bottles),
        (rubber(sampler), dark),
        (sampler.metal(), hand),
    )


def drinks(sampler: Sampler) -> Model:
    """A shop's bottle cooler: one or two glass doors, a header above, rows of drinks."""
    count = sampler.integer(1, 2)
    width, depth = sampler.size(0.5, 0.6) * (1 + 0.6 * (count - 1)), sampler.size(0.52, 0.66)
    height, y = sampler.size(1.5, 1.95), -depth / 2
    low, header = sampler.uniform(0.14, 0.3), sampler.uniform(0.12, 0.26)
    top = height - header
    casing = shell((-width / 2, y + 0.045, low), (width / 2, depth / 2, top), 0.03)
    casing.append(box((width, depth - 0.045, low - 0.04), (0, 0.0225, 0.04)))
    sign = [rounded_box((width, depth, header), (0, 0, top), 0.03)]
    shelves, groups = stocked_shelves(
        sampler, width - 0.07, depth - 0.16, (low + 0.035, top - 0.03)
    )
    frames, hands = [], []
    for index in range(count):
        x = (index - (count - 1) / 2) * width / count
        frames += door_frame(width / count - 0.006, top - low - 0.008, (x, y, low), 0.05)
        side = 1 if index == 0 else -1
        hands += grip(
            sampler, 0.4, (x + side * (width / count / 2 - 0.03), y, (low + top) / 2), True
        )
    dark = slats(width * 0.8, low - 0.08, (0, y + 0.04, 0.06), sampler.integer(4, 7))
    dark += feet(width, depth, 0.045)
    return assemble(
        CATEGORY,
        (sampler.enamel(), casing + frames),
        (sampler.plastic(), sign),
        (sampler.pale(), shelves),
        (rubber(sampler), dark),
        (sampler.metal(), hands),
        *groups,
    )
