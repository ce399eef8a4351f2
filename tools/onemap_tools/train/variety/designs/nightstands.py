"""Nightstands: bedside tables in other constructions than the small chest on four posts."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from onemap_simulator.generation.mesh import Mesh, box, cylinder, prism, rod, rounded_box
from onemap_simulator.generation.model import Model, assemble, support_surface
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.joinery import (
    LEAF_M,
    case,
    feet,
    grip,
    settled,
)
from onemap_tools.train.variety.designs.nightstands_light import LIGHT_NIGHTSTANDS

NAME = "nightstand"


def drum(sampler: Sampler) -> Model:
    """A round drum with a curved door or drawers, or ribbed all around."""
    radius, height = sampler.size(0.19, 0.26), sampler.size(0.42, 0.6)
    foot, edge = sampler.uniform(0.01, 0.09), sampler.uniform(0.015, 0.03)
    body = [cylinder(radius - 0.012, height - foot - edge, (0, 0, foot), 24)]
    body.append(cylinder(radius * 0.8, foot, (0, 0, 0), 20))
    body.append(cylinder(radius + sampler.choice([0.0, 0.015]), edge, (0, 0, height - edge), 24))
    held = grip(sampler, 0.06, 0.14)
    fronts: list[Mesh] = []
    handles: list[Mesh] = []
    low, tall = foot + 0.012, height - foot - edge - 0.024
    kind = sampler.integer(0, 2)
    rows = (1, sampler.integer(2, 3), 1)[kind]
    if kind == 2:
        count = sampler.integer(24, 40)
        for k in range(count):
            angle = 2 * np.pi * k / count
            at = (float(np.cos(angle)) * (radius - 0.012), float(np.sin(angle)) * (radius - 0.012))
            fronts.append(cylinder(np.pi * radius / count * 0.8, tall, (*at, low), 6))
    else:
        half = sampler.uniform(50, 75)
        turn = np.radians(np.linspace(270 - half, 270 + half, 9))
        for row in range(rows):
            z = low + row * tall / rows
            for start, end in pairwise(turn.tolist()):
                middle = (start + end) / 2
                chord = 2 * radius * float(np.sin((end - start) / 2)) + 0.001
                plank = box((chord, 0.016, tall / rows - 0.01), (0, -radius + 0.006, 0))
                fronts.append(
                    plank.rotated("z", float(np.degrees(middle)) + 90).translated(0, 0, z)
                )
            at_x = 0.0 if rows > 1 else radius * 0.5
            y = -float(np.sqrt(radius**2 - at_x**2))
            handles += held.at(at_x, y + 0.002, z + tall / rows * 0.5, upright=rows == 1)
    wood = sampler.wood()
    face = wood if sampler.chance(0.5) else sampler.wood()
    top = support_surface(radius * 1.4, radius * 1.4, height, 0.01)
    return assemble(
        NAME, (wood, body), (face, fronts), (sampler.metal(), handles), support_surfaces=(top,)
    )


def legged(sampler: Sampler) -> Model:
    """A small box with a drawer, or an open slot, high on long legs; perhaps a low shelf."""
    width, depth = sampler.size(0.36, 0.55), sampler.size(0.32, 0.42)
    height, box_h = sampler.size(0.48, 0.65), sampler.uniform(0.13, 0.24)
    low, radius = height - box_h, sampler.choice([0.003, 0.015, 0.03])
    open_slot = sampler.chance(0.3)
    fronts: list[Mesh] = []
    handles: list[Mesh] = []
    held = grip(sampler, 0.06, 0.18)
    if open_slot:
        body = case((width, depth, box_h), 0.018, low)
    else:
        body = [rounded_box((width, depth - LEAF_M, box_h), (0, LEAF_M / 2, low), radius)]
        size = (width - 0.03, LEAF_M, box_h - 0.04)
        fronts.append(rounded_box(size, (0, LEAF_M / 2 - depth / 2, low + 0.02), 0.006))
        handles += held.at(0, -depth / 2, low + box_h / 2, upright=False)
    stand = feet(sampler, width - 0.03, depth - 0.03, low + 0.004)
    if sampler.chance(0.4):
        body.append(box((width * 0.78, depth * 0.74, 0.016), (0, 0, low * 0.35)))
    if sampler.chance(0.35):
        t = sampler.uniform(0.03, 0.08)
        body.append(box((width, 0.014, t), (0, depth / 2 - 0.007, height + 0.001)))
    wood = sampler.wood()
    return assemble(
        NAME,
        (wood, body),
        (wood if sampler.chance(0.5) else sampler.wood(), fronts),
        (wood if sampler.chance(0.4) else sampler.metal(), stand),
        (sampler.metal(), handles),
        support_surfaces=(support_surface(width, depth, height),),
    )


def open_cube(sampler: Sampler) -> Model:
    """An open cube or C shape of boards, one bent sheet, or a cage of bars with a plate."""
    width, depth, height = (
        sampler.size(0.34, 0.5),
        sampler.size(0.32, 0.42),
        sampler.size(0.4, 0.58),
    )
    t, kind = sampler.uniform(0.012, 0.035), sampler.integer(0, 2)
    frame: list[Mesh] = []
    if kind == 0:
        body = case((width, depth, height), t)
        if sampler.chance(0.6):
            body.pop()
        for k in range(1, sampler.integer(1, 3)):
            body.append(box((width - 2 * t, depth - 0.01, t), (0, 0.004, k * height / 3)))
    elif kind == 1:
        side = sampler.choice([-1, 1])
        body = [box((width, depth, t), (0, 0, z)) for z in (0.0, height - t)]
        body.append(box((t, depth, height - 2 * t), (side * (width - t) / 2, 0, t)))
        if sampler.chance(0.6):
            body.append(
                box((width * 0.8, depth, t), (side * width * 0.1 - side * t, 0, height * 0.5))
            )
    else:
        r = t / 2
        x, y = width / 2 - r, depth / 2 - r
        frame += [box((t, t, height - t), (sx * x, sy * y, 0)) for sx in (-1, 1) for sy in (-1, 1)]
        for z in (0.02, height - 2 * t):
            frame += [box((width - 2 * t, t, t), (0, s * y, z)) for s in (-1, 1)]
            frame += [box((t, depth - 2 * t, t), (s * x, 0, z)) for s in (-1, 1)]
        body = [box((width, depth, t), (0, 0, height - t))]
        body.append(box((width - 2 * t, depth - 2 * t, 0.012), (0, 0, 0.02 + t)))
    return assemble(
        NAME,
        (sampler.wood() if sampler.chance(0.7) else sampler.plastic(), body),
        (sampler.metal(), frame),
        support_surfaces=(support_surface(width, depth, height),),
    )


def stacked_drawers(sampler: Sampler) -> Model:
    """Two to five drawers one above another, bowed, framed, skewed or pulled out."""
    width, depth = sampler.size(0.34, 0.52), sampler.size(0.34, 0.44)
    rows, foot = sampler.integer(2, 5), sampler.uniform(0.02, 0.12)
    height = min(foot + rows * sampler.uniform(0.12, 0.2), 0.72)
    bow, held = sampler.choice([0.0, 0.0, 0.04]), grip(sampler, 0.06, 0.2)
    body = [box((width, depth - LEAF_M - bow, height - foot - 0.02), (0, (LEAF_M + bow) / 2, foot))]
    top_d = depth + 0.01
    body.append(rounded_box((width + 0.02, top_d, 0.02), (0, 0, height - 0.02), 0.008))
    each = (height - foot - 0.03) / rows
    fronts: list[Mesh] = []
    handles: list[Mesh] = []
    pulled = sampler.integer(0, rows - 1) if sampler.chance(0.2) else -1
    turn = np.linspace(-1, 1, 9)
    jitter = sampler.uniform(0.0, 0.02) if sampler.chance(0.3) else 0.0
    y = -depth / 2 + LEAF_M + bow
    for row in range(rows):
        z, out = foot + 0.006 + row * each, 0.09 if row == pulled else 0.0
        wide = width - 0.016
        x = jitter * (-1) ** row
        if bow:
            arc = [(float(a) * wide / 2, -bow * (1 - float(a) ** 2)) for a in turn]
            plan = [(wide / 2, LEAF_M), (-wide / 2, LEAF_M), *arc]
            fronts.append(_slab(plan, each - 0.012).translated(x, y - LEAF_M - out, z))
        else:
            size = (wide, LEAF_M + out, each - 0.012)
            fronts.append(box(size, (x, y - (LEAF_M + out) / 2, z)))
        if bow and out:
            fronts.append(box((wide * 0.9, out, each * 0.7), (x, y - out / 2, z + 0.004)))
        handles += held.at(x, y - LEAF_M - bow - out, z + each / 2, upright=False)
    wood = sampler.wood()
    return settled(
        assemble(
            NAME,
            (wood, [*body, *feet(sampler, width, depth, foot + 0.003)]),
            (wood if sampler.chance(0.4) else sampler.wood(), fronts),
            (sampler.metal(), handles),
            support_surfaces=(support_surface(width, depth, height),),
        )
    )


def door_chest(sampler: Sampler) -> Model:
    """An old bedside cupboard: a door below a drawer, a rail or marble plate, shaped feet."""
    width, depth, height = (
        sampler.size(0.36, 0.46),
        sampler.size(0.33, 0.42),
        sampler.size(0.55, 0.75),
    )
    foot, slab = sampler.uniform(0.05, 0.16), sampler.uniform(0.015, 0.035)
    body = [box((width, depth - LEAF_M, height - foot - slab), (0, LEAF_M / 2, foot))]
    top = [rounded_box((width + 0.04, depth + 0.02, slab), (0, 0, height - slab), slab * 0.4)]
    open_top = sampler.chance(0.3)
    drawer_h, held = (height - foot) * sampler.uniform(0.22, 0.35), grip(sampler, 0.05, 0.12)
    split, front = height - slab - drawer_h, LEAF_M / 2 - depth / 2
    fronts: list[Mesh] = []
    handles: list[Mesh] = []
    if open_top:
        body = [box((width, depth - LEAF_M, split - foot), (0, LEAF_M / 2, foot))]
        body += case((width, depth - LEAF_M, drawer_h - 0.002), 0.018, split + 0.001)
    else:
        fronts.append(
            rounded_box((width - 0.03, LEAF_M, drawer_h - 0.02), (0, front, split + 0.01), 0.006)
        )
        handles += held.at(0, -depth / 2, split + drawer_h / 2, upright=False)
    tall = split - foot - 0.02
    fronts.append(rounded_box((width - 0.03, LEAF_M, tall), (0, front, foot + 0.01), 0.006))
    if sampler.chance(0.6):
        fronts.append(
            rounded_box(
                (width - 0.14, 0.012, tall - 0.11), (0, -depth / 2 - 0.002, foot + 0.065), 0.005
            )
        )
    handles += held.at(width / 2 - 0.045, -depth / 2, foot + tall * 0.6)
    rail: list[Mesh] = []
    if sampler.chance(0.35):
        z, x, y = height + 0.035, width / 2, depth / 2 - 0.015
        ends = [(-x, -y * 0.5), (-x, y), (x, y), (x, -y * 0.5)]
        rail += [rod((*a, z), (*b, z), 0.005, 6) for a, b in pairwise(ends)]
        rail += [cylinder(0.006, 0.04, (*at, height - 0.002), 6) for at in ends]
    wood = sampler.wood()
    return assemble(
        NAME,
        (wood, [*body, *feet(sampler, width, depth, foot + 0.003)]),
        (wood if sampler.chance(0.5) else sampler.ceramic(), top),
        (wood if sampler.chance(0.5) else sampler.wood(), fronts),
        (sampler.metal(), [*handles, *rail]),
        support_surfaces=(support_surface(width, depth, height),),
    )


def _slab(plan: list[tuple[float, float]], height: float) -> Mesh:
    """An outline seen from above, raised by the height."""
    return prism(plan, height)


DESIGNS: dict[str, tuple[ModelFactory, ...]] = {
    NAME: (drum, legged, open_cube, stacked_drawers, door_chest, *LIGHT_NIGHTSTANDS)
}
