"""Wardrobes made up of doors and something else: drawers, top boxes, corners, open bays."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import Mesh, box, prism, rounded_box
from onemap_simulator.generation.model import Model, assemble
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.joinery import (
    LEAF_M,
    Outline,
    case,
    feet,
    garments,
    grip,
    panelled,
    settled,
    shifted,
)

NAME = "wardrobe"


def drawers_below(sampler: Sampler) -> Model:
    """A postwar wardrobe on legs: two doors above, rows of drawers below."""
    width, depth, height = sampler.size(0.75, 1.2), sampler.size(0.48, 0.58), sampler.size(1.6, 2.0)
    leg, rows = sampler.uniform(0.08, 0.24), sampler.integer(1, 3)
    row_h = sampler.uniform(0.16, 0.24)
    radius = sampler.choice([0.004, 0.02, 0.05])
    body = [rounded_box((width, depth - LEAF_M, height - leg), (0, LEAF_M / 2, leg), radius)]
    held = grip(sampler, 0.08, 0.2)
    front, low = -depth / 2 + LEAF_M, leg + 0.025 + rows * row_h
    tall, each = height - low - 0.02, (width - 0.05) / 2
    doors: list[Mesh] = []
    panels: list[Mesh] = []
    drawers: list[Mesh] = []
    handles: list[Mesh] = []
    fields, split = sampler.integer(0, 3), sampler.choice([0.5, 0.5, 0.35])
    for side in (-1, 1):
        wide = (split if side < 0 else 1 - split) * 2 * each - 0.006
        x = side * (each - wide / 2)
        if fields:
            frame, inset = panelled(wide, tall, fields, 0.06)
            doors += shifted(frame, x, front, low)
            panels += shifted(inset, x, front, low)
        else:
            doors.append(rounded_box((wide, LEAF_M, tall), (x, front - LEAF_M / 2, low), 0.006))
        handles += held.at(x - side * (wide / 2 - 0.03), front - LEAF_M, low + tall * 0.4)
    halves = sampler.integer(1, 2)
    for row in range(rows):
        for part in range(halves):
            wide = (width - 0.05) / halves
            x, z = (part - (halves - 1) / 2) * wide, leg + 0.015 + row * row_h
            pulled = -sampler.uniform(0.05, 0.2) if sampler.chance(0.12) else 0.0
            size = (wide - 0.006, LEAF_M - pulled, row_h - 0.008)
            drawers.append(box(size, (x, front - LEAF_M / 2 + pulled / 2, z)))
            for offset in (-wide / 4, wide / 4) if wide > 0.7 else (0.0,):
                handles += held.at(
                    x + offset, front - LEAF_M + pulled, z + row_h / 2, upright=False
                )
    wood = sampler.wood()
    leaf = wood if sampler.chance(0.4) else sampler.wood()
    return settled(
        assemble(
            NAME,
            (wood, body),
            (sampler.wood(), feet(sampler, width - 0.04, depth - 0.04, leg + 0.005)),
            (leaf, doors + panels),
            (leaf if sampler.chance(0.6) else sampler.wood(), drawers),
            (sampler.metal(), handles),
        )
    )


def top_boxes(sampler: Sampler) -> Model:
    """Separate cupboards side by side to the ceiling, a row of small boxes above them."""
    columns = sampler.integer(2, 4)
    each, depth = sampler.size(0.42, 0.6), sampler.size(0.54, 0.64)
    main, box_h, plinth = sampler.size(1.7, 1.95), sampler.uniform(0.32, 0.5), 0.07
    open_bay = sampler.integer(0, columns - 1) if columns > 2 and sampler.chance(0.45) else -1
    fields, held = sampler.integer(0, 3), grip(sampler, 0.1, 0.3)
    rail, front = 0.06, -depth / 2 + LEAF_M
    gap, step = sampler.uniform(0.003, 0.012), sampler.choice([0.0, 0.0, 0.06])
    body: list[Mesh] = []
    leaves: list[Mesh] = []
    panels: list[Mesh] = []
    handles: list[Mesh] = []
    clothes: list[Mesh] = []
    for column in range(columns):
        x, side = (column - (columns - 1) / 2) * each, 1 if column % 2 else -1
        for z, tall in ((plinth, main - plinth), (main + gap, box_h)):
            at_y = front + (step if z > plinth else 0.0)
            shell = case((each - gap, depth / 2 - at_y, tall), 0.018, z)
            body += shifted(shell, x, (depth / 2 + at_y) / 2)
            if column == open_bay and z == plinth:
                body += [
                    box((each - 0.05, depth - 0.06, 0.018), (x, 0.02, k * tall / 4 + z))
                    for k in (1, 3)
                ]
                hung = garments(sampler, each * 0.7, depth * 0.75, tall * 0.42)
                clothes += shifted(hung, x, 0.02, z + tall * 0.74)
                continue
            wide, fit = each - gap - 0.006, tall - 0.006
            if fields:
                frame, inset = panelled(wide, fit, fields if z == plinth else 1, rail)
                leaves += shifted(frame, x, at_y, z + 0.003)
                panels += shifted(inset, x, at_y, z + 0.003)
            else:
                leaves.append(box((wide, LEAF_M, fit), (x, at_y - LEAF_M / 2, z + 0.003)))
            grip_z = z + tall * 0.5 if z == plinth else z + 0.09
            inwards = 0.04 if z == plinth else held.length / 2 + 0.04
            grip_x = x - side * (wide / 2 - inwards)
            handles += held.at(grip_x, at_y - LEAF_M, grip_z, upright=z == plinth)
    body.append(box((columns * each - 0.04, depth - 0.1, plinth), (0, 0.02, 0)))
    wood, leaf = sampler.wood(), sampler.wood()
    return assemble(
        NAME,
        (wood, body),
        (leaf, leaves),
        (leaf if sampler.chance(0.5) else sampler.wood(), panels),
        (sampler.metal(), handles),
        (sampler.fabric(), clothes),
    )


def corner(sampler: Sampler) -> Model:
    """A cupboard for a corner: two walls behind it, a slanting front with one or two doors."""
    side, height = sampler.size(0.8, 1.05), sampler.size(1.8, 2.2)
    flank, plinth = sampler.uniform(0.3, 0.5) * side, sampler.uniform(0.03, 0.09)
    h = side / 2
    plan: Outline = [(h, -h), (h, h), (-h, h), (-h, h - flank), (h - flank, -h)]
    body = [prism(plan, height - plinth, (0, 0, plinth))]
    inner: Outline = [(x * 0.95, y * 0.95) for x, y in plan]
    body.append(prism(inner, plinth))
    if sampler.chance(0.5):
        top: Outline = [(x * 1.02, y * 1.02) for x, y in plan]
        body.append(prism(top, 0.035, (0, 0, height)))
    across = float(np.hypot(2 * h - flank, 2 * h - flank))
    doors, fields = sampler.integer(1, 2), sampler.integer(1, 3)
    held, tall = grip(sampler, 0.1, 0.3), height - plinth - 0.03
    leaves: list[Mesh] = []
    handles: list[Mesh] = []
    for index in range(doors):
        wide = (across - 0.03) / doors
        x = (index - (doors - 1) / 2) * wide
        frame, inset = panelled(wide - 0.005, tall, fields)
        leaves += shifted(frame + inset, x, 0)
        handles += held.at(
            x + (0.04 if index else -0.04) - (wide / 2) * (1 if index else -1), -LEAF_M, tall * 0.5
        )
    middle = (-flank / 2, -flank / 2, plinth + 0.015)
    turn = -45.0
    wood = sampler.wood()
    return assemble(
        NAME,
        (wood, body),
        (
            wood if sampler.chance(0.5) else sampler.wood(),
            [m.rotated("z", turn).translated(*middle) for m in leaves],
        ),
        (sampler.metal(), [m.rotated("z", turn).translated(*middle) for m in handles]),
    )


def locker(sampler: Sampler) -> Model:
    """A narrow steel locker of one to three doors with vent slots and latches."""
    doors, each = sampler.integer(1, 3), sampler.size(0.3, 0.45)
    depth, height, leg = (
        sampler.size(0.45, 0.55),
        sampler.size(1.65, 1.95),
        sampler.uniform(0.02, 0.15),
    )
    width = doors * each
    body = [rounded_box((width, depth - 0.02, height - leg), (0, 0.01, leg), 0.006)]
    leaves: list[Mesh] = []
    slots: list[Mesh] = []
    latches: list[Mesh] = []
    tiers, slope, count = sampler.integer(1, 2), sampler.chance(0.25), sampler.integer(3, 5)
    front, tall = -depth / 2 + 0.01, (height - leg - 0.04) / tiers
    groups = sampler.choice([(0.9,), (0.9, 0.08), (0.8, 0.12)])
    for index in range(doors * tiers):
        x = (index % doors - (doors - 1) / 2) * each
        z = leg + 0.02 + index // doors * tall
        leaves.append(rounded_box((each - 0.03, 0.02, tall - 0.015), (x, front - 0.008, z), 0.006))
        for share in groups:
            for k in range(count):
                at = (x, front - 0.018, z + tall * share - k * 0.025)
                slots.append(box((each * 0.45, 0.008, 0.009), at))
        at_x = x + each / 2 - 0.06
        latches.append(
            rounded_box((0.03, 0.03, 0.12), (at_x, front - 0.028, z + tall * 0.48), 0.01)
        )
        latches.append(box((0.07, 0.004, 0.04), (x, front - 0.02, z + tall * 0.7)))
    if slope:
        edge: Outline = [(-depth / 2, 0.0), (depth / 2, 0.0), (depth / 2, 0.16)]
        roof = (
            prism(edge, width).rotated("x", 90).rotated("z", 90).translated(-width / 2, 0, height)
        )
        body.append(roof)
    steel = sampler.metal() if sampler.chance(0.4) else sampler.plastic()
    leaf = steel if sampler.chance(0.6) else sampler.plastic()
    return assemble(
        NAME,
        (steel, body + feet(sampler, width, depth, leg + 0.003)),
        (leaf, leaves),
        (sampler.dark(), slots),
        (sampler.metal(), latches),
    )


COMPOUND_WARDROBES: tuple[ModelFactory, ...] = (drawers_below, top_boxes, corner, locker)
