"""Sideboards, media units and other wide, low dressers."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import Mesh, box, cone, rod, rounded_box
from onemap_simulator.generation.model import Model, assemble, support_surface
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.fronts import HANDLES, drawer, framed_door, pulls, rows_of
from onemap_tools.train.variety.designs.woodwork import SIDES, corners, lean


def sideboard(sampler: Sampler) -> Model:
    """A wide low sideboard: a stack of drawers between panelled, slatted or louvred doors."""
    columns = sampler.integer(3, 4)
    width, depth = columns * sampler.size(0.38, 0.5), sampler.size(0.38, 0.48)
    height, leg = sampler.size(0.7, 0.92), sampler.uniform(0.04, 0.2)
    tall, each, front = height - leg - 0.03, width / columns, -depth / 2
    body = [box((width, depth, tall), (0, 0, leg))]
    body.append(box((width + 0.03, depth + 0.04, 0.032), (0, 0, height - 0.032)))
    body += [box((0.05, 0.05, leg), (*at, 0)) for at in corners(width, depth, 0.04)]
    kind, style = sampler.choice(HANDLES), sampler.choice(["panel", "slats", "louvre", "flat"])
    stacks = {sampler.integer(0, columns - 1)} if sampler.chance(0.6) else {0, columns - 1}
    top_row = 0.16 if sampler.chance(0.5) else 0.0
    fronts: list[Mesh] = []
    doors: list[Mesh] = []
    knobs: list[Mesh] = []
    for column in range(columns):
        x, z = (column - (columns - 1) / 2) * each, leg + 0.01
        heights = [tall - 0.02]
        if column in stacks:
            heights = rows_of(sampler, sampler.integer(3, 4), tall - 0.02)
        elif top_row:
            heights = [tall - 0.02 - top_row, top_row]
        for part in heights:
            at = (x, front, z)
            if part > 0.3:
                doors += framed_door(style, (each - 0.014, part - 0.014), at)
                side = 1 if column < columns / 2 else -1
                knobs.append(
                    rod(
                        (x + side * (each / 2 - 0.05), front - 0.04, z + part * 0.45),
                        (x + side * (each / 2 - 0.05), front - 0.04, z + part * 0.62),
                        0.009,
                    )
                )
            else:
                fronts += drawer((each - 0.014, part - 0.014), at)
                knobs += pulls(kind, (x, front - 0.02, z + part / 2), each, part)
            z += part
    surface = support_surface(width, depth, height)
    return assemble(
        "dresser",
        (sampler.wood(), body),
        (sampler.wood(), [*fronts, *doors]),
        (sampler.metal(), knobs),
        support_surfaces=(surface,),
    )


def midcentury(sampler: Sampler) -> Model:
    """A long box of drawers within a frame on high splayed legs, fronts set back."""
    columns, rows = sampler.integer(1, 3), sampler.integer(2, 4)
    width = columns * sampler.size(0.45, 0.55) + (0.3 if columns == 1 else 0.0)
    depth, leg = sampler.size(0.4, 0.48), sampler.uniform(0.18, 0.36)
    tall, rim, front = (
        rows * sampler.uniform(0.15, 0.2) + 0.04,
        sampler.uniform(0.018, 0.03),
        -depth / 2,
    )
    height = leg + tall
    body = [box((width - 0.01, depth - 0.05, tall - 0.01), (0, 0.025, leg + 0.005))]
    body += [box((width, depth, rim), (0, 0, z)) for z in (leg, height - rim)]
    body += [
        box((rim, depth - 0.003, tall - 0.004), (s * (width - rim) / 2, 0, leg + 0.002))
        for s in SIDES
    ]
    legs = [
        lean(cone((0.012, 0.024), leg), -0.06 * np.sign(x), -0.04 * np.sign(y)).translated(x, y)
        for x, y in corners(width, depth, 0.03)
    ]
    if sampler.chance(0.5):
        legs += [
            box((0.035, depth - 0.16, 0.03), (s * (width / 2 - 0.09), 0, leg - 0.03)) for s in SIDES
        ]
    kind = sampler.choice(["knob", "slot", "bar", "strap", "cup"])
    fronts: list[Mesh] = []
    knobs: list[Mesh] = []
    each_w, each_h = (width - 2 * rim) / columns, (tall - 2 * rim) / rows
    for column in range(columns):
        x = (column - (columns - 1) / 2) * each_w
        for row in range(rows):
            z = leg + rim + row * each_h
            fronts += drawer((each_w - 0.008, each_h - 0.008), (x, front + 0.03, z + 0.004))
            knobs += pulls(kind, (x, front + 0.01, z + each_h / 2), each_w, each_h)
    surface = support_surface(width, depth, height)
    return assemble(
        "dresser",
        (sampler.wood(), body),
        (sampler.wood(), fronts),
        (sampler.metal() if sampler.chance(0.5) else sampler.wood(), [*knobs, *legs]),
        support_surfaces=(surface,),
    )


def media_unit(sampler: Sampler) -> Model:
    """A low long unit: open compartments in the middle, drawers or doors at the ends."""
    width, depth, height = (
        sampler.size(1.2, 1.9),
        sampler.size(0.36, 0.45),
        sampler.size(0.42, 0.62),
    )
    leg, board_t, front = sampler.choice([0.0, 0.06, 0.15]), 0.022, -depth / 2
    end_w, tall = width * sampler.uniform(0.24, 0.33), height - leg
    body = [box((width, depth, board_t), (0, 0, z)) for z in (leg, height - board_t)]
    inner = tall - 2 * board_t
    low = leg + board_t
    body += [
        box((board_t, depth - 0.004, inner), (s * (width - board_t) / 2, 0, low)) for s in SIDES
    ]
    body += [box((board_t, depth - 0.01, inner), (s * (width / 2 - end_w), 0, low)) for s in SIDES]
    body.append(box((width - 0.02, 0.01, inner), (0, depth / 2 - 0.012, low)))
    middle = width - 2 * end_w
    if sampler.chance(0.6):
        body.append(box((middle, depth - 0.05, 0.018), (0, 0.01, low + inner * 0.5)))
    if sampler.chance(0.4):
        body.append(box((0.018, depth - 0.05, inner), (0, 0.012, low)))
    posts = [box((width - 0.1, depth - 0.08, leg))] if leg else []
    if leg > 0.1:
        posts = [cone((0.014, 0.024), leg, (*at, 0)) for at in corners(width, depth, 0.07)]
    kind, doors = sampler.choice(HANDLES), sampler.chance(0.5)
    style = sampler.choice(["slats", "panel", "louvre", "flat"])
    fronts: list[Mesh] = []
    knobs: list[Mesh] = []
    for s in SIDES:
        x, wide = s * (width - end_w) / 2, end_w - 2 * board_t
        fronts.append(box((wide - 0.002, depth - 0.1, inner), (x, 0.0, low)))
        if doors:
            fronts += framed_door(style, (wide, inner - 0.008), (x, front + 0.05, low + 0.004))
        count = 0 if doors else sampler.integer(1, 3)
        for row in range(count):
            each = inner / count
            z = low + row * each
            fronts += drawer((wide, each - 0.008), (x, front + 0.05, z + 0.004))
            knobs += pulls(kind, (x, front + 0.03, z + each / 2), wide, each)
    surface = support_surface(width, depth, height)
    return assemble(
        "dresser",
        (sampler.wood(), body),
        (sampler.wood(), fronts),
        (sampler.metal(), [*knobs, *posts]),
        support_surfaces=(surface,),
    )


def vanity(sampler: Sampler) -> Model:
    """A dressing chest without its mirror: low middle drawers between two taller stacks."""
    width, depth, height = sampler.size(1.0, 1.5), sampler.size(0.42, 0.5), sampler.size(0.74, 0.9)
    leg, front = sampler.uniform(0.06, 0.18), -depth / 2
    end_w, drop = width * sampler.uniform(0.27, 0.34), sampler.uniform(0.06, 0.16)
    middle, low_top = width - 2 * end_w, height - drop
    body = [box((middle, depth - 0.04, low_top - leg - 0.03), (0, 0.02, leg))]
    body.append(box((middle - 0.002, depth - 0.01, 0.03), (0, 0.005, low_top - 0.03)))
    legs: list[Mesh] = []
    shaft = box((0.04, 0.04, leg)) if sampler.chance(0.5) else cone((0.014, 0.028), leg)
    for s in SIDES:
        x = s * (width - end_w) / 2
        body.append(box((end_w, depth, height - leg - 0.028), (x, 0, leg)))
        body.append(box((end_w + 0.03, depth + 0.03, 0.03), (x, 0, height - 0.03)))
        legs += [shaft.translated(x + px, py) for px, py in corners(end_w, depth, 0.035)]
    kind = sampler.choice(HANDLES)
    fronts: list[Mesh] = []
    knobs: list[Mesh] = []
    count = sampler.integer(3, 4)
    stacks = [(s * (width - end_w) / 2, end_w, front, height - 0.03, count) for s in SIDES]
    stacks.append((0.0, middle, front + 0.04, low_top - 0.03, sampler.integer(1, 3)))
    for x, wide, y, high, rows in stacks:
        z = leg + 0.015
        for each in rows_of(sampler, rows, high - z - 0.01):
            fronts += drawer((wide - 0.04, each - 0.014), (x, y, z))
            knobs += pulls(kind, (x, y - 0.02, z + each / 2), wide, each)
            z += each
    surface = support_surface(middle, depth, low_top)
    return assemble(
        "dresser",
        (sampler.wood(), body),
        (sampler.wood(), fronts),
        (sampler.metal(), knobs),
        (sampler.wood(), legs),
        support_surfaces=(surface,),
    )


def basket_chest(sampler: Sampler) -> Model:
    """An open frame of posts and rails with wicker or cloth boxes for drawers."""
    columns, rows = sampler.integer(1, 3), sampler.integer(2, 4)
    width = columns * sampler.size(0.36, 0.46) + 0.06
    depth, each_h = sampler.size(0.38, 0.46), sampler.uniform(0.2, 0.27)
    height, post = rows * each_h + 0.1, sampler.uniform(0.024, 0.04)
    wood = [box((post, post, height - 0.02), (*at, 0)) for at in corners(width, depth, post / 2)]
    wood.append(box((width + 0.03, depth + 0.03, 0.024), (0, 0, height - 0.024)))
    boxes: list[Mesh] = []
    holes: list[Mesh] = []
    each_w = (width - 2 * post) / columns
    for row in range(rows):
        z = 0.06 + row * each_h
        wood.append(box((width - 0.004, depth - 0.006, 0.016), (0, 0, z)))
        for column in range(columns):
            x = (column - (columns - 1) / 2) * each_w
            out = sampler.uniform(0.0, 0.02)
            tall = each_h * sampler.uniform(0.76, 0.84)
            size = (each_w - 0.03, depth - 0.05, tall)
            boxes.append(rounded_box(size, (x, -0.005 - out, z + 0.016), 0.02))
            y = -depth / 2 + 0.02 - out
            holes.append(rounded_box((0.1, 0.012, 0.035), (x, y, z + tall * 0.7), 0.005))
            boxes.append(box((each_w - 0.07, 0.01, 0.02), (x, y, z + 0.03)))
    for column in range(1, columns):
        x = (column - columns / 2) * each_w
        wood.append(box((0.016, depth - 0.04, height - 0.09), (x, 0, 0.062)))
    surface = support_surface(width, depth, height)
    return assemble(
        "dresser",
        (sampler.wood() if sampler.chance(0.7) else sampler.metal(), wood),
        (sampler.fabric(), boxes),
        (sampler.dark(), holes),
        support_surfaces=(surface,),
    )


DESIGNS: dict[str, tuple[ModelFactory, ...]] = {
    "dresser": (
        sideboard,
        midcentury,
        media_unit,
        vanity,
        basket_chest,
    )
}
