"""Narrow wall shelves: ledges for pictures, hall boards with pegs."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import (
    Mesh,
    box,
    cylinder,
    rod,
)
from onemap_simulator.generation.model import Model, assemble, support_surface
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.joinery import (
    Outline,
    moulding,
)

NAME = "shelf"


def picture_ledge(sampler: Sampler) -> Model:
    """Thin ledges with a lip in front and a low back."""
    width, depth = sampler.size(0.5, 1.3), sampler.size(0.09, 0.15)
    t, lip, back = (
        sampler.uniform(0.01, 0.02),
        sampler.uniform(0.02, 0.05),
        sampler.uniform(0.04, 0.1),
    )
    count, gap = sampler.integer(1, 4), sampler.uniform(0.22, 0.35)
    meshes: list[Mesh] = []
    for k in range(count):
        z = k * gap
        meshes.append(box((width, depth, t), (0, 0, z)))
        meshes.append(box((width, t, lip), (0, t / 2 - depth / 2, z + t)))
        meshes.append(box((width, t, back), (0, depth / 2 - t / 2, z + t)))
    if sampler.chance(0.4):
        sides = [box((t, depth, (count - 1) * gap + back + t)) for _ in range(2)]
        meshes += [
            m.translated(s * (width + t) / 2, 0) for m, s in zip(sides, (-1, 1), strict=True)
        ]
    tops = tuple(support_surface(width, depth - 2 * t, k * gap + t, 0.01) for k in range(count))
    wood = sampler.wood() if sampler.chance(0.6) else sampler.plastic()
    return assemble(NAME, (wood, meshes), support_surfaces=tops)


def hooked_board(sampler: Sampler) -> Model:
    """A hall shelf: a board on a back plate with a row of pegs or a towel bar below."""
    width, depth, t = (
        sampler.size(0.45, 1.1),
        sampler.size(0.16, 0.26),
        sampler.uniform(0.018, 0.03),
    )
    plate, b = sampler.uniform(0.1, 0.2), depth / 2
    board = [box((width, depth, t), (0, 0, plate))]
    board.append(box((width - 0.04, 0.018, plate), (0, b - 0.009, 0)))
    side: Outline = [(b - 0.019, 0.0), (b - 0.019, plate), (-b * 0.8, plate), (b - 0.06, 0.02)]
    board += [moulding(side, 0.018).translated(s * (width / 2 - 0.04), 0) for s in (-1, 1)]
    metal: list[Mesh] = []
    if sampler.chance(0.6):
        for x in np.linspace(-width * 0.38, width * 0.38, sampler.integer(3, 7)).tolist():
            peg = cylinder(0.009, 0.06, segments=8).rotated("x", 70)
            metal += [peg.translated(x, b - 0.018, plate * 0.35)]
    else:
        y, z = 0.0, plate * 0.4
        metal.append(rod((0.045 - width / 2, y, z), (width / 2 - 0.045, y, z), 0.01))
        metal += [
            rod((s * (width / 2 - 0.1), y, z), (s * (width / 2 - 0.1), b, z), 0.008)
            for s in (-1, 1)
        ]
    if sampler.chance(0.4):
        rail_z = plate + t + 0.05
        metal.append(
            rod(
                (-width / 2 + 0.02, 0.02 - b, rail_z),
                (width / 2 - 0.02, 0.02 - b, rail_z),
                0.005,
                6,
            )
        )
        metal += [
            rod((x, 0.02 - b, plate + t - 0.002), (x, 0.02 - b, rail_z), 0.005, 6)
            for x in np.linspace(-width / 2 + 0.02, width / 2 - 0.02, 4).tolist()
        ]
    top = (support_surface(width, depth, plate + t, 0.02),)
    return assemble(NAME, (sampler.wood(), board), (sampler.metal(), metal), support_surfaces=top)


LEDGES: tuple[ModelFactory, ...] = (picture_ledge, hooked_board)
