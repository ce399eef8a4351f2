"""Chests of drawers built in ways of their own."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from onemap_shared.geometry import F64
from onemap_simulator.generation.mesh import Mesh, box, cone, cylinder, rounded_box
from onemap_simulator.generation.model import Model, assemble, support_surface
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.fronts import HANDLES, drawer, pulls, rows_of
from onemap_tools.train.variety.designs.woodwork import SIDES, centred, corners, lean, skin, turned


def tallboy(sampler: Sampler) -> Model:
    """A tall narrow chest of five to seven drawers with a cornice, on bun feet or a plinth."""
    width, depth = sampler.size(0.45, 0.75), sampler.size(0.38, 0.48)
    height, foot = sampler.size(1.05, 1.4), sampler.uniform(0.06, 0.12)
    kind, front = sampler.choice(HANDLES), -depth / 2
    body = [box((width, depth, height - foot - 0.04), (0, 0, foot))]
    body.append(box((width + 0.05, depth + 0.05, 0.022), (0, 0, height - 0.022)))
    body.append(box((width + 0.025, depth + 0.025, 0.022), (0, 0, height - 0.042)))
    if sampler.chance(0.5):
        body += [cone((0.025, 0.045), foot, (*at, 0)) for at in corners(width, depth, 0.06)]
    else:
        body.append(box((width + 0.02, depth + 0.02, foot + 0.02), (0, 0, 0)))
    fronts: list[Mesh] = []
    knobs: list[Mesh] = []
    pulled = sampler.integer(0, 6) if sampler.chance(0.3) else -1
    heights = rows_of(sampler, sampler.integer(5, 7), height - foot - 0.09)
    z = foot + 0.035
    for index, each in enumerate(heights):
        out = sampler.uniform(0.04, 0.08) if index == pulled else 0.0
        fronts += drawer((width - 0.05, each - 0.012), (0, front, z), out)
        knobs += pulls(kind, (0, front - 0.02 - out, z + each / 2), width, each)
        z += each
    surface = support_surface(width, depth, height)
    model = assemble(
        "dresser",
        (sampler.wood(), body),
        (sampler.wood(), fronts),
        (sampler.metal(), knobs),
        support_surfaces=(surface,),
    )
    return centred(model)


def _bulged(width: float, depth: float, z: float, swell: float, out: float) -> F64:
    """A level outline (N, 3): straight back, front bowed by ``swell`` and moved by ``out``."""
    x = np.linspace(-width / 2, width / 2, 11)
    y = -depth / 2 - out - swell * np.cos(np.pi * x / width)
    edge = np.column_stack([x, y])
    back = [(width / 2, depth / 2), (-width / 2, depth / 2)]
    flat = np.concatenate([edge, back])
    return np.column_stack([flat, np.full(len(flat), z)])


def bombe(sampler: Sampler) -> Model:
    """A baroque commode whose front and sides swell, on curved feet under a stone top."""
    width, depth, height = sampler.size(0.85, 1.3), sampler.size(0.42, 0.5), sampler.size(0.8, 0.95)
    foot, rows = sampler.uniform(0.1, 0.2), sampler.integer(2, 4)
    swell, belly = sampler.uniform(0.03, 0.1), sampler.uniform(0.02, 0.09)
    low, high = foot, height - 0.035

    def ring(z: float, out: float, narrow: float) -> F64:
        share = (z - low) / (high - low)
        round_out = belly * float(np.sin(np.pi * min(max(share * 0.85 + 0.15, 0), 1)))
        return _bulged(width - narrow + 1.4 * round_out, depth, z, swell, out + round_out)

    levels = np.linspace(low, high, 9)
    body = [skin(np.stack([ring(float(z), 0.0, 0.0) for z in levels]))]
    marble = np.stack(
        [_bulged(width + 0.06, depth, z, swell + belly, 0.02) for z in (high, height)]
    )
    fronts: list[Mesh] = []
    knobs: list[Mesh] = []
    edges = np.linspace(low + 0.03, high - 0.02, rows + 1)
    kind = sampler.choice(["ring", "knob", "bow"])
    for bottom, top in pairwise(edges.tolist()):
        slices = np.linspace(bottom + 0.008, top - 0.008, 4)
        fronts.append(skin(np.stack([ring(float(z), 0.014, 0.1) for z in slices])))
        middle = float(bottom + top) / 2
        y = float(ring(middle, 0.014, 0.1)[:, 1].min())
        lift = swell * (1 - float(np.cos(np.pi * 0.25)))
        knobs += pulls(kind, (0, y + lift, middle), width, 0.2)
    legs = [
        lean(cone((0.02, 0.045), foot + 0.02), -0.03 * np.sign(x), -0.02 * np.sign(y)).translated(
            x, y
        )
        for x, y in corners(width, depth, 0.03)
    ]
    surface = support_surface(width, depth, height)
    model = assemble(
        "dresser",
        (sampler.wood(), [*body, *legs]),
        (sampler.wood(), fronts),
        (sampler.ceramic(), [skin(marble)]),
        (sampler.metal(), knobs),
        support_surfaces=(surface,),
    )
    return centred(model)


def flat_pack(sampler: Sampler) -> Model:
    """A plain box of drawers without handles: shadow gaps or a slanted lip, no feet."""
    columns, rows = sampler.choice([1, 2, 2, 3]), sampler.integer(3, 6)
    width = columns * sampler.size(0.4, 0.8 if columns < 3 else 0.5) + 0.04
    depth, height = sampler.size(0.4, 0.5), rows * sampler.uniform(0.17, 0.22) + 0.1
    front, plinth = -depth / 2, sampler.choice([0.0, 0.05])
    body = [box((width, depth - 0.03, height - plinth - 0.02), (0, 0.015, plinth))]
    body.append(box((width + 0.004, depth, 0.022), (0, 0, height - 0.022)))
    body += [box((0.02, depth, height - 0.02), (s * (width / 2 - 0.009), 0, 0)) for s in SIDES]
    if plinth:
        body.append(box((width - 0.06, depth - 0.1, plinth), (0, 0.03, 0)))
    fronts: list[Mesh] = []
    each_w, each_h = (width - 0.045) / columns, (height - plinth - 0.03) / rows
    gap, uneven = sampler.uniform(0.008, 0.03), sampler.chance(0.3)
    open_one = sampler.integer(0, rows * columns - 1) if sampler.chance(0.4) else -1
    for column in range(columns):
        for row in range(rows):
            x, z = (column - (columns - 1) / 2) * each_w, plinth + row * each_h
            out = sampler.uniform(0.05, 0.09) if row * columns + column == open_one else 0.0
            parts = 2 if uneven and row == rows - 1 and columns == 1 else 1
            for half in range(parts):
                dx = (half - (parts - 1) / 2) * each_w / parts
                size = (each_w / parts - 0.008, each_h - gap)
                fronts += drawer(size, (x + dx, front + 0.02, z + 0.004), out)
    surface = support_surface(width, depth, height)
    model = assemble(
        "dresser",
        (sampler.enamel(), body),
        (sampler.pale() if sampler.chance(0.5) else sampler.wood(), fronts),
        support_surfaces=(surface,),
    )
    return centred(model)


def cottage(sampler: Sampler) -> Model:
    """A country chest on turned feet: a shaped apron, a backboard, two small drawers on top."""
    width, depth, height = sampler.size(0.75, 1.1), sampler.size(0.42, 0.5), sampler.size(0.75, 1.0)
    foot, rows, front = sampler.uniform(0.1, 0.2), sampler.integer(2, 3), -depth / 2
    body = [box((width, depth, height - foot - 0.03), (0, 0, foot))]
    body.append(rounded_box((width + 0.06, depth + 0.05, 0.032), (0, 0, height - 0.032), 0.012))
    body += [
        cylinder(0.024, height - foot - 0.1, (s * width / 2, front, foot + 0.03)) for s in SIDES
    ]
    apron = np.linspace(-1, 1, 9)
    body += [
        box(
            (width / 9 + 0.002, 0.02, 0.02 + 0.05 * float(a * a)),
            (float(a) * width * 4 / 9, front + 0.012, foot - 0.018 - 0.05 * float(a * a)),
        )
        for a in apron
    ]
    shaft = turned(sampler, 0.032, foot + 0.01)
    body += [shaft.translated(*at) for at in corners(width, depth, 0.04)]
    if sampler.chance(0.5):
        body.append(
            box((width, 0.02, sampler.uniform(0.08, 0.16)), (0, depth / 2 - 0.01, height - 0.002))
        )
    fronts: list[Mesh] = []
    knobs: list[Mesh] = []
    kind, pair = sampler.choice(["knob", "cup", "ring", "bow"]), 0.15
    heights = [*rows_of(sampler, rows, height - foot - 0.07 - pair), pair]
    z = foot + 0.02
    for each in heights:
        count = 2 if each == pair else 1
        for index in range(count):
            x, wide = (
                (index - (count - 1) / 2) * width * 0.46,
                width * (0.44 if count == 2 else 0.9),
            )
            fronts += drawer((wide, each - 0.02), (x, front, z))
            knobs += pulls(kind, (x, front - 0.02, z + each / 2), wide, each)
        z += each
    surface = support_surface(width, depth * 0.9, height)
    return assemble(
        "dresser",
        (sampler.wood(), body),
        (sampler.wood(), fronts),
        (sampler.metal() if sampler.chance(0.5) else sampler.ceramic(), knobs),
        support_surfaces=(surface,),
    )


def campaign(sampler: Sampler) -> Model:
    """A strongbox-like chest with metal corners and straps, sunk handles, small feet."""
    width, depth, height = (
        sampler.size(0.75, 1.15),
        sampler.size(0.42, 0.5),
        sampler.size(0.76, 1.05),
    )
    foot, rows, front = sampler.uniform(0.04, 0.09), sampler.integer(3, 4), -depth / 2
    body = [box((width, depth, height - foot), (0, 0, foot))]
    feet = [cone((0.022, 0.036), foot, (*at, 0)) for at in corners(width, depth, 0.06)]
    fronts: list[Mesh] = []
    metal: list[Mesh] = []
    heights = rows_of(sampler, rows, height - foot - 0.05)
    split, z = sampler.chance(0.5), foot + 0.025
    for index, each in enumerate(heights):
        count = 2 if split and index == rows - 1 else 1
        wide = (width - 0.06) / count
        for place in range(count):
            x = (place - (count - 1) / 2) * wide
            fronts += drawer((wide - 0.012, each - 0.012), (x, front, z))
            metal += pulls("ring", (x, front - 0.02, z + each / 2), wide, each)
            metal.append(box((0.09, 0.008, 0.05), (x, front - 0.02, z + each * 0.5 - 0.025)))
        z += each
    for x, y in corners(width, depth, 0.02):
        for low in (foot - 0.004, height - 0.05):
            metal.append(box((0.05, 0.05, 0.054), (x + 0.0, y, low)))
    surface = support_surface(width, depth, height + 0.004, 0.07)
    return assemble(
        "dresser",
        (sampler.wood(), [*body, *feet]),
        (sampler.wood(), fronts),
        (sampler.metal(), metal),
        support_surfaces=(surface,),
    )


DESIGNS: dict[str, tuple[ModelFactory, ...]] = {
    "dresser": (
        tallboy,
        bombe,
        flat_pack,
        cottage,
        campaign,
    )
}
