"""Sofas whose frame is seen: slats, wooden arms, thin legs, steel tube."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import Mesh, box, cylinder, rod, rounded_box, tube
from onemap_simulator.generation.model import Model, assemble
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.feet import STEEL, feet
from onemap_tools.train.variety.designs.upholstery import (
    other,
    puff,
    roll,
    seat_area,
    settled,
    wall,
)


def futon(sampler: Sampler) -> Model:
    """A futon: one folded mattress over a frame of open wooden slats."""
    width, depth = sampler.size(1.35, 2.05), sampler.size(0.8, 0.95)
    seat, height, thick = (
        sampler.size(0.28, 0.36),
        sampler.size(0.75, 0.92),
        sampler.size(0.1, 0.17),
    )
    post, y = sampler.size(0.045, 0.07), depth / 2
    wood = [box((width, 0.03, 0.09), (0, -y + 0.1, seat - 0.1))]
    for at in np.linspace(-y + 0.16, y - 0.2, sampler.integer(3, 6)):
        wood.append(box((width - 0.02, 0.05, 0.02), (0, float(at), seat - 0.025)))
    slant, length = sampler.uniform(10, 20), height - seat
    back = [box((0.035, 0.04, length), (x, 0, 0)) for x in (-width / 2 + 0.1, 0, width / 2 - 0.1)]
    for z in np.linspace(0.06, length - 0.06, sampler.integer(3, 6)):
        back.append(box((width - 0.06, 0.018, 0.05), (0, -0.025, float(z))))
    soft = [puff((width - 0.03, depth - 0.16, thick), (0, -0.08, seat), 12, 4)]
    rest = puff((width - 0.03, thick, length + 0.03), (0, -0.04 - thick / 2, 0.04), 10, 5)
    place = (0.0, y - 0.16, seat - 0.02)
    wood += [m.rotated("x", -slant).translated(*place) for m in back]
    soft.append(rest.rotated("x", -slant).translated(*place))
    arm_z = seat + thick + sampler.uniform(0.08, 0.2)
    slats = sampler.integer(0, 5)
    for side in (-1, 1):
        x = side * (width / 2 + post / 2)
        for at_y in (-y + post, y - post):
            wood.append(box((post, post, arm_z - 0.02), (x, at_y, 0)))
        wood.append(box((post * 1.6, depth, 0.03), (x, 0, arm_z - 0.02)))
        wood.append(box((post * 0.6, depth - 2 * post, 0.07), (x, 0, seat - 0.1)))
        for at in np.linspace(-y + 0.16, y - 0.16, slats):
            wood.append(box((0.02, 0.04, arm_z - seat + 0.02), (x, float(at), seat - 0.05)))
    frame = sampler.wood() if sampler.chance(0.8) else sampler.metal()
    return settled(
        assemble(
            "sofa",
            (frame, wood),
            (sampler.fabric(), soft),
            support_surfaces=seat_area(width, seat + thick),
        )
    )


def mid_century(sampler: Sampler) -> Model:
    """A slim sofa of the 1950s: a thin body on tall legs, loose cushions, maybe bolsters."""
    seats, pitch = sampler.choice((2, 3, 3, 4)), sampler.size(0.52, 0.62)
    depth, leg = sampler.size(0.74, 0.88), sampler.size(0.18, 0.28)
    slim, arm, thick = sampler.size(0.06, 0.1), sampler.size(0.05, 0.1), sampler.size(0.11, 0.15)
    inner, y, seat = seats * pitch, depth / 2, leg + slim + thick
    width, arm_h = inner + 2 * arm, seat + sampler.uniform(0.08, 0.18)
    back_h = sampler.size(0.72, 0.84)
    cover = sampler.upholstery()
    shell = [rounded_box((inner + 0.02, depth, slim), (0, 0, leg), 0.02)]
    rest = rounded_box((inner, 0.07, back_h - leg - slim), (0, 0, 0), 0.03)
    shell.append(rest.rotated("x", -9).translated(0, y - 0.1, leg + slim - 0.015))
    for side in (-1, 1):
        path = [(side * (inner / 2 + arm / 2), at) for at in np.linspace(-y, y, 6)]
        tops = np.linspace(arm_h - sampler.choice((0.0, 0.05)), arm_h + 0.05, 6)
        shell.append(wall(path, leg, tops, arm, 0.03))
    cushions = []
    for i in range(seats):
        x, size = (i - (seats - 1) / 2) * pitch, pitch - 0.012
        cushions.append(puff((size, depth - 0.14, thick + 0.01), (x, -0.07, leg + slim), 9, 4.5))
        lean = puff((size, 0.13, back_h - seat + 0.03), (0, -0.07, 0), 6, 3.5)
        cushions.append(lean.rotated("x", -10).translated(x, y - 0.16, seat - 0.02))
    loose = []
    if sampler.chance(0.5):
        for side in (-1, 1):
            at = (side * (inner / 2 - 0.09), -0.1, seat + 0.07)
            loose.append(roll(0.08, depth * 0.6, "y", at))
    style = sampler.choice(("tapered", "tapered", "splayed", "hairpin", "peg"))
    frame = sampler.metal() if style in STEEL else sampler.wood()
    legs = feet(sampler, width - 0.1, depth - 0.06, leg + 0.01, style)
    if sampler.chance(0.5):
        legs += [box((width - 0.2, 0.03, 0.04), (0, s * (y - 0.1), leg - 0.038)) for s in (-1, 1)]
    return settled(
        assemble(
            "sofa",
            (cover, shell),
            (other(sampler, cover), cushions),
            (sampler.upholstery(), loose),
            (frame, legs),
            support_surfaces=seat_area(inner, seat),
        )
    )


def _open_back(sampler: Sampler, inner: float, length: float) -> list[Mesh]:
    """Two rails with spindles or boards between them."""
    back: list[Mesh] = []
    for z in (0.05, length - 0.05):
        back.append(box((inner + 0.02, 0.03, 0.05), (0, 0, z)))
    if sampler.chance(0.5):
        for at in np.linspace(-inner / 2, inner / 2, sampler.integer(6, 16)):
            back.append(cylinder(0.011, length - 0.04, (float(at), 0, 0.04), 6))
    else:
        back += [
            box((inner, 0.015, 0.04), (0, 0, z))
            for z in np.linspace(0.13, length - 0.13, 3).tolist()
        ]
        back += [box((0.04, 0.034, length), (s * inner / 2, 0, 0)) for s in (-1, 1)]
    return back


def wooden_arms(sampler: Sampler) -> Model:
    """Cushions in an open wooden frame with flat arms on posts and a back of slats or bars."""
    seats, pitch, depth = sampler.integer(2, 3), sampler.size(0.54, 0.64), sampler.size(0.74, 0.9)
    seat, height, post = (
        sampler.size(0.28, 0.34),
        sampler.size(0.74, 0.88),
        sampler.size(0.035, 0.06),
    )
    inner, y, thick = seats * pitch, depth / 2, sampler.size(0.11, 0.16)
    arm_z, paddle = seat + thick + sampler.uniform(0.1, 0.17), sampler.size(0.06, 0.12)
    wood: list[Mesh] = [
        box((inner + 0.01, 0.03, 0.08), (0, s * (y - 0.06), seat - 0.085)) for s in (-1, 1)
    ]
    wood.append(box((inner, depth - 0.1, 0.015), (0, 0, seat - 0.02)))
    for side in (-1, 1):
        x = side * (inner / 2 + post / 2)
        for at in (-y + post, y - post):
            wood.append(rod((x, at * 1.04, 0), (x, at * 0.94, arm_z), post / 2))
        wood.append(rounded_box((paddle, depth + 0.02, 0.03), (x, 0, arm_z - 0.012), 0.014))
        if sampler.chance(0.5):
            wood.append(box((post * 0.6, depth - 0.1, 0.05), (x, 0, seat - 0.07)))
    back = _open_back(sampler, inner, height - seat)
    wood += [m.rotated("x", -12).translated(0, y - 0.12, seat - 0.03) for m in back]
    soft, single = [], sampler.chance(0.3)
    for i in range(1 if single else seats):
        w = inner if single else pitch
        x = 0.0 if single else (i - (seats - 1) / 2) * pitch
        soft.append(puff((w - 0.01, depth - 0.12, thick), (x, -0.06, seat), 9, 4.5))
        lean = puff(
            (w - 0.01, thick, height - seat - thick + 0.04), (0, -0.03 - thick / 2, 0), 7, 4
        )
        soft.append(lean.rotated("x", -12).translated(x, y - 0.16, seat + thick - 0.02))
    return settled(
        assemble(
            "sofa",
            (sampler.wood(), wood),
            (sampler.upholstery(), soft),
            support_surfaces=seat_area(inner, seat + thick),
        )
    )


def steel_frame(sampler: Sampler) -> Model:
    """Thick leather cubes held in a cage of bent steel tube."""
    return _caged(sampler, "sofa", sampler.integer(2, 3))


def steel_cube(sampler: Sampler) -> Model:
    """The armchair of the same make: a cube of cushions in a cage of steel tube."""
    return _caged(sampler, "armchair", 1)


def _caged(sampler: Sampler, category: str, seats: int) -> Model:
    pitch, depth = sampler.size(0.52, 0.66), sampler.size(0.68, 0.82)
    seat, height, arm = sampler.size(0.4, 0.46), sampler.size(0.62, 0.74), sampler.size(0.13, 0.18)
    inner, y, r = seats * pitch, depth / 2, sampler.size(0.012, 0.02)
    width, base = inner + 2 * arm + 4 * r, sampler.size(0.12, 0.18)
    x, low_back = width / 2 - r, sampler.chance(0.4)
    arm_h = height if low_back else height - 0.1
    steel = []
    for z in (base, arm_h - 0.06):
        steel.append(tube([(-x, -y + r, z), (-x, y - r, z), (x, y - r, z), (x, -y + r, z)], r, 8))
    steel.append(rod((-x, -y + r, base), (x, -y + r, base), r))
    for at_x in (-x, x):
        steel.append(rod((at_x, -y + r, 0), (at_x, -y + r, arm_h - 0.06), r))
        steel.append(rod((at_x, y - r, 0), (at_x, y - r, arm_h - 0.06), r))
    soft, thick = [], (seat - base) / 2
    for i in range(seats):
        at = (i - (seats - 1) / 2) * pitch
        for k in range(2):
            size = (pitch - 0.006, depth - arm - 0.03, thick)
            z = base + r * 0.6 + k * thick
            soft.append(rounded_box(size, (at, -arm / 2, z), sampler.choice((0.02, 0.035))))
        size = (pitch - 0.01, arm, height - seat + 0.1)
        soft.append(puff(size, (at, y - 2 * r - arm / 2, seat - 0.08), 9, 7))
    for side in (-1, 1):
        size = (arm, depth - 4 * r, arm_h - base - 0.02)
        soft.append(rounded_box(size, (side * (inner + arm) / 2, 0, base + r * 0.6), 0.03))
    return settled(
        assemble(
            category,
            (sampler.metal(), steel),
            (sampler.upholstery(), soft),
            support_surfaces=seat_area(inner, seat + r),
        )
    )


DESIGNS: dict[str, tuple[ModelFactory, ...]] = {
    "sofa": (
        futon,
        mid_century,
        wooden_arms,
        steel_frame,
    ),
    "armchair": (steel_cube,),
}
