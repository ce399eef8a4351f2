"""Light nightstands: hung on the wall, woven, on one foot, made of something else."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import (
    Mesh,
    box,
    cylinder,
    lathe,
    rounded_box,
    torus,
)
from onemap_simulator.generation.model import Model, assemble, support_surface
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.joinery import (
    LEAF_M,
    case,
    grip,
    settled,
    upright_board,
)

NAME = "nightstand"


def hanging(sampler: Sampler) -> Model:
    """A drawer box hung on the wall, with a back board, an open slot or a rounded front."""
    width, depth, tall = (
        sampler.size(0.34, 0.55),
        sampler.size(0.24, 0.36),
        sampler.uniform(0.12, 0.3),
    )
    kind, held = sampler.integer(0, 2), grip(sampler, 0.05, 0.15)
    fronts: list[Mesh] = []
    handles: list[Mesh] = []
    body: list[Mesh] = []
    if kind == 0:
        body.append(box((width, depth - LEAF_M, tall), (0, LEAF_M / 2, 0)))
        rows = 2 if tall > 0.22 else 1
        for row in range(rows):
            z = row * tall / rows
            size = (width - 0.004, LEAF_M, tall / rows - 0.006)
            fronts.append(box(size, (0, LEAF_M / 2 - depth / 2, z + 0.002)))
            if sampler.chance(0.6):
                handles += held.at(0, -depth / 2, z + tall / rows / 2, upright=False)
    elif kind == 1:
        body += case((width, depth, tall), 0.018)
        if tall > 0.2:
            fronts.append(
                box((width - 0.04, LEAF_M, tall * 0.45), (0, LEAF_M / 2 - depth / 2 + 0.002, 0.02))
            )
            handles += held.at(0, 0.002 - depth / 2, tall * 0.25, upright=False)
            body.append(box((width - 0.04, depth - 0.01, 0.014), (0, 0.004, tall * 0.5 + 0.02)))
    else:
        soft = min(0.06, tall * 0.4)
        body.append(rounded_box((width, depth, tall), (0, 0, 0), soft))
        line = box((width - 0.06, 0.012, 0.008), (0, -depth / 2 + 0.003, tall * 0.55))
        fronts.append(line)
    if sampler.chance(0.4):
        board = (width + sampler.choice([0.0, 0.2]), 0.018, tall + sampler.uniform(0.1, 0.4))
        body.append(box(board, (0, depth / 2 + 0.008, 0)))
    wood = sampler.wood()
    return settled(
        assemble(
            NAME,
            (wood, body),
            (wood if sampler.chance(0.3) else sampler.wood(), fronts),
            (sampler.metal(), handles),
            support_surfaces=(support_surface(width, depth, tall),),
        )
    )


def pedestal(sampler: Sampler) -> Model:
    """A small table on one foot: turned column, tulip foot or three claws, perhaps a drawer."""
    width, height = sampler.size(0.32, 0.48), sampler.size(0.48, 0.66)
    r, t, kind = width / 2, sampler.uniform(0.015, 0.03), sampler.integer(0, 2)
    square = sampler.chance(0.35)
    drawer_h = sampler.uniform(0.09, 0.14) if sampler.chance(0.6) else 0.0
    low = height - t - drawer_h
    top = [rounded_box((width, width * 0.9, t), (0, 0, low + drawer_h), 0.008)]
    if not square:
        top = [cylinder(r, t, (0, 0, low + drawer_h), 24)]
    if drawer_h:
        top.append(box((width * 0.64, width * 0.62, drawer_h), (0, 0, low)))
    fronts = (
        [box((width * 0.56, 0.014, drawer_h - 0.02), (0, -width * 0.31, low + 0.01))]
        if drawer_h
        else []
    )
    handles = (
        grip(sampler, 0.05, 0.1).at(0, -width * 0.31 - 0.006, low + drawer_h / 2, upright=False)
        if drawer_h
        else []
    )
    foot = _one_foot(sampler, width, low, kind)
    wood = sampler.wood()
    return assemble(
        NAME,
        (wood, top),
        (sampler.wood() if sampler.chance(0.5) else sampler.metal(), foot),
        (wood if sampler.chance(0.5) else sampler.wood(), fronts),
        (sampler.metal(), handles),
        support_surfaces=(support_surface(width * 0.8, width * 0.75, height, 0.02),),
    )


def _one_foot(sampler: Sampler, width: float, low: float, kind: int) -> list[Mesh]:
    """A tulip foot, a turned column on three claws, or a post on a plate."""
    r = width / 2
    if kind == 0:
        foot = [
            lathe(
                [
                    (r * 0.75, 0.0),
                    (r * 0.7, 0.012),
                    (0.05, 0.06),
                    (0.025, low * 0.4),
                    (0.03, low * 0.75),
                    (r * 0.5, low),
                ],
                segments=18,
            )
        ]
    elif kind == 1:
        foot = [
            lathe(
                [
                    (0.05, 0.1),
                    (0.03, 0.15),
                    (0.045, low * 0.45),
                    (0.022, low * 0.6),
                    (0.035, low * 0.9),
                    (0.05, low),
                ],
                segments=14,
            )
        ]
        for k in range(3):
            claw = upright_board(
                [(0.0, 0.16), (0.02, 0.09), (r * 0.9, 0.0), (r, 0.0), (r, 0.03), (r * 0.5, 0.11)],
                0.03,
                0.015,
            )
            foot.append(claw.rotated("z", 120 * k + 30))
    else:
        foot = [rounded_box((width * 0.7, width * 0.65, 0.025), (0, 0, 0), 0.008)]
        foot.append(box((0.07, 0.07, low - 0.025), (0, 0, 0.025)))
        if sampler.chance(0.5):
            foot.append(box((width * 0.6, width * 0.55, 0.016), (0, 0, low * 0.5)))
    return foot


def woven_drum(sampler: Sampler) -> Model:
    """A woven round body, waisted or bellied, with a round plate on it."""
    radius, height = sampler.size(0.18, 0.24), sampler.size(0.42, 0.6)
    strands, t = sampler.integer(10, 18), 0.02
    pitch, waist = (height - t - 0.03) / strands, sampler.uniform(-0.22, 0.15)
    tall = height - t - 0.004
    profile = [
        (radius * 0.94 * (1 + waist * float(np.sin(np.pi * k / 8))), k / 8 * tall) for k in range(9)
    ]
    weave = [lathe(profile, segments=18)]
    for k in range(strands):
        swell = 1 + waist * float(np.sin(np.pi * (k + 0.5) / strands))
        at = (0.0, 0.0, 0.02 + (k + 0.5) * pitch)
        weave.append(torus(radius * 0.96 * swell, pitch * 0.42, at, 14))
    top = cylinder(radius * 1.06, t, (0, 0, height - t), 24)
    return assemble(
        NAME,
        (sampler.fabric(), weave),
        (sampler.wood(), [top]),
        support_surfaces=(support_surface(radius * 1.5, radius * 1.5, height, 0.01),),
    )


def woven_chest(sampler: Sampler) -> Model:
    """A frame of posts filled with strands, with basket drawers under a plate."""
    width, depth, height = (
        sampler.size(0.36, 0.48),
        sampler.size(0.32, 0.42),
        sampler.size(0.42, 0.62),
    )
    strands, t = sampler.integer(12, 22), 0.02
    pitch, rows = (height - t - 0.03) / strands, sampler.integer(1, 3)
    weave = [box((width - 0.05, depth - 0.04, height - t - 0.034), (0, 0, 0.031))]
    for k in range(strands):
        grow = 0.008 * (k % 2)
        size = (width - 0.03 + grow, depth - 0.02 + grow, pitch * 0.85)
        weave.append(box(size, (0, 0, 0.032 + k * pitch)))
    x, y = width / 2 - 0.014, depth / 2 - 0.014
    frame = [
        cylinder(0.016, height - t, (sx * x, sy * y, 0), 8) for sx in (-1, 1) for sy in (-1, 1)
    ]
    frame.append(rounded_box((width + 0.03, depth + 0.03, t), (0, 0, height - t), 0.008))
    fronts: list[Mesh] = []
    handles: list[Mesh] = []
    held, each = grip(sampler, 0.05, 0.12), (height - t - 0.06) / rows
    for row in range(rows):
        z = 0.045 + row * each
        fronts.append(rounded_box((width - 0.07, 0.02, each - 0.02), (0, -depth / 2, z), 0.008))
        handles += held.at(0, -depth / 2 - 0.009, z + each * 0.55, upright=False)
    straw = sampler.fabric()
    return assemble(
        NAME,
        (straw, weave),
        (sampler.wood(), frame),
        (straw if sampler.chance(0.5) else sampler.fabric(), fronts),
        (sampler.metal(), handles),
        support_surfaces=(support_surface(width, depth, height),),
    )


LIGHT_NIGHTSTANDS: tuple[ModelFactory, ...] = (hanging, woven_drum, woven_chest, pedestal)
