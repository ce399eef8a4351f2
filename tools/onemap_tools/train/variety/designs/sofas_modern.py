"""Sofas, modern: sectional, modular, reclining, curved."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import box, cylinder, rod, rounded_box
from onemap_simulator.generation.model import Model, assemble
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.feet import footing
from onemap_tools.train.variety.designs.upholstery import (
    leaning,
    other,
    puff,
    seat_area,
    settled,
    wall,
)


def sectional(sampler: Sampler) -> Model:
    """An L-shaped corner sofa: a long row and a chaise that comes forward at one end."""
    seats, pitch = sampler.integer(2, 3), sampler.size(0.56, 0.66)
    depth, reach = sampler.size(0.86, 1.0), sampler.size(1.4, 1.75)
    low, seat = sampler.size(0.04, 0.13), sampler.size(0.38, 0.45)
    height = sampler.size(0.68, 0.86)
    arm, back, chaise = sampler.size(0.1, 0.24), sampler.size(0.14, 0.22), pitch * 1.25
    side, soft = sampler.choice((-1, 1)), sampler.size(0.02, 0.06)
    inner, back_y = seats * pitch + chaise, reach / 2
    width, thick = inner + 2 * arm, sampler.size(0.13, 0.17)
    base, mid = seat - thick - low, back_y - depth / 2
    x_chaise = side * (inner - chaise) / 2
    arm_h = seat + sampler.uniform(0.06, height - seat - 0.02)
    cover = sampler.upholstery()
    body = [
        rounded_box((width, depth - 0.02, base), (0, mid, low), soft),
        rounded_box((chaise + arm, reach, base), (x_chaise + side * arm / 2, 0, low), soft),
        rounded_box((width, back, height - low), (0, back_y - back / 2, low), soft),
        rounded_box((arm, depth, arm_h - low), (-side * (width - arm) / 2, mid, low), soft),
    ]
    wing = sampler.choice((depth, depth, reach))
    if sampler.chance(0.7):
        at = (side * (width - arm) / 2, back_y - wing / 2, low)
        body.append(rounded_box((arm, wing, arm_h - low), at, soft))
    d, top = depth - back, low + base
    cushions = [
        puff((chaise - 0.01, reach - back, thick), (x_chaise, -back / 2, top), 12, 5),
        leaning((chaise - 0.02, 0.16, height - seat + 0.05), x_chaise, back_y - back, seat - 0.02),
    ]
    for i in range(seats):
        x = -side * (inner / 2 - (i + 0.5) * pitch)
        cushions.append(puff((pitch - 0.01, d, thick), (x, mid - back / 2, top), 10, 5))
        size = (pitch - 0.02, 0.16, height - seat + 0.05)
        cushions.append(leaning(size, x, back_y - back, seat - 0.02))
    metal, legs = footing(sampler, width - 0.1, depth - 0.1, low + 0.01)
    legs = [m.translated(0, mid, 0) for m in legs]
    legs += [
        cylinder(0.02, low + 0.01, (x_chaise + s * (chaise / 2 - 0.1), -back_y + 0.1, 0), 8)
        for s in (-1, 1)
    ]
    return settled(
        assemble(
            "sofa",
            (cover, body),
            (other(sampler, cover, 0.7), cushions),
            (metal, legs),
            support_surfaces=seat_area(inner, seat),
        )
    )


def modular(sampler: Sampler) -> Model:
    """Low soft blocks side by side without feet or arms, some with a back, maybe a pouf."""
    count, pitch, depth = sampler.integer(2, 4), sampler.size(0.6, 0.8), sampler.size(0.8, 1.0)
    seat, height = sampler.size(0.3, 0.4), sampler.size(0.58, 0.74)
    back, round_plan = sampler.size(0.16, 0.28), sampler.uniform(5, 12)
    tiers, y = sampler.choice((1, 1, 2)), depth / 2
    width = count * pitch
    corner = sampler.choice((0, 0, -1, 1))
    blocks, backs = [], []
    for i in range(count):
        x = (i - (count - 1) / 2) * pitch
        for k in range(tiers):
            size = (pitch - 0.008, depth - 0.01, seat / tiers)
            blocks.append(puff(size, (x, 0, k * seat / tiers), round_plan, 5, 16))
        if count > 3 and i == 0 and sampler.chance(0.4):
            continue
        size = (pitch - 0.014, back, height - seat * 0.6)
        backs.append(puff(size, (x, y - back / 2, seat * 0.6 + 0.004), 6, 4))
    if corner:
        size = (back, depth - back - 0.02, height - seat * 0.7)
        backs.append(puff(size, (corner * (width - back) / 2, -back / 2, seat * 0.7), 6, 4))
    loose = []
    for _ in range(sampler.integer(0, 2)):
        at = sampler.uniform(-width / 2 + 0.35, width / 2 - 0.35)
        loose.append(leaning((0.45, 0.13, 0.36), at, y - back + 0.01, seat - 0.03, 16))
    cover = sampler.fabric()
    return settled(
        assemble(
            "sofa",
            (cover, blocks),
            (other(sampler, cover), backs),
            (sampler.fabric(), loose),
            support_surfaces=seat_area(width, seat),
        )
    )


def recliner_sofa(sampler: Sampler) -> Model:
    """A home cinema sofa: overstuffed stacked rolls, fat arms, a footrest folded out."""
    seats, pitch, depth = sampler.integer(2, 3), sampler.size(0.56, 0.66), sampler.size(0.86, 0.98)
    arm, seat, height = sampler.size(0.2, 0.28), sampler.size(0.44, 0.5), sampler.size(0.92, 1.08)
    inner, y = seats * pitch, depth / 2
    width, tiers = inner + 2 * arm, sampler.integer(2, 3)
    arm_h = seat + sampler.uniform(0.12, 0.2)
    body = [rounded_box((width - 0.06, depth - 0.12, seat - 0.16), (0, 0.03, 0.03), 0.03)]
    body.append(rounded_box((width - 0.1, 0.12, height - 0.16), (0, y - 0.06, 0.03), 0.05))
    pads, steel, dark = [], [], [box((width - 0.2, depth - 0.2, 0.04), (0, 0.02, 0))]
    for side in (-1, 1):
        x = side * (width - arm) / 2
        body.append(rounded_box((arm * 0.86, depth - 0.06, arm_h - 0.1), (x, 0, 0.03), 0.04))
        pads.append(puff((arm, depth - 0.08, 0.15), (x, -0.02, arm_h - 0.13), 8, 3, 16))
        if sampler.chance(0.4):
            steel.append(cylinder(0.045, 0.012, (x, -y + 0.2, arm_h + 0.012), 14))
    for i in range(seats):
        x = (i - (seats - 1) / 2) * pitch
        pads.append(puff((pitch - 0.006, depth - 0.18, 0.22), (x, -0.08, seat - 0.17), 8, 3.5, 16))
        tall = (height - seat + 0.04) / tiers
        for k in range(tiers):
            size = (pitch - 0.01, 0.24 - 0.02 * (k % 2), tall * 1.12)
            pads.append(puff(size, (x, y - 0.19 + 0.03 * k, seat - 0.02 + k * tall), 5, 2.6, 16))
        if sampler.chance(0.4):
            rest = puff((pitch - 0.04, 0.13, 0.4), (0, 0, 0), 7, 3.5).rotated("x", 80)
            pads.append(rest.translated(x, -y - 0.04, seat - 0.13))
            steel += [
                rod(
                    (x + s * pitch / 3, -y + 0.12, 0.22),
                    (x + s * pitch / 3, -y - 0.2, seat - 0.1),
                    0.01,
                )
                for s in (-1, 1)
            ]
        else:
            front = puff((pitch - 0.01, 0.12, seat - 0.16), (x, -y + 0.06, 0.04), 6, 3.5, 16)
            pads.append(front)
    cover = sampler.upholstery()
    return settled(
        assemble(
            "sofa",
            (cover, body),
            (other(sampler, cover, 0.75), pads),
            (sampler.metal(), steel),
            (sampler.dark(), dark),
            support_surfaces=seat_area(inner, seat + 0.05),
        )
    )


def curved_sofa(sampler: Sampler) -> Model:
    """A curved sofa or love seat: the back sweeps round into the arms in one band."""
    width, depth = sampler.size(1.3, 2.2), sampler.size(0.82, 1.02)
    seat, height, low = sampler.size(0.4, 0.46), sampler.size(0.66, 0.82), sampler.size(0.03, 0.15)
    thick, power = sampler.size(0.12, 0.2), sampler.uniform(0.45, 0.85)
    angle = np.linspace(-0.12 * np.pi, 1.12 * np.pi, 27)
    a, b = (width - thick) / 2, depth * 0.62
    x = a * np.sign(np.cos(angle)) * np.abs(np.cos(angle)) ** power
    y = b * np.sign(np.sin(angle)) * np.abs(np.sin(angle)) ** power
    y += depth / 2 - thick / 2 - b
    keep = y > -depth / 2 + 0.14
    path, drop = np.stack([x, y], axis=1)[keep], sampler.choice((0.0, 0.0, 0.16))
    forward = (path[:, 1].max() - path[:, 1]) / np.ptp(path[:, 1])
    body = [wall(path, low, height - drop * forward**2, thick, sampler.uniform(0.04, 0.09))]
    body.append(puff((width - thick * 1.2, depth - 0.06, seat - low - 0.1), (0, 0, low), 5, 8))
    count = sampler.choice((1, 1, 2, 3)) if width > 1.6 else 2
    w, d = (width - 2.1 * thick) / count, depth - thick - 0.04
    cushions = [
        puff((w - 0.008, d, 0.16), ((i - (count - 1) / 2) * w, -thick / 2, seat - 0.13), 5, 4)
        for i in range(count)
    ]
    loose = []
    for side in (-1, 1):
        if sampler.chance(0.5):
            at = (side * width * 0.2, depth / 2 - thick - 0.03, seat)
            loose.append(leaning((0.42, 0.12, 0.34), *at, 14))
    cover = sampler.fabric() if sampler.chance(0.8) else sampler.upholstery()
    return settled(
        assemble(
            "sofa",
            (cover, body),
            (other(sampler, cover, 0.8), cushions),
            (sampler.fabric(), loose),
            footing(sampler, width * 0.72, depth * 0.72, low + 0.03),
            support_surfaces=seat_area(width - 2 * thick - 0.2, seat + 0.02),
        )
    )


DESIGNS: dict[str, tuple[ModelFactory, ...]] = {
    "sofa": (
        sectional,
        modular,
        recliner_sofa,
        curved_sofa,
    ),
}
