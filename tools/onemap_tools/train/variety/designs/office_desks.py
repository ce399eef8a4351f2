"""Desks of offices, each with its knee space open."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import (
    Mesh,
    Vec,
    box,
    cylinder,
    rounded_box,
    tube,
)
from onemap_simulator.generation.model import Model, assemble, support_surface
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.fronts import HANDLES, Block, drawer_block
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


def standing(sampler: Sampler) -> Model:
    """A motor desk on two telescopic columns with T or C feet, a cable tray and a switch."""
    width, depth, height = (
        sampler.size(1.2, 1.7),
        sampler.size(0.6, 0.8),
        sampler.uniform(0.68, 1.15),
    )
    thick, wide = sampler.uniform(0.02, 0.032), sampler.uniform(0.05, 0.09)
    under, at = height - thick, width * sampler.uniform(0.28, 0.38)
    top = [slab(racetrack(width, depth, sampler.choice([0.005, 0.05])), thick, under)]
    steel: list[Mesh] = []
    back = sampler.choice([0.0, depth * 0.12])
    for s in SIDES:
        x, stage = s * at, under * sampler.uniform(0.5, 0.6)
        steel.append(rounded_box((wide * 1.1, depth * 0.9, 0.035), (x, 0, 0.008), 0.012))
        steel += [cylinder(0.022, 0.01, (x, e * depth * 0.4, 0), 10) for e in SIDES]
        steel.append(box((wide, wide * 1.5, stage), (x, back, 0.03)))
        steel.append(box((wide * 0.8, wide * 1.25, under - stage - 0.02), (x, back, stage)))
        steel.append(box((wide * 0.8, depth * 0.8, 0.03), (x, 0, under - 0.03)))
    steel.append(box((2 * at, 0.05, 0.04), (0, back, under - 0.045)))
    dark = [
        rounded_box((0.11, 0.03, 0.025), (width * 0.36, -depth / 2 + 0.016, under - 0.026), 0.006)
    ]
    if sampler.chance(0.6):
        tray_y = depth / 2 - 0.12
        dark.append(box((at * 1.5, 0.1, 0.012), (0, tray_y, under - 0.13)))
        dark += [box((at * 1.5, 0.01, 0.07), (0, tray_y + e * 0.05, under - 0.13)) for e in SIDES]
        dark += [box((0.012, 0.1, 0.12), (s * at * 0.6, tray_y, under - 0.125)) for s in SIDES]
    if sampler.chance(0.4):
        sway = np.linspace(0, 1, 9)
        path = np.column_stack(
            [
                0.3 * at + 0.05 * np.sin(sway * 6),
                0 * sway + depth / 2 - 0.12,
                0.006 + (under - 0.14) * sway,
            ]
        )
        dark.append(tube(path, 0.005, 5))
    surface = support_surface(width, depth, height)
    return assemble(
        "desk",
        (board(sampler), top),
        (sampler.metal(), steel),
        (sampler.dark(), dark),
        support_surfaces=(surface,),
    )


def _riser(width: float, at: Vec) -> list[Mesh]:
    """A low shelf for a screen whose feet stand on ``at``."""
    x, y, z = at
    feet = [box((0.02, 0.23, 0.112), (x + s * (width / 2 - 0.02), y, z - 0.001)) for s in SIDES]
    return [box((width, 0.24, 0.02), (x, y, z + 0.11)), *feet]


def corner(sampler: Sampler) -> Model:
    """An L: a long top along the wall and a return at one side, on panels and drawers."""
    width, depth, height = sampler.size(1.3, 1.7), sampler.size(0.5, 0.62), sampler.size(0.72, 0.76)
    reach, arm, thick = (
        sampler.uniform(0.45, 0.8),
        sampler.uniform(0.45, 0.58),
        sampler.uniform(0.022, 0.04),
    )
    side, under = sampler.choice(SIDES), height - thick
    arm_x, arm_y = side * (width - arm) / 2, -depth / 2 - reach / 2
    top = [
        box((width, depth, thick), (0, 0, under)),
        box((arm, reach, thick), (arm_x, arm_y, under)),
    ]
    stand: list[Mesh] = []
    block = Block([], [], [])
    if sampler.chance(0.6):
        size = (0.38, depth - 0.04, under - 0.03)
        place = (-side * (width / 2 - 0.21), 0.0, 0.03)
        block = drawer_block(sampler, sampler.choice(HANDLES), size, place, sampler.integer(2, 4))
        stand.append(box((0.34, depth - 0.1, 0.035), (place[0], 0.02, 0)))
    else:
        stand.append(box((0.03, depth - 0.03, under), (-side * (width / 2 - 0.03), 0, 0)))
    low, high = -depth / 2 - reach + 0.05, depth / 2 - 0.05
    if sampler.chance(0.5):
        stand.append(box((arm - 0.03, 0.03, under), (arm_x, low - 0.02, 0)))
        stand.append(box((0.03, depth - 0.03, under), (side * (width / 2 - 0.03), 0, 0)))
    else:
        spots = [(arm_x + a, y, 0.0) for a, _ in corners(arm, arm, 0.05)[::2] for y in (low, high)]
        stand += [box((0.045, 0.045, under), spot) for spot in spots]
    stand.append(
        box((width - 0.1, 0.018, under * 0.45), (0, depth / 2 - 0.05, under * 0.55 - 0.002))
    )
    surface = support_surface(width, depth, height)
    if sampler.chance(0.35):
        top += _riser(width * 0.5, (side * width * 0.12, depth / 2 - 0.13, height))
        surface = surface._replace(y_max=depth / 2 - 0.27)
    return centred(
        assemble(
            "desk",
            (board(sampler), top),
            (frame(sampler), [*stand, *block.case]),
            (sampler.wood(), block.fronts),
            (sampler.metal(), block.handles),
            support_surfaces=(surface,),
        )
    )


def _steel_side(kind: int, x: float, size: Vec) -> list[Mesh]:
    """One end of a steel frame of (bar, depth, height): 0 a sled, 1 an A, 2 a portal."""
    bar, deep, under = size
    steel: list[Mesh] = []
    if kind == 0:
        steel += [box((bar, deep, bar), (x, 0, z)) for z in (0.0, under - bar)]
        steel.append(box((bar - 0.003, bar, under - 0.004), (x, deep / 2 - bar / 2 - 0.002, 0.002)))
    elif kind == 1:
        for e in SIDES:
            section = (bar + 0.003 * e, bar)
            steel.append(stretch(section, (x, e * deep / 2, 0), (x, e * 0.06), under))
        steel.append(box((bar - 0.006, deep * 0.75, bar), (x, 0, under * 0.25)))
        steel.append(box((bar + 0.01, deep * 0.8, bar), (x, 0, under - bar + 0.001)))
    else:
        steel += [box((bar, bar, under), (x, e * deep / 2, 0)) for e in SIDES]
        steel.append(box((bar - 0.004, deep, bar), (x, 0, under - bar - 0.002)))
    return steel


def glass_office(sampler: Sampler) -> Model:
    """A glass sheet on sled, A or portal frames of steel, with a drawer box on castors."""
    width, depth, height = sampler.size(1.2, 1.7), sampler.size(0.6, 0.8), sampler.size(0.72, 0.76)
    thick, bar, kind = (
        sampler.uniform(0.01, 0.016),
        sampler.uniform(0.025, 0.045),
        sampler.integer(0, 2),
    )
    under, at, deep = height - thick - 0.006, width / 2 - 0.1, depth - 0.1
    steel: list[Mesh] = []
    for s in SIDES:
        steel += _steel_side(kind, s * at, (bar, deep, under))
    steel.append(box((2 * at, 0.022, bar), (0, deep / 2 - 0.05, under - bar - 0.004)))
    pads = [
        cylinder(0.025, 0.008, (x, y, under - 0.001), 10) for x, y in corners(2 * at, deep * 0.9)
    ]
    block, wheels = Block([], [], []), list[Mesh]()
    if sampler.chance(0.6):
        x, tall = sampler.choice(SIDES) * (at - 0.27), under - sampler.uniform(0.14, 0.24)
        size = (0.38, min(depth - 0.16, 0.52), tall - 0.05)
        block = drawer_block(sampler, sampler.choice(HANDLES), size, (x, 0, 0.05), 3)
        for a, b in corners(0.38, size[1], 0.05):
            wheels.append(
                cylinder(0.026, 0.02, segments=10)
                .rotated("x", 90)
                .translated(x + a, b + 0.01, 0.026)
            )
    screen: list[Mesh] = []
    if not wheels or sampler.chance(0.4):
        screen = [box((2 * at - 0.1, 0.012, 0.28), (0, deep / 2 - 0.03, under - 0.34))]
    if not wheels:
        screen.append(box((0.62, 0.3, 0.02), (0, -depth / 2 + 0.22, under - 0.1)))
        screen += [
            box((0.02, 0.28, 0.1), (s * 0.3, -depth / 2 + 0.22, under - 0.095)) for s in SIDES
        ]
    surface = support_surface(width, depth, height)
    return assemble(
        "desk",
        (
            sampler.pale() if sampler.chance(0.5) else sampler.dark(),
            [slab(racetrack(width, depth, 0.02), thick, under + 0.006)],
        ),
        (sampler.metal(), [*steel, *block.handles]),
        (sampler.enamel(), [*block.case, *block.fronts, *screen]),
        (sampler.dark(), [*pads, *wheels]),
        support_surfaces=(surface,),
    )


DESIGNS: dict[str, tuple[ModelFactory, ...]] = {
    "desk": (
        standing,
        corner,
        glass_office,
    )
}
