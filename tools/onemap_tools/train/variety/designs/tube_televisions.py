"""Older televisions: with a picture tube, portable, wooden on legs, early flat ones."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import (
    Mesh,
    box,
    cylinder,
    front_panel,
    prism,
    rod,
    rounded_box,
    tube,
)
from onemap_simulator.generation.model import Model
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.flat_forms import ellipse_outline, settled, skin, window
from onemap_tools.train.variety.designs.televisions import Size, casing_of, picture_of


def _tube_case(size: Size, depth: float, z: float) -> list[Mesh]:
    """A picture tube's case: a box in front and a back that narrows to the neck."""
    width, front, height = size
    rings = np.empty((4, 4, 3))
    steps = ((1.0, front), (0.94, front + 0.04), (0.62, depth * 0.85), (0.5, depth))
    for ring, (share, y) in zip(rings, steps, strict=True):
        x, low, high = width / 2 * share, height * (1 - share) * 0.35, height * (1 + share) / 2
        ring[:] = [(x, y, low), (x, y, high), (-x, y, high), (-x, y, low)]
    back = skin(rings[:, ::-1])
    case = box((width, front, height), (0, front / 2, 0))
    return [mesh.translated(0, -depth / 2, z) for mesh in (case, back)]


def tube_set(sampler: Sampler) -> Model:
    """A picture tube set: deep case that narrows behind, on a base or small feet."""
    width, depth = sampler.size(0.45, 0.8), sampler.size(0.38, 0.5)
    height, lift = width * sampler.uniform(0.78, 0.92), sampler.choice((0.015, 0.04))
    case = _tube_case((width, sampler.uniform(0.1, 0.2), height), depth, lift)
    base = [box((width * 0.75, depth * 0.7, lift + 0.004))]
    rim = sampler.uniform(0.03, 0.06)
    front = -depth / 2
    low = lift + height * sampler.uniform(0.12, 0.22)
    screen = (width - 2 * rim, height + lift - low - rim)
    frame = window((screen[0] + 0.03, screen[1] + 0.03), 0.02, 0.02, front + 0.004)
    glass = front_panel(screen[0] - 0.008, screen[1] - 0.008, (0, front - 0.006, low + 0.004))
    knobs: list[Mesh] = []
    for index in range(sampler.integer(2, 6)):
        x = width * 0.42 - index * 0.04
        knobs.append(box((0.025, 0.014, 0.012), (x, front - 0.004, lift + 0.03)))
    if sampler.chance(0.5):
        knobs += [
            box((width * 0.3, 0.01, 0.006), (-width * 0.25, front - 0.003, lift + 0.02 + i * 0.013))
            for i in range(3)
        ]
    return settled(
        "television",
        (casing_of(sampler), [*case, *base]),
        (sampler.dark(), [frame.translated(0, 0, low - 0.015)]),
        (sampler.metal(), knobs),
        (picture_of(sampler), [glass]),
    )


def portable_set(sampler: Sampler) -> Model:
    """A small portable set: screen beside a panel of dials, carrying handle, rod antenna."""
    width, height = sampler.size(0.38, 0.52), sampler.size(0.28, 0.36)
    depth, lift = sampler.size(0.26, 0.36), 0.02
    body = rounded_box((width, depth, height), (0, 0, lift), sampler.uniform(0.02, 0.06))
    feet = [
        cylinder(0.015, 0.03, (x * width * 0.35, y * depth * 0.3, 0), 8)
        for x in (-1, 1)
        for y in (-1, 1)
    ]
    front, panel_w = -depth / 2, width * 0.24
    trim: list[Mesh] = []
    x = width / 2 - panel_w / 2 - 0.02
    for index in range(sampler.integer(1, 2)):
        dial = cylinder(panel_w * 0.36, 0.03, segments=14).rotated("x", 90)
        trim.append(dial.translated(x, front + 0.006, lift + height * (0.78 - 0.26 * index)))
    trim += [
        box((panel_w * 0.8, 0.01, 0.006), (x, front, lift + height * 0.12 + index * 0.015))
        for index in range(4)
    ]
    top = lift + height
    grip = [(-width * 0.25, 0, top - 0.01), (-width * 0.22, 0, top + 0.05)]
    trim.append(tube([*grip, (width * 0.22, 0, top + 0.05), (width * 0.25, 0, top - 0.01)], 0.01))
    for side in (-1, 1) if sampler.chance(0.6) else (1,):
        high = (side * sampler.uniform(0.1, 0.2), 0.08, top + sampler.uniform(0.18, 0.35))
        trim.append(rod((0.0, 0.08, top - 0.01), high, 0.004, 5))
    screen = (width - panel_w - 0.07, height - 0.06)
    middle = -width / 2 + 0.025 + screen[0] / 2
    rim = window((screen[0] + 0.02, screen[1] + 0.02), 0.014, 0.02, front + 0.008)
    glass = front_panel(screen[0], screen[1], (middle, front - 0.008, lift + 0.03))
    return settled(
        "television",
        (sampler.plastic() if sampler.chance(0.6) else sampler.wood(), [body]),
        (sampler.dark(), [*feet, rim.translated(middle, 0, lift + 0.02)]),
        (sampler.metal(), trim),
        (picture_of(sampler), [glass]),
    )


