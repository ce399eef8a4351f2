"""Bookcases with a base cupboard, with glass doors, with an arch; low and narrow ones."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from onemap_simulator.generation.mesh import Mesh, box, rounded_box
from onemap_simulator.generation.model import Model, assemble
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.book_rows import Contents, contents
from onemap_tools.train.variety.designs.joinery import (
    LEAF_M,
    case,
    feet,
    grip,
    panelled,
    shifted,
    upright_board,
)

NAME = "bookcase"
Size = tuple[float, float, float]


def bays(inside: Contents, size: Size, z: float, columns: int, levels: int) -> list[Mesh]:
    """Boards and partitions of an open case of this outer size at z, filled with books."""
    width, depth, height = size
    t = 0.022
    meshes: list[Mesh] = []
    wide, gap = (width - t) / columns, (height - t) / levels
    for column in range(columns):
        x = (column + 0.5 - columns / 2) * wide
        if column:
            meshes.append(box((t, depth - 0.006, height - 2 * t), (x - wide / 2, 0, z + t)))
        for level in range(levels):
            low = z + level * gap
            if level:
                meshes.append(box((wide - t, depth - 0.012, t), (x, 0.002, low)))
            free = (wide - t, depth - 0.04, gap - t - 0.012)
            inside.fill(free, (x, -0.008, low + t + 0.001))
    return meshes


def doors_below(sampler: Sampler) -> Model:
    """A library case: deeper cupboards below, open shelves above, cornice and plinth."""
    columns, each = sampler.integer(1, 3), sampler.size(0.55, 0.8)
    width, depth = columns * each, sampler.size(0.36, 0.46)
    height, base, upper_d = sampler.size(1.8, 2.3), sampler.uniform(0.5, 0.85), 0.28
    plinth, crown = sampler.uniform(0.05, 0.1), sampler.choice([0.0, 0.06, 0.1])
    shift, front = (depth - upper_d) / 2, -depth / 2 + LEAF_M
    body = [box((width, depth - LEAF_M, base - plinth), (0, LEAF_M / 2, plinth))]
    body.append(box((width + 0.02, depth + 0.01, plinth), (0, 0, 0)))
    body.append(box((width + 0.03, depth + 0.03, 0.03), (0, 0, base)))
    tall = height - base - 0.03
    inside = contents(sampler)
    upper = [*case((width, upper_d, tall), 0.022, base + 0.03)]
    upper += bays(inside, (width, upper_d, tall), base + 0.03, columns, sampler.integer(3, 4))
    if crown:
        upper.append(box((width + 0.04, upper_d + 0.03, crown / 2), (0, 0, height)))
        upper.append(box((width + 0.09, upper_d + 0.07, crown / 2), (0, 0, height + crown / 2)))
    if sampler.chance(0.4):
        count = columns + 1
        upper += [
            box((0.06, 0.02, tall), (x, -upper_d / 2 - 0.008, base + 0.03))
            for x in np.linspace(0.03 - width / 2, width / 2 - 0.03, count).tolist()
        ]
    held, fields = grip(sampler, 0.06, 0.15), sampler.integer(1, 2)
    leaves: list[Mesh] = []
    handles: list[Mesh] = []
    doors = columns * (2 if sampler.chance(0.6) else 1)
    for index in range(doors):
        wide = width / doors
        x, side = (index - (doors - 1) / 2) * wide, 1 if index % 2 else -1
        frame, inset = panelled(wide - 0.01, base - plinth - 0.02, fields, 0.05)
        leaves += shifted([*frame, *inset], x, front, plinth + 0.01)
        handles += held.at(x - side * (wide / 2 - 0.03), front - LEAF_M, base * 0.7)
    wood = sampler.wood()
    leaf = wood if sampler.chance(0.6) else sampler.wood()
    return assemble(
        NAME,
        (wood, [*body, *shifted(upper, 0, shift)]),
        (leaf, leaves),
        (sampler.metal(), handles),
        *((m, shifted(meshes, 0, shift)) for m, meshes in inside.groups()),
    )


def glass_doors(sampler: Sampler) -> Model:
    """Books behind barred glass doors, or a stack of barristers' boxes."""
    stacked = sampler.chance(0.4)
    width, depth = sampler.size(0.75, 1.2), sampler.size(0.3, 0.38)
    levels, foot = sampler.integer(3, 5), sampler.uniform(0.06, 0.18)
    height = levels * sampler.size(0.33, 0.38)
    deep = depth - LEAF_M
    inside = contents(sampler)
    body: list[Mesh] = []
    frames: list[Mesh] = []
    handles: list[Mesh] = []
    held, front, rail = grip(sampler, 0.05, 0.12), -depth / 2 + LEAF_M, sampler.uniform(0.03, 0.055)
    if stacked:
        each = height / levels
        for level in range(levels):
            z = foot + level * each
            body += case((width, deep, each - 0.008), 0.02, z)
            body.append(box((width + 0.016, deep + 0.016, 0.012), (0, 0, z + each - 0.01)))
            inside.fill((width - 0.045, deep - 0.05, each - 0.06), (0, 0, z + 0.021))
            frame, _ = panelled(width - 0.006, each - 0.012, 1, rail)
            frames += shifted(frame, 0, front, z + 0.002)
            for side in (-1, 1):
                handles += held.at(side * width * 0.3, front - LEAF_M, z + rail / 2, upright=False)
    else:
        body += case((width, deep, height), 0.022, foot)
        body += bays(inside, (width, deep, height), foot, 1, levels)
        bars, doors = sampler.integer(1, levels), sampler.integer(1, 2)
        for index in range(doors):
            x = (index - (doors - 1) / 2) * width / doors
            frame, _ = panelled(width / doors - 0.004, height - 0.004, bars, rail)
            if sampler.chance(0.4):
                frame.append(box((0.014, LEAF_M - 0.006, height - 0.05), (0, -0.011, 0.02)))
            frames += shifted(frame, x, front, foot + 0.002)
            grip_x = (0.4 if doors == 1 else 0.03 - 0.06 * (index == 0)) * (
                width if doors == 1 else 1
            )
            handles += held.at(grip_x, front - LEAF_M, foot + height * 0.5)
    body = shifted(body, 0, LEAF_M / 2)
    if sampler.chance(0.5):
        body.append(box((width + 0.07, depth + 0.05, 0.035), (0, 0, foot + height + 0.003)))
    wood = sampler.wood()
    return assemble(
        NAME,
        (wood, [*body, *feet(sampler, width, depth, foot + 0.004)]),
        (wood if sampler.chance(0.6) else sampler.wood(), frames),
        (sampler.metal(), handles),
        *((m, shifted(meshes, 0, LEAF_M / 2)) for m, meshes in inside.groups()),
    )


