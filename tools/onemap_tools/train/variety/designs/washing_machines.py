"""Washing machines: top loaders, twin tubs, with a wringer; and front loaders."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import (
    Mesh,
    box,
    cylinder,
    ellipsoid,
    lathe,
    rounded_box,
    torus,
    tube,
)
from onemap_simulator.generation.model import Model, assemble, support_surface
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.appliance_parts import (
    centred,
    disc,
    feet,
    round_rect,
    rubber,
    slab,
    tilted,
)
from onemap_tools.train.variety.designs.front_loaders import (
    CATEGORY,
    front_loader,
    open_porthole,
    stacked,
)


def _rim(width: float, depth: float, deep: float, z: float) -> list[Mesh]:
    """The frame round a top loader's opening, with a ledge ``deep`` at the back."""
    rim_depth = depth - deep
    rim_y = -depth / 2 + rim_depth / 2
    frame = [box((0.05, rim_depth, 0.05), (x * (width / 2 - 0.025), rim_y, z)) for x in (-1, 1)]
    frame += [
        box((width - 0.1, 0.05, 0.05), (0, rim_y + d * (rim_depth / 2 - 0.025), z)) for d in (-1, 1)
    ]
    frame.append(box((width, deep, 0.05), (0, depth / 2 - deep / 2, z)))
    return frame


def top_loader(sampler: Sampler) -> Model:
    """A top loader: a lid, shut or up, before a raised console with dials at the back."""
    width = sampler.choice([sampler.size(0.4, 0.46), sampler.size(0.56, 0.68)])
    depth = sampler.size(0.56, 0.66)
    body, rise = sampler.size(0.82, 0.92), sampler.uniform(0.1, 0.2)
    y, back, low = -depth / 2, depth / 2, 0.03
    shape_top = body - 0.05
    casing = [rounded_box((width, depth, shape_top - low), (0, 0, low), 0.02)]
    deep = 0.13
    rim_depth = depth - deep
    rim_y = y + rim_depth / 2
    frame = _rim(width, depth, deep, shape_top)
    panel = [rounded_box((width, deep - 0.01, rise), (0, back - deep / 2, body - 0.004), 0.02)]
    face = back - deep - 0.002
    knobs = [
        disc(sampler.uniform(0.02, 0.035), 0.03, (float(x), face + 0.008, body + rise * 0.5), 14)
        for x in np.linspace(-0.38, 0.38, sampler.integer(3, 5)) * width
    ]
    strip = [box((width * 0.94, 0.006, rise * 0.7), (0, face + 0.006, body + rise * 0.14))]
    is_open = sampler.chance(0.5)
    lid = [rounded_box((width - 0.07, rim_depth - 0.04, 0.022), (0, rim_y, body - 0.006), 0.008)]
    window = []
    if sampler.chance(0.6):
        window.append(
            rounded_box((width * 0.55, rim_depth * 0.6, 0.026), (0, rim_y, body - 0.005), 0.01)
        )
    lid.append(box((0.12, 0.02, 0.018), (0, y + 0.035, body + 0.006)))
    dark = feet(width, depth, low + 0.01, 0.025)
    drum: list[Mesh] = []
    if is_open:
        pivot = (back - deep - 0.03, body + 0.004)
        lid, window = tilted(lid, -82, pivot), tilted(window, -82, pivot)
        drum = [torus(min(width, rim_depth) * 0.36, 0.02, (0, rim_y, shape_top + 0.02), 20)]
        drum.append(
            lathe([(0.05, 0), (0.045, 0.03), (0.02, 0.055)], (0, rim_y, shape_top - 0.002), 10)
        )
    groups = [(sampler.metal(), drum)] if drum else []
    surface = () if is_open else (support_surface(width, rim_depth * 0.8, body + 0.018),)
    return assemble(
        CATEGORY,
        (sampler.enamel(), casing + frame),
        (sampler.enamel(), panel),
        (sampler.enamel(), lid),
        (sampler.dark(), strip + window),
        (sampler.metal(), knobs),
        (rubber(sampler), dark),
        *groups,
        support_surfaces=surface,
    )


