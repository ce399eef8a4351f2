"""Sofas, classic: rolled arms, humps, scrolls and skirts."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import box, ellipsoid, rod, rounded_box
from onemap_simulator.generation.model import Model, assemble
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.feet import WOODEN, feet, footing
from onemap_tools.train.variety.designs.upholstery import (
    leaning,
    other,
    puff,
    roll,
    seat_area,
    settled,
    tufted,
    wall,
)


def chesterfield(sampler: Sampler) -> Model:
    """A chesterfield: rolled arms as high as the back, all buttoned."""
    return _buttoned(sampler, "sofa", sampler.size(1.1, 1.9), sampler.integer(1, 3))


def chesterfield_chair(sampler: Sampler) -> Model:
    """The armchair to a chesterfield: one seat between rolled arms."""
    return _buttoned(sampler, "armchair", sampler.size(0.5, 0.62), 1)


def _buttoned(sampler: Sampler, category: str, inner: float, count: int) -> Model:
    depth = sampler.size(0.82, 1.0) if count > 1 else sampler.size(0.76, 0.92)
    foot, seat, height = (
        sampler.size(0.06, 0.14),
        sampler.size(0.4, 0.47),
        sampler.size(0.66, 0.82),
    )
    r, y = sampler.size(0.1, 0.15), depth / 2
    width = inner + 3.2 * r
    cover, z = sampler.upholstery(), height - r
    body = [rounded_box((width - r, depth - 0.06, seat - foot - 0.14), (0, 0, foot), 0.02)]
    body.append(roll(r, width, "x", (0, y - r, z)))
    body.append(box((inner + r, r * 1.3, z - foot - 0.02), (0, y - r * 0.8, foot + 0.02)))
    knobs = []
    for side in (-1, 1):
        x = side * (width / 2 - r)
        body.append(roll(r, depth, "y", (x, 0, z)))
        body.append(box((r * 1.3, depth - 0.04, z - foot), (x - side * 0.02, 0, foot)))
        knobs.append(ellipsoid((r * 0.3, 0.015, r * 0.3), (x, -y, z), 8))
    pads = tufted((inner, 0.1, height - seat), max(3, round(inner / 0.2)), sampler.integer(2, 4))
    body += [m.rotated("x", -6).translated(0, y - r * 1.5, seat) for m in pads]
    w, d = inner / count, depth - 2 * r - 0.02
    cushions = [
        puff((w - 0.01, d, 0.17), (w * (i - (count - 1) / 2), -y + d / 2 + 0.01, seat - 0.15), 9, 5)
        for i in range(count)
    ]
    legs = feet(sampler, width - 2 * r, depth - 0.1, foot + 0.01, sampler.choice(("bun", "turned")))
    return settled(
        assemble(
            category,
            (cover, body),
            (other(sampler, cover, 0.8), cushions),
            (sampler.metal(), knobs),
            (sampler.wood(), legs),
            support_surfaces=seat_area(inner, seat + 0.02),
        )
    )


def camelback(sampler: Sampler) -> Model:
    """A camelback: the top of the back rises in one or two humps, scrolled arms, fine legs."""
    inner, depth, leg = sampler.size(1.1, 1.8), sampler.size(0.74, 0.88), sampler.size(0.14, 0.24)
    seat, height, hump = (
        sampler.size(0.42, 0.48),
        sampler.size(0.74, 0.84),
        sampler.size(0.1, 0.2),
    )
    r, y, humps = sampler.size(0.07, 0.11), depth / 2, sampler.choice((1, 1, 2))
    width = inner + 4 * r
    u = np.linspace(-1, 1, 29)
    rise = (0.5 - 0.5 * np.cos(np.pi * humps * (u + 1))) ** sampler.uniform(0.7, 1.6)
    tops = height + hump * rise + 0.04 * np.abs(u) ** 6
    path = np.stack([u * (width / 2 - r * 0.6), np.full(29, y - 0.08)], axis=1)
    cover = sampler.upholstery()
    body = [wall(path, leg, tops, 0.15, 0.06)]
    body.append(rounded_box((inner + r, depth - 0.02, seat - leg - 0.1), (0, 0, leg), 0.02))
    arm_z = seat + sampler.uniform(0.14, 0.22)
    for side in (-1, 1):
        x = side * (inner / 2 + r)
        body.append(roll(r, depth - 0.1, "y", (x + side * r * 0.4, -0.03, arm_z)))
        body.append(box((r * 1.2, depth - 0.1, arm_z - leg), (x, -0.01, leg)))
    count = sampler.choice((1, 1, 2, 3))
    w, d = inner / count, depth - 0.16
    cushions = [
        puff((w - 0.008, d, 0.14), (w * (i - (count - 1) / 2), -0.08, seat - 0.11), 10, 4)
        for i in range(count)
    ]
    wood = feet(sampler, width - 0.12, depth - 0.04, leg + 0.01, sampler.choice(WOODEN[2:]))
    if sampler.chance(0.6):  # a show-wood rail along the hump and the apron
        along = [(x, y - 0.08, z + 0.006) for x, z in zip(path[:, 0], tops, strict=True)]
        wood += [rod(along[i], along[i + 1], 0.02, 6) for i in range(28)]
        wood.append(box((inner + r * 1.2, 0.03, 0.05), (0, -y + 0.01, leg)))
    return settled(
        assemble(
            "sofa",
            (cover, body),
            (other(sampler, cover, 0.8), cushions),
            (sampler.wood(), wood),
            support_surfaces=seat_area(inner, seat + 0.03),
        )
    )


def chaise_longue(sampler: Sampler) -> Model:
    """A chaise longue: one scrolled end, a back that falls away along the long seat."""
    length, depth, leg = sampler.size(1.45, 1.85), sampler.size(0.6, 0.78), sampler.size(0.1, 0.22)
    seat, height = sampler.size(0.4, 0.46), sampler.size(0.74, 0.9)
    side, y, x0 = sampler.choice((-1, 1)), depth / 2, length / 2
    cover = sampler.upholstery()
    body = [rounded_box((length, depth, seat - leg - 0.08), (0, 0, leg), 0.03)]
    u = np.linspace(0, 1, 15)
    reach = sampler.uniform(0.6, 0.95)
    fall = height - (height - seat - 0.06) * (u**2 * (3 - 2 * u)) ** sampler.uniform(0.6, 1.2)
    path = np.stack([side * (x0 - u * length * reach), np.full(15, y - 0.05)], axis=1)
    body.append(wall(path, leg + 0.04, fall, 0.1, 0.04))
    r = sampler.size(0.07, 0.11)
    head = wall([(0, -y), (0, 0), (0, y - 0.02)], 0, height - seat + 0.02, 0.14, 0.05)
    body.append(head.rotated("y", side * 14).translated(side * (x0 - 0.1), 0, seat - 0.06))
    body.append(roll(r, depth, "y", (side * (x0 - 0.02), 0, height - r * 0.6)))
    cushion = [
        puff((length - 0.16, depth - 0.09, 0.13), (-side * 0.07, -0.045, seat - 0.09), 12, 4)
    ]
    cushion.append(roll(0.085, depth * 0.7, "y", (side * (x0 - 0.24), -0.04, seat + 0.11)))
    frame = footing(sampler, length - 0.06, depth - 0.04, leg + 0.01)
    return settled(
        assemble(
            "sofa",
            (cover, body),
            (other(sampler, cover), cushion),
            frame,
            support_surfaces=seat_area(length - 0.4, seat + 0.04),
        )
    )


def skirted_loveseat(sampler: Sampler) -> Model:
    """A country love seat: plump cushions, round arms, a skirt to the floor."""
    width, depth = sampler.size(1.25, 1.6), sampler.size(0.8, 0.94)
    seat, height, arm = sampler.size(0.42, 0.5), sampler.size(0.78, 0.95), sampler.size(0.14, 0.22)
    inner, y, arm_h = width - 2 * arm, depth / 2, sampler.size(0.56, 0.66)
    cover = sampler.fabric()
    body = [rounded_box((width - 0.04, depth - 0.04, seat - 0.2), (0, 0, 0.12), 0.02)]
    body.append(puff((width - 0.06, 0.22, height - 0.14), (0, y - 0.11, 0.14), 8, 4))
    for side in (-1, 1):
        x = side * (width - arm) / 2
        body.append(rounded_box((arm * 0.8, depth - 0.05, arm_h - 0.18), (x, 0, 0.12), 0.03))
        body.append(roll(arm * 0.58, depth - 0.02, "y", (x, 0, arm_h - arm * 0.4)))
    waves = np.linspace(0, 2 * np.pi, 61)
    ripple = 1 + 0.012 * np.sin(waves * sampler.integer(12, 18))
    hem_x = (width / 2 - 0.015) * np.clip(1.35 * np.cos(waves), -1, 1) * ripple
    hem_y = (y - 0.015) * np.clip(1.35 * np.sin(waves), -1, 1) * ripple
    skirt = [wall(np.stack([hem_x, hem_y], axis=1), 0.0, 0.17, 0.02, 0.004)]
    cushions = []
    for i in (-0.5, 0.5):
        size = (inner / 2 - 0.008, depth - 0.2, 0.2)
        cushions.append(puff(size, (i * inner / 2, -0.09, seat - 0.15), 7, 3.2))
        tall = (inner / 2 + 0.02, 0.2, height - seat + 0.06)
        cushions.append(leaning(tall, i * inner / 2, y - 0.17, seat - 0.02))
    return settled(
        assemble(
            "sofa",
            (cover, body),
            (other(sampler, cover), skirt),
            (other(sampler, cover), cushions),
            support_surfaces=seat_area(inner, seat + 0.04),
        )
    )


DESIGNS: dict[str, tuple[ModelFactory, ...]] = {
    "sofa": (
        chesterfield,
        camelback,
        chaise_longue,
        skirted_loveseat,
    ),
    "armchair": (chesterfield_chair,),
}