def narrow(sampler: Sampler) -> Model:
    """A tall narrow bookcase, one book pile wide, of thin or thick boards."""
    width, depth = sampler.size(0.22, 0.45), sampler.size(0.2, 0.32)
    levels, plinth = sampler.integer(5, 8), sampler.choice([0.0, 0.05, 0.09])
    height = min(levels * sampler.size(0.27, 0.36), 2.1)
    inside = contents(sampler)
    body = case((width, depth, height), 0.022, plinth)
    if sampler.chance(0.3):
        body.pop()
    body += bays(inside, (width, depth, height), plinth, 1, levels)
    if plinth:
        body.append(box((width - 0.01, depth - 0.04, plinth), (0, 0.01, 0)))
    if sampler.chance(0.4):
        inside.fill((width * 0.9, depth - 0.05, 0.22), (0, 0, plinth + height + 0.001))
    return assemble(NAME, (sampler.wood(), body), *inside.groups())


def low(sampler: Sampler) -> Model:
    """A long low bookcase, waist high, on legs or a plinth."""
    columns, levels = sampler.integer(2, 4), sampler.integer(1, 3)
    width, depth = columns * sampler.size(0.42, 0.6), sampler.size(0.28, 0.38)
    foot, height = sampler.uniform(0.04, 0.22), levels * sampler.size(0.32, 0.38)
    inside = contents(sampler)
    body = case((width, depth, height), 0.022, foot)
    body += bays(inside, (width, depth, height), foot, columns, levels)
    if sampler.chance(0.5):
        top = (width + 0.04, depth + 0.03, 0.03)
        body.append(rounded_box(top, (0, 0, foot + height + 0.001), 0.01))
    if sampler.chance(0.5):
        inside.fill((width * 0.5, depth * 0.8, 0.25), (width * 0.2, 0, foot + height + 0.032))
    stand = feet(sampler, width, depth, foot + 0.004)
    wood = sampler.wood()
    return assemble(
        NAME,
        (wood, body),
        (wood if sampler.chance(0.5) else sampler.metal(), stand),
        *inside.groups(),
    )


def arched(sampler: Sampler) -> Model:
    """A bookcase under a round or pointed head, its sides shaped boards."""
    width, depth = sampler.size(0.65, 1.1), sampler.size(0.26, 0.34)
    levels, plinth = sampler.integer(3, 5), sampler.uniform(0.05, 0.12)
    height, rise = levels * sampler.size(0.32, 0.37), sampler.uniform(0.12, 0.35)
    inside = contents(sampler)
    half, front = width / 2, -depth / 2
    body = case((width, depth, height), 0.025, plinth)
    body += bays(inside, (width, depth, height), plinth, 1, levels)
    body.append(box((width + 0.02, depth + 0.01, plinth), (0, 0, 0)))
    sides = sampler.choice([3, 7, 13])
    turn = np.linspace(0, np.pi, sides)
    arch = [(half * float(np.cos(a)), rise * float(np.sin(a))) for a in turn]
    top = plinth + height + 0.001
    body.append(upright_board(arch, 0.018, depth / 2).translated(0, 0, top))
    for (x0, z0), (x1, z1) in pairwise(arch):
        slope = float(np.degrees(np.arctan2(z1 - z0, x1 - x0)))
        span = float(np.hypot(x1 - x0, z1 - z0)) + 0.012
        plank = box((span, depth, 0.02), (0, 0, -0.02)).rotated("y", 180 - slope)
        body.append(plank.translated((x0 + x1) / 2, 0, top + (z0 + z1) / 2 + 0.01))
    inside.fill((width * 0.55, depth * 0.8, rise * 0.6), (0, 0, top + 0.001))
    if sampler.chance(0.5):
        body += [
            box((0.05, 0.018, height), (s * (half - 0.026), front - 0.008, plinth)) for s in (-1, 1)
        ]
    return assemble(NAME, (sampler.wood(), body), *inside.groups())


CLOSED_BOOKCASES: tuple[ModelFactory, ...] = (doors_below, glass_doors, narrow, low, arched)
