"""Small desks of homes: for a child, against a wall, on sawhorses, for drawing."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import (
    Mesh,
    box,
    box_between,
    cylinder,
    rod,
)
from onemap_simulator.generation.model import Model, assemble, support_surface
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.fronts import HANDLES, drawer, drawer_block, pulls
from onemap_tools.train.variety.designs.woodwork import (
    SIDES,
    board,
    centred,
    corners,
    frame,
    racetrack,
    slab,
    stretch,
)


def _upper(width: float, depth: float, z: float, tall: float) -> list[Mesh]:
    """An open shelf that stands on the back of a top at height ``z``."""
    y = depth / 2 - 0.11
    meshes = [box((0.02, 0.2, tall), (s * (width / 2 - 0.03), y, z - 0.001)) for s in SIDES]
    meshes += [box((width - 0.07, 0.196, 0.018), (0, y, z + tall * f)) for f in (0.5, 0.93)]
    return [*meshes, box((width - 0.06, 0.012, tall), (0, depth / 2 - 0.02, z - 0.001))]


def student(sampler: Sampler) -> Model:
    """A small desk for a child's room: drawers at one side, a panel or steel legs opposite."""
    width, depth, height = (
        sampler.size(0.85, 1.2),
        sampler.size(0.48, 0.6),
        sampler.size(0.64, 0.75),
    )
    thick, side = sampler.uniform(0.018, 0.03), sampler.choice(SIDES)
    under, stack = height - thick, sampler.uniform(0.28, 0.36)
    top = [slab(racetrack(width, depth, sampler.choice([0.005, 0.04, 0.1])), thick, under)]
    x, low = side * (width / 2 - stack / 2 - 0.02), sampler.choice([0.0, 0.05, 0.24])
    size = (stack, depth - 0.04, under - low)
    block = drawer_block(
        sampler, sampler.choice(HANDLES), size, (x, 0, low), 1 + (low < 0.1) * sampler.integer(1, 3)
    )
    legs: list[Mesh] = []
    if low:
        legs += [
            cylinder(0.017, low + 0.003, (x + a, b, 0), 8)
            for a, b in corners(stack, depth - 0.05, 0.03)
        ]
    far = -side * (width / 2 - 0.03)
    if sampler.chance(0.5):
        legs.append(box((0.022, depth - 0.05, under), (far, 0, 0)))
    else:
        legs += [
            rod((far, s * (depth / 2 - 0.05), 0), (far, s * (depth / 2 - 0.05), under), 0.018)
            for s in SIDES
        ]
        if sampler.chance(0.5):
            legs.append(rod((far, -depth / 2 + 0.05, 0.1), (far, depth / 2 - 0.05, 0.1), 0.013))
    back = box(
        (width - stack - 0.06, 0.016, 0.26), (-side * stack / 2, depth / 2 - 0.05, under - 0.26)
    )
    if sampler.chance(0.4):
        top += _upper(width, depth, height, sampler.uniform(0.3, 0.55))
    surface = support_surface(width, depth, height)._replace(y_max=depth / 2 - 0.24)
    return assemble(
        "desk",
        (board(sampler), top),
        (frame(sampler), [*legs, back, *block.case]),
        (sampler.plastic(), block.fronts),
        (sampler.metal(), block.handles),
        support_surfaces=(surface,),
    )


def ladder(sampler: Sampler) -> Model:
    """A leaning ladder against the wall: a writing board at sitting height, shelves above."""
    width, height = sampler.size(0.65, 1.1), sampler.size(1.5, 1.9)
    foot, rail, desk_d = (
        sampler.uniform(0.4, 0.5),
        sampler.uniform(0.03, 0.045),
        sampler.size(0.45, 0.58),
    )
    desk_z, back = sampler.uniform(0.72, 0.76), 0.0
    straight = sampler.chance(0.4)
    poles: list[Mesh] = []
    for s in SIDES:
        x = s * (width / 2 - rail / 2)
        poles.append(stretch((rail, rail * 1.3), (x, -foot, 0), (x, back - 0.03), height))
        if straight:
            poles.append(box((rail - 0.004, rail, height - 0.01), (x, back - 0.022, 0)))
        else:
            poles.append(
                box(
                    (rail - 0.004, foot * (1 - 0.55), rail), (x, back - foot * 0.225, desk_z - 0.05)
                )
            )
            poles.append(box((rail - 0.004, rail, desk_z), (x, back - 0.022, 0)))
    inner = width - 2 * rail + 0.01
    boards = [box((inner, desk_d, 0.024), (0, back - desk_d / 2, desk_z))]
    boards.append(box((inner, 0.014, 0.09), (0, back - 0.008, desk_z + 0.022)))
    count = sampler.integer(2, 4)
    for z in np.linspace(desk_z + 0.34, height - 0.12, count).tolist():
        deep = max(foot * (1 - z / height) + 0.12, 0.17)
        boards.append(box((inner, deep, 0.02), (0, back - deep / 2, z)))
        boards.append(box((inner, 0.012, 0.05), (0, back - 0.008, z + 0.018)))
    if sampler.chance(0.5):
        wide = inner - 0.05
        boards.append(
            box((wide, desk_d - 0.08, 0.07), (0, back - desk_d / 2 + 0.02, desk_z - 0.072))
        )
        poles.append(box((0.1, 0.02, 0.015), (0, back - desk_d + 0.055, desk_z - 0.04)))
    surface = support_surface(width, desk_d, desk_z + 0.024)
    surface = surface._replace(y_min=back - desk_d + 0.03, y_max=back - 0.22)
    return centred(
        assemble(
            "desk", (sampler.wood(), boards), (frame(sampler), poles), support_surfaces=(surface,)
        )
    )


