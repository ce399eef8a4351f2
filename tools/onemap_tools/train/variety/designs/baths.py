"""Bathtubs of many makes; x is the length, the wall is at +y."""

from __future__ import annotations

import numpy as np

from onemap_shared.geometry import F64
from onemap_simulator.generation.mesh import (
    Mesh,
    box,
    cone,
    cylinder,
    ellipsoid,
    lathe,
    rod,
    rounded_box,
    tube,
)
from onemap_simulator.generation.model import Model
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.bath_parts import (
    bath_extras,
    bath_size,
    floor_tap,
    oval_tub,
    raised_ends,
    tap_on_rim,
)
from onemap_tools.train.variety.designs.baths_built_in import built_in, tiled_surround, with_screen
from onemap_tools.train.variety.designs.baths_wooden import japanese_deep
from onemap_tools.train.variety.designs.sanitary import faucet, rim, ring, shell, skin, stand
from onemap_tools.train.variety.designs.shower_parts import corner_outline


def clawfoot(sampler: Sampler) -> Model:
    """A cast-iron bath with a rolled rim on four claw feet, often raised at one end."""
    length, width, height = bath_size(sampler)
    lift, power = sampler.size(0.1, 0.18), sampler.uniform(2.0, 2.8)
    size = (length, width)
    body = [oval_tub(size, height, power, sampler.uniform(0.55, 0.7), lift - 0.02)]
    roll = [rim(size, height, sampler.uniform(0.02, 0.032), power)]
    raised = sampler.choice((0.0, sampler.uniform(0.12, 0.3)))
    both = sampler.chance(0.3)
    body, roll = raised_ends(body, length, raised, both), raised_ends(roll, length, raised, both)
    feet: list[Mesh] = []
    for sx in (-1, 1):
        for sy in (-1, 1):
            x, y = sx * length * 0.27, sy * width * 0.24
            out = [(x, y, lift + 0.1), (x * 1.1, y * 1.25, lift * 0.7), (x * 1.08, y * 1.2, 0.04)]
            feet += [
                tube(out, 0.026, 8),
                ellipsoid((0.042, 0.042, 0.035), (x * 1.08, y * 1.22, 0.035), 10),
            ]
    metal = floor_tap(
        sampler, (sampler.uniform(-0.2, 0.0) * length, width / 2 + 0.06), height + 0.1
    )
    inner = sampler.ceramic()
    outer = inner if sampler.chance(0.5) else sampler.enamel()
    return stand(
        "bathtub",
        (outer, body),
        (inner, roll),
        (sampler.metal(), feet),
        (sampler.metal(), metal),
        *bath_extras(sampler, size, height),
    )


def freestanding(sampler: Sampler) -> Model:
    """A modern bath without feet: an egg, a boat or a soft block, thin or thick at the rim."""
    length, width, height = bath_size(sampler)
    size, power = (length, width), sampler.choice((2.0, 2.3, 3.0, 5.0))
    shape = sampler.choice(((0.75, 0.86), (0.95, 0.94), (0.85, 0.78), (1.04, 1.08)))
    edge = sampler.uniform(0.02, 0.08)
    outside = [(shape[0], 0.0), (shape[1], height * 0.45), (1.0, height - 0.02), (1.0, height)]
    inside = [(1 - edge, height), (0.86 - edge, height * 0.45), (0.62, 0.16), (0.0, 0.14)]
    body = [shell([*outside, *inside], size, power)]
    raised = sampler.choice((0.0, 0.0, sampler.uniform(0.1, 0.35)))
    body = raised_ends(body, length, raised, sampler.chance(0.6))
    ceramic = sampler.ceramic()
    base: list[Mesh] = []
    if sampler.chance(0.35):
        base = [shell([(shape[0] * 1.06, 0.0), (shape[0] * 1.03, 0.06)], size, power)]
    tap = floor_tap(sampler, (0.0, width / 2 + 0.09), height + sampler.uniform(0.12, 0.3))
    if sampler.chance(0.3):
        tap = tap_on_rim(sampler, -length / 2 + 0.03, height)
    return stand(
        "bathtub",
        (ceramic, body),
        (sampler.wood() if sampler.chance(0.5) else sampler.metal(), base),
        (sampler.metal(), tap),
        *bath_extras(sampler, size, height),
    )