def twin_tub(sampler: Sampler) -> Model:
    """A retro twin tub: a wide wash lid and a spin lid side by side, a back panel, a hose."""
    width, depth = sampler.size(0.66, 0.84), sampler.size(0.4, 0.52)
    height, y, low = sampler.size(0.72, 0.86), -depth / 2, sampler.uniform(0.04, 0.09)
    back = 0.1
    outline = round_rect(width, height - low, 0.03, sampler.uniform(0.02, 0.07))
    casing = [slab(outline, depth, (0, depth / 2, low))]
    seam = width * sampler.uniform(0.05, 0.14)
    lids, knobs = [], []
    for x0, x1 in ((-width / 2 + 0.03, seam), (seam, width / 2 - 0.03)):
        size = (x1 - x0 - 0.02, depth - back - 0.06, 0.035)
        at = ((x0 + x1) / 2, y + 0.02 + size[1] / 2 + 0.01, height - 0.008)
        lids.append(rounded_box(size, at, 0.015))
        knobs.append(box((size[0] * 0.35, 0.03, 0.025), (at[0], y + 0.05, height + 0.024)))
    rise = sampler.uniform(0.06, 0.14)
    panel = [
        rounded_box(
            (width * 0.98, back, rise), (0, depth / 2 - back / 2 - 0.004, height - 0.01), 0.02
        )
    ]
    for x in np.linspace(-0.36, 0.36, sampler.integer(3, 4)) * width:
        turn = disc(0.028, 0.03, (float(x), depth / 2 - back, height + rise * 0.45), 14)
        knobs.append(turn)
    band = [
        box(
            (width - 0.06, 0.012, sampler.uniform(0.03, 0.1)),
            (0, y, height * sampler.uniform(0.45, 0.7)),
        )
    ]
    band.append(box((0.012, 0.01, height - low - 0.12), (seam, y, low + 0.04)))
    curve = np.linspace(0, np.pi, 8)
    x = width / 2 - 0.02
    hose = [(x + 0.05 * np.sin(a), depth / 2 - 0.06, low + 0.2 + 0.3 * a / np.pi) for a in curve]
    dark = [tube(hose, 0.014)]
    dark += feet(width, depth, low + 0.035, 0.025)
    dark.append(box((width - 0.1, depth - 0.1, 0.03), (0, 0, low - 0.01)))
    return centred(
        assemble(
            CATEGORY,
            (sampler.enamel(), casing),
            (sampler.enamel(), lids),
            (sampler.enamel(), panel),
            (sampler.metal(), band),
            (sampler.plastic(), knobs),
            (rubber(sampler), dark),
        )
    )


def _mangle(side: float, top: float) -> tuple[list[Mesh], list[Mesh], list[Mesh]]:
    """A wringer behind a tub, y = ``side``, whose rim is at ``top``: its arm, rolls and crank."""
    arm = []
    arm.append(box((0.07, 0.07, 0.24), (0, side, top - 0.02)))
    for x in (-0.19, 0.19):
        arm.append(box((0.035, 0.1, 0.2), (x, side - 0.02, top + 0.2)))
    arm.append(rounded_box((0.42, 0.09, 0.04), (0, side - 0.02, top + 0.38), 0.015))
    arm.append(box((0.42, 0.08, 0.03), (0, side - 0.02, top + 0.19)))
    rolls = [
        cylinder(0.028, 0.37, segments=10).rotated("y", 90).translated(-0.185, side - 0.02, top + h)
        for h in (0.265, 0.325)
    ]
    crank = [
        tube(
            [
                (0.2, side - 0.02, top + 0.32),
                (0.25, side - 0.02, top + 0.32),
                (0.255, side - 0.02, top + 0.18),
                (0.3, side - 0.02, top + 0.18),
            ],
            0.009,
        )
    ]
    return arm, rolls, crank


def wringer(sampler: Sampler) -> Model:
    """An early round tub on legs with castors, a ribbed body and a mangle on an arm."""
    radius, low = sampler.size(0.24, 0.31), sampler.uniform(0.18, 0.3)
    tall = sampler.uniform(0.42, 0.55)
    bulge = sampler.uniform(1.0, 1.08)
    profile = [(radius * 0.8, 0.0), (radius, 0.06), (radius * bulge, tall * 0.5), (radius, tall)]
    tub = [lathe(profile, (0, 0, low), 22)]
    bands = [torus(radius * 1.02, 0.012, (0, 0, low + tall * share), 22) for share in (0.12, 0.98)]
    top = low + tall
    lid = [
        lathe([(radius, 0), (radius * 0.9, 0.03), (radius * 0.3, 0.05)], (0, 0, top + 0.006), 22)
    ]
    lid.append(cylinder(0.03, 0.04, (0, 0, top + 0.05), 10))
    legs = []
    for turn in np.radians([45, 135, 225, 315]):
        x, z = radius * 0.86 * float(np.cos(turn)), radius * 0.86 * float(np.sin(turn))
        legs.append(
            tube(
                [(x, z, low + 0.1), (x * 1.1, z * 1.1, low * 0.5), (x * 1.18, z * 1.18, 0.04)],
                0.018,
            )
        )
        legs.append(ellipsoid((0.026, 0.026, 0.026), (x * 1.18, z * 1.18, 0.026), 8))
    side = radius * 0.95
    arm, rolls, crank = _mangle(side, top)
    return centred(
        assemble(
            CATEGORY,
            (sampler.enamel(), tub),
            (sampler.metal(), bands + crank),
            (sampler.enamel(), lid),
            (sampler.metal(), legs),
            (sampler.enamel(), arm),
            (rubber(sampler), rolls),
        )
    )


DESIGNS: dict[str, tuple[ModelFactory, ...]] = {
    CATEGORY: (front_loader, top_loader, stacked, open_porthole, twin_tub, wringer)
}