def console_set(sampler: Sampler) -> Model:
    """A wooden set of the 1960s on tapered legs, with cloth below or beside the tube and knobs."""
    width, height, depth = (
        sampler.size(0.6, 0.95),
        sampler.size(0.5, 0.62),
        sampler.size(0.36, 0.46),
    )
    legs_h = sampler.uniform(0.18, 0.4)
    front = -depth / 2
    case = [box((width, depth, height), (0, 0, legs_h))]
    legs = [
        rod(
            (x * width * 0.46, y * depth * 0.46, 0.004),
            (x * width * 0.4, y * depth * 0.36, legs_h + 0.01),
            0.016,
        )
        for x in (-1, 1)
        for y in (-1, 1)
    ]
    rim = window((width, height), 0.03, 0.016, front + 0.002).translated(0, 0, legs_h)
    case.append(rim)
    screen_w = width * sampler.uniform(0.58, 0.68)
    screen_h = min(screen_w * 0.78, height - 0.1)
    x = -width / 2 + 0.045 + screen_w / 2
    low = legs_h + height - 0.045 - screen_h
    mask = window((screen_w + 0.01, screen_h + 0.01), 0.016, 0.02, front + 0.002)
    glass = front_panel(screen_w - 0.015, screen_h - 0.015, (x, front - 0.012, low + 0.007))
    side_w = width - screen_w - 0.115
    side_x = width / 2 - 0.045 - side_w / 2
    cloth = [box((side_w, 0.012, height * 0.45), (side_x, front, legs_h + 0.05))]
    knobs = []
    for index in range(sampler.integer(2, 3)):
        knob = cylinder(side_w * 0.22, 0.03, segments=12).rotated("x", 90)
        knobs.append(knob.translated(side_x, front + 0.004, legs_h + height - 0.1 - index * 0.09))
    return settled(
        "television",
        (sampler.wood(), [*case, *legs]),
        (sampler.fabric(), cloth),
        (sampler.metal(), [*knobs, mask.translated(x, 0, low - 0.005)]),
        (picture_of(sampler), [glass]),
    )


def thick_flat(sampler: Sampler) -> Model:
    """An early flat screen: thick, a rounded back, wide bezel, loudspeakers beside or below."""
    width = sampler.size(0.6, 1.1)
    bezel, deep = sampler.uniform(0.03, 0.06), sampler.uniform(0.09, 0.16)
    below = sampler.chance(0.5)
    strip = sampler.uniform(0.06, 0.1)
    screen_w = width - 2 * bezel - (0 if below else 2 * strip)
    screen_h = screen_w * sampler.choice((0.5625, 0.62, 0.75))
    height = screen_h + 2 * bezel + (strip if below else 0)
    lift = sampler.uniform(0.05, 0.12)
    front = -deep / 2
    body = [
        rounded_box((width, 0.06, height), (0, front + 0.03, lift), 0.018),
        rounded_box((width * 0.86, deep - 0.02, height * 0.8), (0, 0.02, lift + 0.06), 0.05),
    ]
    bottom = lift + bezel + (strip if below else 0)
    if below:
        grille = [box((screen_w, 0.012, strip * 0.6), (0, front - 0.004, lift + bezel * 0.6))]
    else:
        grille = [
            box(
                (strip * 0.7, 0.012, screen_h),
                (side * (screen_w + strip) / 2, front - 0.004, bottom),
            )
            for side in (-1, 1)
        ]
    wide = width * sampler.uniform(0.35, 0.7)
    foot = [prism(ellipse_outline(wide, 0.28), 0.03), box((0.18, 0.06, lift), (0, 0.02, 0.02))]
    glass = front_panel(screen_w, screen_h, (0, front - 0.004, bottom))
    return settled(
        "television",
        (casing_of(sampler), [*body, *foot]),
        (sampler.metal() if sampler.chance(0.5) else sampler.dark(), grille),
        (picture_of(sampler), [glass]),
    )


DESIGNS: dict[str, tuple[ModelFactory, ...]] = {
    "television": (thick_flat, tube_set, portable_set, console_set)
}