def corner_bath(sampler: Sampler) -> Model:
    """A bath for a corner: two straight sides on the walls, a bowed front with an apron."""
    side, height = sampler.size(1.2, 1.5), sampler.size(0.5, 0.62)
    bow = sampler.uniform(0.72, 1.0)
    outer = corner_outline(side, bow)

    def at(scale: float, z: float) -> F64:
        return np.concatenate([outer * scale, np.full((len(outer), 1), z)], axis=1)

    lip = [at(0.98, height - 0.06), at(1.0, height - 0.05), at(1.0, height), at(0.84, height)]
    inside = [at(0.8, height - 0.04), at(0.62, 0.2), at(0.3, 0.18)]
    apron = skin([at(0.94, 0.0), at(0.97, height - 0.055)], capped=False)
    body = [skin([*lip, *inside], capped=False), skin([at(0.35, 0.16), at(0.35, 0.182)])]
    seat = rounded_box((side * 0.3, side * 0.2, 0.2), (0, 0, 0.17), 0.06).rotated("z", 45)
    body.append(seat.translated(-side * 0.19, side * 0.19, 0))
    jets = [
        cylinder(0.03, 0.012, (x * side, y * side, 0.185), 10)
        for x, y in ((0.0, 0.0), (0.14, 0.05), (-0.05, -0.14))
    ]
    tap = [m.rotated("z", 45) for m in faucet(sampler, (0, 0, 0))]
    tap = [m.translated(-side * 0.41, side * 0.41, height) for m in tap]
    ceramic = sampler.ceramic()
    skirt = ceramic if sampler.chance(0.5) else sampler.wood()
    pillow = rounded_box((0.3, 0.07, 0.1), (0, 0, height - 0.03), 0.03).translated(
        0, side * 0.38, 0
    )
    return stand(
        "bathtub",
        (ceramic, body),
        (skirt, [apron]),
        (sampler.metal(), [*tap, *jets]),
        (sampler.plastic(), [pillow] if sampler.chance(0.5) else []),
    )


def rolled_rim(sampler: Sampler) -> Model:
    """An enamelled bath, straight at the tap and round at the head, on turned legs or cradles."""
    length, width, height = bath_size(sampler)
    size, lift = (width, length), sampler.size(0.1, 0.2)
    power = sampler.uniform(2.0, 2.6)
    shares = [
        (0.7, lift),
        (0.78, lift + 0.06),
        (0.95, height - 0.05),
        (1.0, height),
        (0.94, height),
    ]
    inside = [(0.86, height - 0.12), (0.7, lift + 0.1), (0.0, lift + 0.08)]
    tub = shell([*shares, *inside], size, power, 7.0)
    roll = tube(ring(size, height, power, 7.0), sampler.uniform(0.022, 0.035), 6, closed=True)
    body = [m.rotated("z", 90) for m in (tub, roll)]
    feet: list[Mesh] = []
    if sampler.chance(0.35):
        for x in (-length * 0.27, length * 0.25):
            feet += [
                box((0.09, width * 0.75, lift + 0.03), (x, 0, 0)),
                box((0.07, width * 0.9, 0.04), (x, 0, 0)),
            ]
    else:
        for x in (-length * 0.28, length * 0.26):
            for y in (-width * 0.24, width * 0.24):
                turned = [
                    (0.035, 0),
                    (0.045, 0.02),
                    (0.02, lift * 0.5),
                    (0.05, lift),
                    (0.05, lift + 0.05),
                ]
                feet.append(
                    lathe(turned, (x, y, 0), 10)
                    if sampler.chance(0.9)
                    else cone((0.02, 0.04), lift + 0.05, (x, y, 0))
                )
    pipe = rod((-length * 0.36, 0, 0), (-length * 0.36, 0, lift + 0.03), 0.022)
    tap = tap_on_rim(sampler, -length / 2 + 0.02, height + 0.02)
    return stand(
        "bathtub",
        (sampler.ceramic() if sampler.chance(0.7) else sampler.metal(), body),
        (sampler.metal() if sampler.chance(0.6) else sampler.wood(), feet),
        (sampler.metal(), [*tap, pipe]),
        *bath_extras(sampler, (length, width), height + 0.02),
    )


DESIGNS: dict[str, tuple[ModelFactory, ...]] = {
    "bathtub": (
        clawfoot,
        freestanding,
        built_in,
        tiled_surround,
        corner_bath,
        with_screen,
        rolled_rim,
        japanese_deep,
    )
}
