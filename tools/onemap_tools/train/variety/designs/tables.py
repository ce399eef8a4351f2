"""Dining tables on four legs and trestles, built in ways of their own."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import (
    Mesh,
    box,
    cylinder,
    prism,
    rod,
)
from onemap_simulator.generation.model import Model, assemble, support_surface
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.woodwork import (
    SIDES,
    centred,
    corners,
    frame,
    oval,
    skin,
    slab,
    stretch,
    turned,
)


def trestle(sampler: Sampler) -> Model:
    """A long plank table on two A, X or post-and-foot trestles joined by a beam."""
    width, depth, height = sampler.size(1.2, 2.0), sampler.size(0.7, 0.95), sampler.size(0.71, 0.78)
    thick, kind = sampler.uniform(0.025, 0.07), sampler.choice(["A", "X", "post"])
    below, at = height - thick, width / 2 - width * sampler.uniform(0.1, 0.2)
    bar, stout = sampler.uniform(0.04, 0.08), sampler.uniform(0.05, 0.09)
    meshes: list[Mesh] = []
    for side in SIDES:
        x, foot = side * at, depth / 2 - 0.06
        meshes.append(box((stout + 0.02, depth * 0.85, 0.06), (x, 0, below - 0.06)))
        if kind == "post":
            gap = sampler.choice([0.0, depth * 0.22])
            meshes.append(box((stout + 0.02, depth * 0.85, 0.07), (x, 0, 0)))
            for y in {-gap, gap}:
                meshes.append(box((stout, bar * 1.6, below - 0.03), (x, y, 0.01)))
            continue
        for end in SIDES:
            to = (x, end * 0.07) if kind == "A" else (x, -end * foot * 0.85)
            section = (stout + 0.004 * end, bar)
            meshes.append(stretch(section, (x, end * foot, 0), to, below - 0.02))
        if kind == "A":
            meshes.append(box((stout - 0.015, foot * 1.35, 0.06), (x, 0, below * 0.3)))
    beam_z = below * (0.3 if kind != "X" else 0.46)
    meshes.append(box((2 * at + sampler.choice([0.0, 0.22]), 0.035, 0.09), (0, 0, beam_z)))
    planks = sampler.integer(1, 5)
    each = depth / planks
    top = [
        box((width, each - 0.004, thick), (0, (i - (planks - 1) / 2) * each, below))
        for i in range(planks)
    ]
    surface = support_surface(width, depth, height)
    return assemble(
        "table", (sampler.wood(), top), (frame(sampler), meshes), support_surfaces=(surface,)
    )


def farmhouse(sampler: Sampler) -> Model:
    """A kitchen table with turned legs, an apron, perhaps a drawer and breadboard ends."""
    width, depth, height = sampler.size(1.0, 1.8), sampler.size(0.7, 0.95), sampler.size(0.72, 0.79)
    thick, apron, stout = (
        sampler.uniform(0.025, 0.05),
        sampler.uniform(0.09, 0.15),
        sampler.uniform(0.04, 0.065),
    )
    below, inset = height - thick, sampler.uniform(0.06, 0.12)
    ends = sampler.choice([0.0, 0.1])
    top = [box((width - 2 * ends, depth, thick), (0, 0, below))]
    if ends:
        top += [
            box((ends - 0.004, depth + 0.006, thick + 0.003), (s * (width - ends) / 2, 0, below))
            for s in SIDES
        ]
    shaft = turned(sampler, stout, below - apron - 0.03)
    legs: list[Mesh] = []
    for x, y in corners(width, depth, inset):
        legs += [
            shaft.translated(x, y),
            box((stout * 2, stout * 2, apron + 0.03), (x, y, below - apron - 0.03)),
        ]
    span, deep = width - 2 * inset, depth - 2 * inset
    legs += [box((span, 0.025, apron), (0, s * deep / 2, below - apron)) for s in SIDES]
    legs += [box((0.025, deep, apron), (s * span / 2, 0, below - apron)) for s in SIDES]
    knobs: list[Mesh] = []
    if sampler.chance(0.5):
        front = -deep / 2 - 0.016
        legs.append(box((span * 0.4, 0.014, apron * 0.7), (0, front, below - apron * 0.85)))
        knobs = [cylinder(0.016, 0.03).rotated("x", 90).translated(0, front, below - apron * 0.5)]
    if sampler.chance(0.3):
        legs += [
            rod((s * span / 2, -deep / 2, 0.14), (s * span / 2, deep / 2, 0.14), 0.018)
            for s in SIDES
        ]
        legs.append(rod((-span / 2, 0, 0.14), (span / 2, 0, 0.14), 0.018))
    base = sampler.wood()
    surface = support_surface(width, depth, height)
    return assemble(
        "table",
        (sampler.wood(), top),
        (base, legs),
        (sampler.metal(), knobs),
        support_surfaces=(surface,),
    )


def live_edge(sampler: Sampler) -> Model:
    """A slab sawn from a trunk with its wavy bark edge, on U, X or V legs of flat steel."""
    width, depth, height = sampler.size(1.2, 2.0), sampler.size(0.7, 0.95), sampler.size(0.72, 0.77)
    thick, kind = sampler.uniform(0.045, 0.08), sampler.choice(["U", "X", "V", "block"])
    below, steel = height - thick, sampler.uniform(0.03, 0.08)
    xs = np.linspace(-width / 2, width / 2, 13)
    wave = [np.array([sampler.uniform(-0.045, 0.02) for _ in xs]) for _ in SIDES]
    outline = np.concatenate(
        [
            np.column_stack([xs, -depth / 2 - wave[0]]),
            np.column_stack([xs, depth / 2 + wave[1]])[::-1],
        ]
    )
    top = slab(outline, thick, below, sampler.uniform(0.0, 0.03))
    meshes: list[Mesh] = []
    reach, at = depth / 2 - 0.1, width / 2 - sampler.uniform(0.15, 0.3)
    for s in SIDES:
        x = s * at
        if kind == "U":
            meshes += [box((steel, 0.02, below), (x, e * reach, 0)) for e in SIDES]
            meshes += [box((steel, 2 * reach, 0.02), (x, 0, z)) for z in (0.0, below - 0.02)]
        elif kind == "block":
            meshes.append(box((steel, reach * 1.7, below), (x, 0, 0)))
        else:
            tip = -0.9 if kind == "X" else 0.1
            for e in SIDES:
                section = (steel + 0.004 * e, 0.035)
                low, high = (x, e * reach), (x, e * reach * tip)
                low, high = (high, low) if kind == "V" else (low, high)
                meshes.append(stretch(section, (*low, 0.0), high, below))
            meshes.append(box((steel + 0.02, reach * 2, 0.012), (x, 0, below - 0.013)))
    surface = support_surface(width, depth, height, 0.09)
    return assemble(
        "table", (sampler.wood(), [top]), (frame(sampler), meshes), support_surfaces=(surface,)
    )


def drop_leaf(sampler: Sampler) -> Model:
    """A gateleg table: a narrow middle, its leaves hanging down or one or both held up."""
    middle, depth, height = (
        sampler.size(0.3, 0.6),
        sampler.size(0.75, 1.0),
        sampler.size(0.71, 0.76),
    )
    leaf, thick = sampler.uniform(0.35, 0.5), sampler.uniform(0.02, 0.03)
    below, rounded, raised = height - thick, sampler.chance(0.5), sampler.choice([0, 1, 1, 2])
    top = [box((middle, depth, thick), (0, 0, below))]
    legs: list[Mesh] = [box((middle - 0.08, depth - 0.2, 0.1), (0, 0, below - 0.1))]
    stout = sampler.uniform(0.018, 0.028)
    shaft = (
        turned(sampler, stout * 1.3, below)
        if sampler.chance(0.5)
        else box((stout * 2, stout * 2, below))
    )
    legs += [shaft.translated(*at) for at in corners(middle - 0.1, depth - 0.22)]
    half = np.radians(np.linspace(-90, 90, 12))
    bulge = np.stack([np.cos(half) * leaf, np.sin(half) * depth / 2], axis=1)
    square = np.array([(0, -depth / 2), (leaf, -depth / 2), (leaf, depth / 2), (0, depth / 2)])
    for index, s in enumerate(SIDES):
        flap = prism(bulge if rounded else square, thick)
        flap = flap if s > 0 else flap.rotated("z", 180)
        edge = s * (middle / 2 + 0.003)
        if index < raised:
            top.append(flap.translated(edge, 0, below))
            out = edge + s * leaf * 0.6
            legs.append(shaft.translated(out, 0.03))
            legs += [
                rod((edge - s * 0.07, 0.03, z), (out, 0.03, z), 0.014) for z in (0.12, below - 0.06)
            ]
        else:
            top.append(flap.rotated("y", s * 90).translated(edge, 0, below + thick))
    surface = support_surface(middle, depth, height)
    groups = ((sampler.wood(), top), (frame(sampler), legs))
    return centred(assemble("table", *groups, support_surfaces=(surface,)))


def under_cloth(sampler: Sampler) -> Model:
    """A round, square or long table under a cloth that hangs down in folds."""
    long, height = sampler.chance(0.5), sampler.size(0.72, 0.77)
    depth = sampler.size(0.75, 1.05)
    width = depth * (sampler.uniform(1.3, 1.8) if long else 1.0)
    power = sampler.choice([2.0, 2.0, 9.0]) if not long else sampler.choice([2.4, 9.0])
    drop, count = sampler.uniform(0.15, 0.58), 48
    folds, deep = sampler.integer(8, 16), sampler.uniform(0.01, 0.035)
    flat = oval(width, depth, power, count)
    wave = np.cos(np.linspace(0, 2 * np.pi, count, endpoint=False) * folds)
    rings = []
    for share in (1.0, 0.6, 0.25, 0.02, 0.0):
        spread = 1.0 + share * (0.05 + deep * wave / 0.5) + 0.01
        ring = flat * (spread if share > 0.01 else np.full(count, 0.995))[:, None]
        rings.append(np.column_stack([ring, np.full(count, height - share * drop)]))
    cloth = [skin(np.stack(rings))]
    runner: list[Mesh] = []
    if sampler.chance(0.4) and long:
        runner = [box((width * 0.75, depth * 0.35, 0.006), (0, 0, height - 0.001))]
    stout, hidden = sampler.uniform(0.025, 0.04), height - 0.03
    legs: list[Mesh] = []
    if long or sampler.chance(0.5):
        shaft = sampler.choice(
            [turned(sampler, stout, hidden), box((stout * 2, stout * 2, hidden))]
        )
        legs = [shaft.translated(*at) for at in corners(width * 0.7, depth * 0.7)]
    else:
        legs = [cylinder(0.05, hidden), slab(oval(depth * 0.6, depth * 0.6), 0.04, 0.0)]
    surface = support_surface(width * 0.72, depth * 0.72, height)
    return assemble(
        "table",
        (sampler.fabric(), cloth),
        (sampler.fabric(), runner),
        (frame(sampler), legs),
        support_surfaces=(surface,),
    )


DESIGNS: dict[str, tuple[ModelFactory, ...]] = {
    "table": (
        trestle,
        farmhouse,
        live_edge,
        drop_leaf,
        under_cloth,
    )
}
