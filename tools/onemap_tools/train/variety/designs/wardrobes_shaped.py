"""Wardrobes with shaped tops: cornices, arches, gables."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import (
    Mesh,
    Vec,
    box,
    cylinder,
    rounded_box,
)
from onemap_simulator.generation.model import Model, assemble
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.joinery import (
    Outline,
    feet,
    grip,
    shifted,
    upright_board,
)

NAME = "wardrobe"
GAP_M = 0.006


def armoire(sampler: Sampler) -> Model:
    """An old armoire: flared cornice, arched panels, feet, a drawer at the foot."""
    width, depth = sampler.size(0.95, 1.6), sampler.size(0.5, 0.62)
    height, foot = sampler.size(1.8, 2.25), sampler.uniform(0.07, 0.16)
    crown, skirt = sampler.uniform(0.09, 0.16), sampler.choice([0.08, 0.22, 0.28])
    flare = sampler.uniform(0.03, 0.08)
    body = [box((width, depth, height - foot - crown), (0, 0, foot))]
    body += _crown(sampler, (width, depth, height), foot, crown, flare)
    held = grip(sampler, 0.08, 0.15)
    low, front = foot + skirt + 0.05, -depth / 2
    leaves: list[Mesh] = []
    panels: list[Mesh] = []
    handles: list[Mesh] = []
    tall, each = height - crown - low - 0.03, (width - 0.12) / 2
    rows = sampler.integer(1, 3)
    for side in (-1, 1):
        x = side * each / 2
        leaves.append(rounded_box((each - GAP_M, 0.03, tall), (x, front - 0.01, low), 0.006))
        panels += shifted(
            _arched_panels(each - 0.14, tall - 0.14, rows), x, front - 0.02, low + 0.07
        )
        handles += held.at(side * 0.035, front - 0.024, low + tall * 0.48)
    if skirt > 0.1:
        count = sampler.integer(1, 2)
        for index in range(count):
            wide = (width - 0.12) / count
            x = (index - (count - 1) / 2) * wide
            leaves.append(
                rounded_box(
                    (wide - 0.01, 0.03, skirt - 0.03), (x, front - 0.01, foot + 0.05), 0.008
                )
            )
            handles += held.at(x, front - 0.024, foot + skirt / 2 + 0.03, upright=False)
    wood = sampler.wood()
    leaf = wood if sampler.chance(0.6) else sampler.wood()
    inset = leaf if sampler.chance(0.5) else sampler.wood()
    return assemble(
        NAME,
        (wood, [*body, *feet(sampler, width, depth, foot + 0.005)]),
        (leaf, leaves),
        (inset, panels),
        (sampler.metal(), handles),
    )


def _crown(sampler: Sampler, size: Vec, foot: float, crown: float, flare: float) -> list[Mesh]:
    """A cornice in steps, sometimes with an arch on it and columns below."""
    width, depth, height = size
    body: list[Mesh] = []
    steps = sampler.integer(2, 4)
    for step in range(steps):
        grow = flare * (step + 1) / steps
        size = (width + 2 * grow, depth + grow, crown / steps)
        body.append(box(size, (0, -grow / 2, height - crown + step * crown / steps)))
    body.append(box((width + 0.03, depth + 0.02, 0.04), (0, -0.01, foot)))
    if sampler.chance(0.5):
        turn = np.linspace(0, np.pi, 13)
        rise = sampler.uniform(0.08, 0.2)
        arch = [(float(np.cos(a)) * width * 0.5, float(np.sin(a)) * rise) for a in turn]
        body.append(upright_board(arch, 0.05, 0.02 - depth / 2).translated(0, 0, height))
    if sampler.chance(0.4):
        body += [
            cylinder(
                0.035, height - foot - crown - 0.05, (s * width / 2, -depth / 2, foot + 0.05), 10
            )
            for s in (-1, 1)
        ]
    return body


def _arched_panels(width: float, height: float, rows: int) -> list[Mesh]:
    """Raised fields one above another, the topmost with an arched head; backs at y = 0."""
    cell, rise = height / rows, min(width * 0.3, 0.12)
    fields = [
        rounded_box((width, 0.022, cell - 0.06), (0, -0.005, row * cell), 0.008)
        for row in range(rows - 1)
    ]
    turn = np.linspace(0, np.pi, 9)
    top, w = (rows - 1) * cell, width / 2
    spring = height - rise
    head = [(float(np.cos(a)) * w, spring + float(np.sin(a)) * rise) for a in turn]
    return [*fields, upright_board([(-w, top), (w, top), *head], 0.014, 0.0)]


def nursery(sampler: Sampler) -> Model:
    """A low children's wardrobe: rounded, gabled or crowned top, round knobs, coloured drawers."""
    width, depth, height = (
        sampler.size(0.75, 1.1),
        sampler.size(0.45, 0.55),
        sampler.size(1.25, 1.6),
    )
    leg, drawer_h = sampler.uniform(0.05, 0.14), sampler.uniform(0.15, 0.22)
    half, rise, shape = width / 2, sampler.uniform(0.12, 0.3), sampler.integer(0, 2)
    body = _gabled(sampler, (width, depth, height), leg, rise, shape)
    front = -depth / 2 + 0.02
    low = leg + 2 * drawer_h + 0.02
    doors: list[Mesh] = []
    drawers: list[Mesh] = []
    dots: list[Mesh] = []
    held = grip(sampler, 0.06, 0.12)
    for side in (-1, 1):
        wide, tall = half - 0.02, height - low - 0.02
        doors.append(
            rounded_box((wide - 0.006, 0.02, tall), (side * wide / 2, front - 0.01, low), 0.009)
        )
        dots += held.at(side * 0.04, front - 0.02, low + tall * 0.45)
    for row in range(2):
        size = (width - 0.05, 0.02, drawer_h - 0.01)
        drawers.append(rounded_box(size, (0, front - 0.01, leg + 0.01 + row * drawer_h), 0.009))
        for side in (-1, 1):
            dots += held.at(
                side * width * 0.25, front - 0.02, leg + (row + 0.5) * drawer_h, upright=False
            )
    if shape == 1 and sampler.chance(0.6):
        star = cylinder(rise * 0.3, 0.012, segments=5).rotated("x", 90)
        dots.append(star.translated(0, front - 0.002, height + rise * 0.4))
    wood = sampler.wood()
    return assemble(
        NAME,
        (wood, body + feet(sampler, width, depth, leg + 0.004)),
        (wood if sampler.chance(0.3) else sampler.wood(), doors),
        (sampler.plastic(), drawers),
        (sampler.plastic(), dots),
    )


def _gabled(sampler: Sampler, size: Vec, leg: float, rise: float, shape: int) -> list[Mesh]:
    """A body with a gable (0), a round head (1) or a flat one."""
    width, depth, height = size
    half = width / 2
    turn = np.linspace(0, np.pi, 13)
    outline: Outline = [(-half, 0.0), (half, 0.0), (half, height - leg)]
    if shape == 0:
        outline.append((0.0, height - leg + rise))
    elif shape == 1:
        outline += [
            (half * float(np.cos(a)), height - leg + rise * float(np.sin(a))) for a in turn[1:-1]
        ]
    outline.append((-half, height - leg))
    body = [upright_board(outline, depth - 0.02, depth / 2).translated(0, 0, leg)]
    if shape == 0 and sampler.chance(0.6):
        for side in (-1, 1):
            length = float(np.hypot(half, rise)) + 0.06
            plank = box((length, depth + 0.04, 0.03), (0, -0.005, 0.002))
            angle = side * float(np.degrees(np.arctan2(rise, half)))
            body.append(plank.rotated("y", angle).translated(side * half / 2, 0, height + rise / 2))
    return body


SHAPED_WARDROBES: tuple[ModelFactory, ...] = (armoire, nursery)
