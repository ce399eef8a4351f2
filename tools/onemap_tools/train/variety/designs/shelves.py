"""Shelves on the wall and standing racks, empty, in other constructions than board and posts."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import (
    Mesh,
    box,
    rod,
    rounded_box,
    torus,
    tube,
)
from onemap_simulator.generation.model import Model, SupportSurface, assemble, support_surface
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.joinery import (
    Outline,
    case,
    moulding,
    settled,
    shifted,
)
from onemap_tools.train.variety.designs.ledges import LEDGES
from onemap_tools.train.variety.designs.racks import RACKS

NAME = "shelf"


def _level(x: float, width: float, depth: float, z: float) -> SupportSurface:
    """A support surface around x."""
    flat = support_surface(width, depth, z, 0.02)
    return flat._replace(x_min=flat.x_min + x, x_max=flat.x_max + x)


def bracket_board(sampler: Sampler) -> Model:
    """Boards on scrolled, triangular or strutted brackets."""
    width, depth, t = sampler.size(0.5, 1.4), sampler.size(0.18, 0.32), sampler.uniform(0.018, 0.05)
    drop, count = sampler.uniform(0.1, 0.24), sampler.integer(2, 3)
    levels = [drop + k * sampler.uniform(0.34, 0.42) for k in range(sampler.integer(1, 3))]
    kind, b, r = sampler.integer(0, 3), depth / 2, depth * 0.9
    brackets: list[Mesh] = []
    boards: list[Mesh] = []
    turn = np.linspace(0, np.pi / 2, 9)
    for z in levels:
        boards.append(rounded_box((width, depth, t), (0, 0, z), sampler.choice([0.002, 0.012])))
        for x in np.linspace(-width * 0.38, width * 0.38, count).tolist():
            if kind == 0:
                side: Outline = [
                    (b, -drop),
                    (b, 0.0),
                    (b - r, 0.0),
                    (b - r, -0.02),
                    (b - 0.03, -drop),
                ]
                made = [moulding(side, 0.02)]
            elif kind == 1:
                curve = [(0, b - r * float(np.cos(a)), -drop * float(np.sin(a))) for a in turn]
                made = [tube(curve, 0.008), rod((0, b, -drop), (0, b, 0), 0.01)]
                made += [rod((0, b, -0.01), (0, b - r, -0.01), 0.01)]
            elif kind == 2:
                made = [box((0.03, 0.01, drop), (0, b - 0.005, -drop))]
                made += [box((0.03, r, 0.008), (0, b - r / 2, -0.008))]
                made += [rod((0, b - 0.01, -drop * 0.8), (0, b - r * 0.8, -0.01), 0.007)]
            else:
                made = [box((0.025, 0.025, drop), (0, b - 0.0125, -drop))]
                made += [box((0.025, r, 0.03), (0, b - r / 2, -0.03))]
            brackets += shifted(made, x, 0, z)
        if sampler.chance(0.15):
            boards.append(box((width, 0.012, 0.08), (0, b - 0.007, z + t)))
    metal = sampler.metal() if sampler.chance(0.6) else sampler.wood()
    tops = tuple(support_surface(width, depth, z + t, 0.02) for z in levels)
    return settled(
        assemble(NAME, (sampler.wood(), boards), (metal, brackets), support_surfaces=tops)
    )


def floating_box(sampler: Sampler) -> Model:
    """Thick boards without visible brackets, or a shallow open box with partitions."""
    width, depth = sampler.size(0.5, 1.3), sampler.size(0.16, 0.28)
    wood = sampler.wood() if sampler.chance(0.7) else sampler.plastic()
    body: list[Mesh] = []
    tops: list[SupportSurface] = []
    if sampler.chance(0.45):
        t, z = sampler.uniform(0.035, 0.08), 0.0
        for _ in range(sampler.integer(1, 3)):
            wide = width * sampler.uniform(0.55, 1.0)
            x = 0.0 if not tops else sampler.uniform(-1, 1) * (width - wide) / 2
            wide = width if not tops else wide
            body.append(rounded_box((wide, depth, t), (x, 0, z), sampler.choice([0.002, 0.015])))
            tops.append(_level(x, wide, depth, z + t))
            z += sampler.uniform(0.24, 0.4)
        return assemble(NAME, (wood, body), support_surfaces=tuple(tops))
    t, tall = sampler.uniform(0.015, 0.03), sampler.uniform(0.2, 0.4)
    shell = case((width, depth, tall), t)
    panel = shell.pop()
    back = [panel] if sampler.chance(0.6) else []
    body += shell
    for k in range(1, sampler.integer(1, 4)):
        x = -width / 2 + k * sampler.uniform(0.2, 0.25) * width
        body.append(box((t, depth - 0.004, tall - 2 * t), (x, 0, t)))
    tops = [support_surface(width, depth, tall, 0.02)]
    return assemble(
        NAME,
        (wood, body),
        (wood if sampler.chance(0.5) else sampler.plastic(), back),
        support_surfaces=tuple(tops),
    )


def cube_cluster(sampler: Sampler) -> Model:
    """Open cubes of unlike sizes hung in a cluster, some of them six-sided."""
    depth, t = sampler.size(0.14, 0.26), sampler.uniform(0.01, 0.02)
    frames: list[list[Mesh]] = [[], []]
    tops: list[SupportSurface] = []
    if sampler.chance(0.4):
        side = sampler.uniform(0.16, 0.22)
        pitch, rise = side * 3**0.5, side * 1.5
        cells = [(0.0, 0), (1.0, 0), (0.5, 1), (1.5, 1), (-0.5, 1), (0.0, 2), (1.0, 2)]
        keep = cells[: sampler.integer(3, 7)]
        middle = (min(c for c, _ in keep) + max(c for c, _ in keep)) / 2
        for column, row in keep:
            at = ((column - middle) * pitch, row * rise + side)
            for k in range(6):
                plank = box((side * 0.97, depth, t), (0, 0, side * 3**0.5 / 2 - t))
                frames[(row + int(column)) % 2].append(
                    plank.rotated("y", 60 * k + 30).translated(at[0], 0, at[1])
                )
        model = assemble(NAME, (sampler.wood(), frames[0]), (sampler.wood(), frames[1]))
        return settled(model)
    x, columns = 0.0, sampler.integer(2, 3)
    for _ in range(columns):
        z, size = sampler.uniform(0.0, 0.15), sampler.uniform(0.24, 0.36)
        for _ in range(sampler.integer(1, 2)):
            tall = sampler.uniform(0.22, 0.38)
            shell = case((size, depth, tall), t)
            if sampler.chance(0.6):
                shell.pop()
            sampler.choice(frames).extend(shifted(shell, x + size / 2, 0, z))
            tops.append(_level(x + size / 2, size, depth, z + tall))
            z += tall + sampler.choice([0.002, 0.06])
        x += size + sampler.choice([0.002, 0.07])
    moved = [shifted(meshes, -x / 2, 0) for meshes in frames]
    levels = tuple(s._replace(x_min=s.x_min - x / 2, x_max=s.x_max - x / 2) for s in tops)
    first = sampler.wood()
    second = first if sampler.chance(0.4) else sampler.plastic()
    return settled(assemble(NAME, (first, moved[0]), (second, moved[1]), support_surfaces=levels))


def rail_ladder(sampler: Sampler) -> Model:
    """Boards hung between wire ladders, slotted rails or ropes."""
    width, depth = sampler.size(0.55, 1.1), sampler.size(0.18, 0.3)
    height, count = sampler.size(0.5, 1.3), sampler.integer(2, 4)
    bays, kind = sampler.integer(1, 2), sampler.integer(0, 2)
    t, b = sampler.uniform(0.015, 0.028), depth / 2
    wires: list[Mesh] = []
    boards: list[Mesh] = []
    tops: list[SupportSurface] = []
    zs = [0.06 + k * (height - 0.25) / max(count - 1, 1) for k in range(count)]
    total = bays * width
    for x in np.linspace(-total / 2, total / 2, bays + 1).tolist():
        if kind == 0:
            wires += [rod((x, y, 0), (x, y, height), 0.005, 6) for y in (b - 0.006, 0.006 - b)]
            rungs = np.linspace(0.004, height - 0.004, int(height / 0.09))
            wires += [rod((x, b, float(z)), (x, -b, float(z)), 0.003, 5) for z in rungs]
        elif kind == 1:
            wires.append(box((0.025, 0.014, height), (x, b - 0.007, 0)))
            for z in zs:
                arm: Outline = [(b, -0.06), (b, 0.0), (-b * 0.9, 0.0), (-b * 0.9, -0.015)]
                wires.append(moulding(arm, 0.006).translated(x, 0, z - 0.001))
        else:
            wires += [rod((x, y, 0), (x, 0, height), 0.006, 6) for y in (b - 0.02, 0.02 - b)]
            wires.append(torus(0.02, 0.006, segments=10).rotated("x", 90).translated(x, 0, height))
    pad = 0.03 if kind == 2 else -0.006
    for index, z in enumerate(zs):
        for bay in range(bays):
            if bays > 1 and index and sampler.chance(0.25):
                continue
            x = (bay + 0.5) * width - total / 2
            boards.append(box((width + pad, depth, t), (x, 0, z)))
            tops.append(_level(x, width - 0.04, depth, z + t))
    return settled(
        assemble(
            NAME,
            (sampler.wood(), boards),
            (sampler.metal(), wires),
            support_surfaces=tuple(tops),
        )
    )


DESIGNS: dict[str, tuple[ModelFactory, ...]] = {
    NAME: (
        bracket_board,
        floating_box,
        cube_cluster,
        rail_ladder,
        *LEDGES,
        *RACKS,
    )
}