def sawhorses(sampler: Sampler) -> Model:
    """A loose board on two sawhorses of four leaning legs, with a riser or a drawer."""
    width, depth, height = sampler.size(1.2, 1.7), sampler.size(0.6, 0.78), sampler.size(0.71, 0.76)
    thick, bar = sampler.uniform(0.016, 0.04), sampler.uniform(0.028, 0.045)
    under, at = height - thick, width / 2 - sampler.uniform(0.2, 0.32)
    bars: list[Mesh] = []
    shelf: list[Mesh] = []
    spread = sampler.uniform(0.1, 0.2)
    for s in SIDES:
        x = s * at
        bars.append(box((bar * 1.4, depth - 0.04, 0.06), (x, 0, under - 0.06)))
        for side in SIDES:
            for end in SIDES:
                y = end * (depth / 2 - 0.07)
                foot = (x + side * spread, y, 0.0)
                bars.append(stretch((bar, bar), foot, (x + side * 0.02, y * 0.9), under - 0.03))
            low = (x + side * spread * 0.72, 0.0, under * 0.3)
            bars.append(box((0.018, depth - 0.16, 0.05), low))
        for end in SIDES:
            bars.append(
                box((spread * 1.4, 0.018, 0.05), (x, end * (depth / 2 - 0.085), under * 0.36))
            )
        if sampler.chance(0.4):
            shelf.append(box((spread * 1.5, depth - 0.12, 0.016), (x, 0, under * 0.3 + 0.1)))
    top = [box((width, depth, thick), (0, 0, under))]
    handles: list[Mesh] = []
    if sampler.chance(0.5):
        wide, back = width * sampler.uniform(0.4, 0.9), depth / 2 - 0.13
        top.append(box((wide, 0.22, 0.018), (0, back, height + 0.11)))
        for x in np.linspace(-wide / 2 + 0.02, wide / 2 - 0.02, sampler.integer(2, 4)).tolist():
            top.append(box((0.018, 0.21, 0.112), (x, back, height - 0.001)))
    else:
        wide = 2 * (at - spread) - 0.05
        shelf.append(box((wide, depth * 0.7, 0.09), (0, -0.03, under - 0.089)))
        shelf += drawer((wide - 0.03, 0.075), (0, -0.03 - depth * 0.35, under - 0.084))
        handles = pulls(
            sampler.choice(HANDLES), (0, -0.05 - depth * 0.35, under - 0.045), wide, 0.09
        )
    surface = support_surface(width, depth, height)._replace(y_max=depth / 2 - 0.26)
    return assemble(
        "desk",
        (board(sampler), [*top, *shelf]),
        (frame(sampler), bars),
        (sampler.metal(), handles),
        support_surfaces=(surface,),
    )


def drafting(sampler: Sampler) -> Model:
    """A drawing desk: a large tilted board with a pencil ledge on a steel or wooden stand."""
    width, depth, height = sampler.size(0.9, 1.3), sampler.size(0.6, 0.8), sampler.size(0.74, 0.86)
    tilt, bar = sampler.uniform(8, 32), sampler.uniform(0.03, 0.05)
    plate = box((width, depth, 0.022), (0, 0, -0.011)).rotated("x", tilt).translated(0, 0, height)
    drop, run = (
        float(np.sin(np.radians(tilt))) * depth / 2,
        float(np.cos(np.radians(tilt))) * depth / 2,
    )
    ledge = box((width * 0.9, 0.03, 0.05), (0, -run - 0.012, height - drop - 0.02))
    legs: list[Mesh] = []
    at, crossing = width / 2 - 0.1, sampler.chance(0.5)
    for s in SIDES:
        x = s * at
        legs.append(box((bar, depth * 0.9, 0.04), (x, 0, 0)))
        if crossing:
            legs.append(
                stretch(
                    (bar * 0.9, bar),
                    (x, -depth * 0.38, 0.02),
                    (x, run * 0.7),
                    height + drop * 0.6 - 0.04,
                )
            )
            legs.append(
                stretch(
                    (bar * 0.8, bar),
                    (x, depth * 0.38, 0.02),
                    (x, -run * 0.7),
                    height - drop * 0.75 - 0.04,
                )
            )
        else:
            legs.append(box((bar * 0.9, 0.1, height - 0.04), (x, 0, 0.02)))
            legs.append(box((bar, 0.16, 0.1), (x, 0, height - 0.13)))
    legs.append(box((2 * at, 0.03, 0.05), (0, depth * 0.05, 0.16)))
    tray: list[Mesh] = []
    if sampler.chance(0.4):
        tray = [box_between((at + 0.05, -0.2, height * 0.7), (at + 0.3, 0.2, height * 0.7 + 0.08))]
        tray.append(box((2 * at + 0.12, 0.03, 0.03), (0, 0, height * 0.7 + 0.02)))
    return centred(
        assemble(
            "desk",
            (board(sampler), [plate]),
            (frame(sampler), legs),
            (sampler.metal(), [ledge, *tray]),
        )
    )


DESIGNS: dict[str, tuple[ModelFactory, ...]] = {
    "desk": (student, ladder, sawhorses, drafting),
}
