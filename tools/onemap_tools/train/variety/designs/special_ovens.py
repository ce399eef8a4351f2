"""Ovens of other kinds: in a column, with the door open."""

from __future__ import annotations

from onemap_simulator.generation.mesh import Mesh, box, lathe, rod, rounded_box, torus
from onemap_simulator.generation.model import Model, assemble
from onemap_simulator.generation.sampler import Sampler
from onemap_tools.train.variety.designs.appliance_parts import (
    centred,
    disc,
    grip,
    rubber,
    shell,
    tilted,
)
from onemap_tools.train.variety.designs.oven_parts import CATEGORY, DEPTH_M, FRONT_Y, TOP_M


def column(sampler: Sampler) -> Model:
    """One or two built-in ovens in a tall cabinet with a cupboard below and above."""
    width, y = sampler.size(0.58, 0.64), FRONT_Y
    low, count = sampler.uniform(0.06, 0.12), sampler.integer(1, 2)
    start = sampler.uniform(0.35, 0.75) if count == 1 else sampler.uniform(0.25, 0.45)
    tall = sampler.uniform(0.56, 0.6)
    end = start + (tall if count == 1 else tall + 0.44)
    height = end + sampler.uniform(0.08, 0.75 if count == 1 else 0.6)
    wood = [box((width, DEPTH_M - 0.03, height - low), (0, 0.015, low))]
    hands, steel, glass, knobs = [], [], [], []
    for bottom, top in ((low, start), (end, height)):
        if top - bottom > 0.12:
            wood.append(
                box((width - 0.008, 0.022, top - bottom - 0.01), (0, y + 0.017, bottom + 0.005))
            )
            z = top - 0.05 if bottom < 0.2 else bottom + 0.05
            hands += grip(sampler, width * 0.4, (0, y + 0.006, z), False)
    for index in range(count):
        z, deep = (start, tall) if index == 0 else (start + tall, 0.44)
        band = sampler.uniform(0.08, 0.11)
        steel.append(box((width - 0.014, 0.03, band), (0, y - 0.002, z + deep - band - 0.004)))
        glass.append(
            rounded_box(
                (width - 0.014, 0.04, deep - band - 0.012), (0, y - 0.008, z + 0.004), 0.006
            )
        )
        h = deep - band
        steel.append(box((width * 0.68, 0.012, h * 0.5), (0, y - 0.026, z + h * 0.2)))
        at = z + deep - band / 2 - 0.004
        hands += grip(sampler, width * 0.8, (0, y - 0.028, z + h - 0.06), False)
        if sampler.chance(0.75):
            knobs += [disc(0.022, 0.03, (x * width * 0.34, y - 0.015, at), 12) for x in (-1, 1)]
        glass.append(box((width * 0.3, 0.012, band * 0.5), (0, y - 0.018, at - band * 0.25)))
    plinth = box((width, DEPTH_M - 0.08, low), (0, 0.03, 0))
    return assemble(
        CATEGORY,
        (sampler.wood(), wood),
        (sampler.enamel(), steel),
        (sampler.dark(), glass),
        (sampler.metal(), hands),
        (sampler.metal(), knobs),
        (rubber(sampler), [plinth]),
    )


def _wire_shelves(inside: float, levels: list[float], pulled: float) -> list[Mesh]:
    """Wire shelves across a cavity ``inside`` wide, the first of them shifted by ``pulled``."""
    wires: list[Mesh] = []
    for index, z in enumerate(levels):
        shift = pulled if index == 0 else 0.0
        for step in range(9):
            x = (step / 8 - 0.5) * (inside - 0.05)
            wires.append(
                rod((x, FRONT_Y + 0.06 + shift, z), (x, DEPTH_M / 2 - 0.09 + shift, z), 0.004, 5)
            )
        for end in (FRONT_Y + 0.06, DEPTH_M / 2 - 0.09):
            half = inside / 2 - 0.016
            wires.append(rod((-half, end + shift, z), (half, end + shift, z), 0.005, 5))
    return wires


def open_oven(sampler: Sampler) -> Model:
    """A cooker with its door folded down: a dark cavity, wire shelves, a baking tray."""
    width, y, low = sampler.size(0.54, 0.62), FRONT_Y, sampler.uniform(0.1, 0.25)
    face, wall = TOP_M - 0.14, 0.05
    casing = shell((-width / 2, y + 0.04, low), (width / 2, DEPTH_M / 2, face), wall)
    casing.append(box((width, DEPTH_M - 0.04, low - 0.02), (0, 0.02, 0.02)))
    casing.append(box((width, DEPTH_M - 0.02, TOP_M - face - 0.03), (0, 0.01, face)))
    inside = width - 2 * wall
    cavity = shell(
        (-inside / 2, y + 0.05, low + wall), (inside / 2, DEPTH_M / 2 - wall, face - wall), 0.012
    )
    levels = [low + wall + (face - low - 0.1) * share for share in (0.32, 0.62)]
    pulled = -0.18 if sampler.chance(0.5) else 0.0
    wires = _wire_shelves(inside, levels, pulled)
    tray = [rounded_box((inside * 0.8, 0.34, 0.05), (0, pulled, levels[0] + 0.006), 0.012)]
    food = [
        lathe(
            [(0.05, 0), (0.06, 0.03), (0.03, 0.06)], (x * 0.11, pulled + dy, levels[0] + 0.057), 10
        )
        for x in (-1, 0, 1)
        for dy in (-0.08, 0.08)
    ]
    tall = face - low - 0.008
    leaf = [rounded_box((width - 0.006, 0.04, tall), (0, y + 0.018, low), 0.01)]
    window = [box((width * 0.7, 0.05, tall * 0.55), (0, y + 0.018, low + tall * 0.15))]
    hand = grip(sampler, width * 0.8, (0, y - 0.002, low + tall - 0.06), False)
    angle = sampler.choice([88.0, 88.0, 70.0, 45.0, 25.0])
    leaf, window, hand = (
        tilted(part, angle, (y + 0.036, low + 0.002)) for part in (leaf, window, hand)
    )
    xs = [(step / 4 - 0.5) * width * 0.75 for step in range(5)]
    knobs = [disc(0.022, 0.03, (x, y + 0.012, face + 0.055), 12) for x in xs]
    plate = [box((width, DEPTH_M, 0.03), (0, 0.0, TOP_M - 0.03))]
    rings = [torus(0.08, 0.005, (x, z, TOP_M), 16) for x in (-0.13, 0.13) for z in (-0.13, 0.12)]
    foot = [box((width - 0.04, DEPTH_M - 0.1, 0.022), (0, 0.02, 0))]
    groups = [(sampler.plastic(), food)] if sampler.chance(0.6) else []
    return centred(
        assemble(
            CATEGORY,
            (sampler.enamel(), casing + leaf),
            (sampler.dark(), cavity + foot),
            (sampler.dark(), window),
            (sampler.metal(), wires + rings),
            (sampler.metal(), hand + knobs),
            (sampler.dark(), plate),
            (sampler.metal(), tray),
            *groups,
        )
    )
