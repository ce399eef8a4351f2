"""Standing racks and corner shelves, empty."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from onemap_simulator.generation.mesh import Mesh, box, cylinder, prism, rod, rounded_box
from onemap_simulator.generation.model import Model, SupportSurface, assemble, support_surface
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.joinery import Outline, settled, upright_board

NAME = "shelf"


def _surfaces(width: float, depth: float, levels: list[float]) -> tuple[SupportSurface, ...]:
    return tuple(support_surface(width, depth, z, 0.03) for z in levels)


def angle_rack(sampler: Sampler) -> Model:
    """A utility rack: slotted angle posts with pressed trays, some braced at the back."""
    width, depth = sampler.size(0.6, 1.2), sampler.size(0.3, 0.45)
    height, count = sampler.size(0.9, 1.9), sampler.integer(3, 5)
    x, y = width / 2, depth / 2
    zs = np.linspace(sampler.uniform(0.06, 0.15), height - 0.04, count).tolist()
    posts: list[Mesh] = []
    decks: list[Mesh] = []
    for sx in (-1, 1):
        for sy in (-1, 1):
            posts.append(box((0.035, 0.003, height), (sx * (x - 0.0175), sy * (y - 0.0015), 0)))
            posts.append(box((0.003, 0.032, height), (sx * (x - 0.0015), sy * (y - 0.02), 0)))
    for z in zs:
        decks.append(box((width - 0.012, depth - 0.012, 0.006), (0, 0, z + 0.026)))
        decks += [box((width - 0.012, 0.004, 0.03), (0, s * (y - 0.009), z)) for s in (-1, 1)]
        decks += [box((0.004, depth - 0.03, 0.03), (s * (x - 0.009), 0, z)) for s in (-1, 1)]
    if sampler.chance(0.5):
        for s in (-1, 1):
            low, high = (-s * (x - 0.02), y - 0.006, 0.1), (s * (x - 0.02), y - 0.006, height - 0.1)
            posts.append(rod(low, high, 0.004, 5))
    return assemble(
        NAME,
        (sampler.metal(), posts),
        (sampler.metal() if sampler.chance(0.5) else sampler.wood(), decks),
        support_surfaces=_surfaces(width - 0.06, depth, [z + 0.032 for z in zs]),
    )


def wire_rack(sampler: Sampler) -> Model:
    """A rack of round posts with decks of wire on rims of two rods."""
    width, depth = sampler.size(0.5, 1.1), sampler.size(0.3, 0.45)
    height, count = sampler.size(0.8, 1.8), sampler.integer(3, 5)
    x, y = width / 2 - 0.015, depth / 2 - 0.015
    corners = [(sx * x, sy * y) for sx in (-1, 1) for sy in (-1, 1)]
    posts = [cylinder(0.013, height - 0.03, (*at, 0.03), 8) for at in corners]
    feet = [cylinder(0.018, 0.032, (*at, 0), 8) for at in corners]
    if sampler.chance(0.3):
        wheel = cylinder(0.03, 0.02, segments=10).rotated("x", 90).translated(0, 0.01, 0.03)
        feet = [wheel.translated(*at) for at in corners]
    decks: list[Mesh] = []
    bars = np.linspace(-x + 0.025, x - 0.025, int(width / 0.035)).tolist()
    zs = np.linspace(sampler.uniform(0.08, 0.16), height - 0.05, count).tolist()
    for z in zs:
        for dz in (0.0, 0.03):
            for s in (-1, 1):
                decks.append(rod((s * x, -y, z + dz), (s * x, y, z + dz), 0.004, 5))
                decks.append(rod((-x, s * y, z + dz), (x, s * y, z + dz), 0.004, 5))
        decks += [box((0.005, depth - 0.03, 0.004), (at, 0, z + 0.031)) for at in bars]
    metal = sampler.metal()
    return assemble(
        NAME,
        (metal, posts),
        (metal if sampler.chance(0.5) else sampler.metal(), decks),
        (sampler.dark(), feet),
        support_surfaces=_surfaces(width - 0.06, depth, [z + 0.035 for z in zs]),
    )


def corner_shelf(sampler: Sampler) -> Model:
    """Quarter-round or chamfered boards in a corner, hung on two walls or on posts."""
    side, t = sampler.size(0.26, 0.45), sampler.uniform(0.012, 0.028)
    count, gap = sampler.integer(2, 5), sampler.uniform(0.22, 0.34)
    h, cut = side / 2, sampler.integer(0, 2)
    turn = np.linspace(np.pi, 1.5 * np.pi, 9)
    arc: Outline = [(h + side * float(np.cos(a)), h + side * float(np.sin(a))) for a in turn]
    if cut == 1:
        arc = [(-h, h), (-h, h * 0.3), (h * 0.3, -h), (h, -h)]
    elif cut == 2:
        arc = [(-h, h), (-h * 0.2, 0.0), (0.0, -h * 0.2), (h, -h)]
    plan: Outline = [(h, h), *arc]
    zs = [k * gap for k in range(count)]
    standing = sampler.chance(0.4)
    low = 0.08 if standing else 0.0
    boards = [prism(plan, t, (0, 0, z + low)) for z in zs]
    tall = zs[-1] + low + t
    if standing:
        frame = [
            box((0.025, 0.025, tall + 0.02), (px, py, 0))
            for px, py in ((h - 0.01, h - 0.01), (-h + 0.01, h - 0.01), (h - 0.01, -h + 0.01))
        ]
    else:
        frame = [box((side, 0.012, tall * 0.98), (0, h + 0.005, 0.002))]
        frame += [box((0.012, side, tall * 0.98), (h + 0.005, 0, 0.002))]
        if sampler.chance(0.4):
            frame = [rod((h - 0.02, h - 0.02, 0), (h - 0.02, h - 0.02, tall), 0.015)]
    tops = tuple(SupportSurface(0.0, 0.0, h - 0.03, h - 0.03, z + low + t) for z in zs)
    wood = sampler.wood()
    frame_material = wood if sampler.chance(0.4) else sampler.metal()
    return assemble(NAME, (wood, boards), (frame_material, frame), support_surfaces=tops)


def etagere(sampler: Sampler) -> Model:
    """A light rack of slender bars with plates of glass or board, some with hoops or crosses."""
    width, depth = sampler.size(0.45, 0.9), sampler.size(0.26, 0.36)
    height, count, r = sampler.size(0.8, 1.6), sampler.integer(3, 5), sampler.uniform(0.007, 0.013)
    x, y = width / 2 - r, depth / 2 - r
    zs = np.linspace(sampler.uniform(0.06, 0.2), height - 0.03, count).tolist()
    frame = [
        rod((sx * x, sy * y, 0), (sx * x, sy * y, height), r, 6) for sx in (-1, 1) for sy in (-1, 1)
    ]
    for z in zs:
        frame += [rod((-x, s * y, z), (x, s * y, z), r * 0.8, 6) for s in (-1, 1)]
        frame += [rod((s * x, -y, z), (s * x, y, z), r * 0.8, 6) for s in (-1, 1)]
    plates = [box((width - 2 * r, depth - 2 * r, 0.012), (0, 0, z + r * 0.5)) for z in zs]
    if sampler.chance(0.6):
        for low, high in pairwise(zs):
            for s in (-1, 1):
                frame.append(rod((s * x, -y, low), (s * x, y, high), r * 0.5, 5))
                frame.append(rod((s * x, y, low), (s * x, -y, high), r * 0.5, 5))
    plate = sampler.pale() if sampler.chance(0.5) else sampler.wood()
    return assemble(
        NAME,
        (sampler.metal(), frame),
        (plate, plates),
        support_surfaces=_surfaces(width - 0.03, depth, [z + r * 0.5 + 0.012 for z in zs]),
    )


def side_boards(sampler: Sampler) -> Model:
    """Boards between two shaped or slatted side panels, without a back, low or waist high."""
    width, depth = sampler.size(0.5, 1.1), sampler.size(0.26, 0.38)
    height, count, t = sampler.size(0.6, 1.35), sampler.integer(2, 4), sampler.uniform(0.016, 0.03)
    zs = np.linspace(
        sampler.uniform(0.05, 0.14), height - sampler.uniform(0.03, 0.2), count
    ).tolist()
    h, kind = depth / 2, sampler.integer(0, 2)
    sides: list[Mesh] = []
    for s in (-1, 1):
        at = s * (width - t) / 2
        if kind == 0:
            shape: Outline = [
                (-h, 0.0),
                (h, 0.0),
                (h, height),
                (-h * 0.2, height),
                (-h, height * 0.75),
            ]
            panel = upright_board(shape, t, t / 2).rotated("z", 90)
            sides.append(panel.translated(at, 0))
        elif kind == 1:
            sides += [box((t, 0.04, height), (at, side * (h - 0.02), 0)) for side in (-1, 1)]
            for z in np.linspace(0.1, height - 0.05, 5).tolist():
                sides.append(box((t * 0.7, depth - 0.08, 0.03), (at, 0, z)))
        else:
            sides += [
                rod((at, -h + 0.02, 0.0), (at, 0.0, height), 0.0001 + t * 0.5) for _ in range(1)
            ]
            sides += [rod((at, h - 0.02, 0.0), (at, 0.0, height), 0.0001 + t * 0.5)]
    deeps = [depth * (1.0 if kind < 2 else 1.0 - 0.55 * z / height) for z in zs]
    boards = [
        rounded_box(
            (width - 2 * t - 0.002 if kind < 2 else width, deep - 0.004, t), (0, 0, z), 0.004
        )
        for z, deep in zip(zs, deeps, strict=True)
    ]
    wood = sampler.wood()
    tops = tuple(
        support_surface(width - 0.06, deep, z + t, 0.02) for z, deep in zip(zs, deeps, strict=True)
    )
    side = wood if sampler.chance(0.5) else sampler.wood()
    return settled(assemble(NAME, (wood, boards), (side, sides), support_surfaces=tops))


RACKS: tuple[ModelFactory, ...] = (angle_rack, wire_rack, corner_shelf, etagere, side_boards)
