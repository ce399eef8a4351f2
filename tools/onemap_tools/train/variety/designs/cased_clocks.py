"""Clocks in cases: with a pendulum, digital, cuckoo, alarm and mantel clocks."""

from __future__ import annotations

import cv2
import numpy as np

from onemap_shared.geometry import U8
from onemap_simulator.generation.mesh import (
    Mesh,
    box,
    cone,
    cylinder,
    ellipsoid,
    front_panel,
    lathe,
    prism,
    rod,
    rounded_box,
    torus,
)
from onemap_simulator.generation.model import Material, Model
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.clock_parts import (
    body_of,
    face_and_ink,
    hands_on,
    marks_on,
)
from onemap_tools.train.variety.designs.flat_forms import (
    settled,
    upright,
    window,
)


def pendulum_case(sampler: Sampler) -> Model:
    """A wall case with a dial above and a pendulum below, cornice, columns or a pediment."""
    width, height, deep = (
        sampler.size(0.24, 0.36),
        sampler.size(0.55, 0.95),
        sampler.uniform(0.08, 0.14),
    )
    bar, r = 0.025, width * 0.36
    case = [box((width, 0.015, height), (0, -0.0075, 0)), window((width, height), bar, deep)]
    case.append(box((width + 0.06, deep + 0.03, 0.03), (0, -(deep + 0.03) / 2, height)))
    case.append(box((width + 0.04, deep + 0.02, 0.025), (0, -(deep + 0.02) / 2, -0.025)))
    if sampler.chance(0.5):
        peak = [(-width / 2, 0.0), (width / 2, 0.0), (0.0, width * 0.32)]
        case.append(upright(np.array(peak), deep * 0.6, (0, -0.01, height + 0.03)))
    if sampler.chance(0.5):
        for x in (-width / 2 - 0.004, width / 2 + 0.004):
            case.append(cylinder(0.014, height, (x, -deep, 0), 10))
            case.append(ellipsoid((0.02, 0.02, 0.03), (x, -deep, -0.03), 8))
    z = height - r - bar - 0.015
    dial = cylinder(r, 0.012, segments=24).rotated("x", 90).translated(0, -deep * 0.6, z)
    post = box((0.05, deep * 0.6, 0.05), (0, -deep * 0.3, z - 0.025))
    drop = z - r - bar - 0.03
    low = bar + 0.02 + drop * sampler.uniform(0.1, 0.3)
    swing = sampler.uniform(-0.15, 0.15) * width
    bob = cylinder(width * 0.13, 0.012, segments=16).rotated("x", 90)
    brass = [rod((0, -deep * 0.4, z - r * 0.5), (swing, -deep * 0.4, low + width * 0.1), 0.005, 6)]
    brass.append(bob.translated(swing, -deep * 0.4 + 0.006, low + width * 0.12))
    face, ink = face_and_ink(sampler)
    at = (0.0, -deep * 0.6 - 0.014, z)
    marks = [*marks_on(sampler, r, at), *hands_on(sampler, r, (0, at[1] - 0.006, z), 0.1)]
    return settled(
        "clock",
        (sampler.wood(), [*case, post]),
        (face, [dial]),
        (ink, marks),
        (sampler.metal(), brass),
    )


def digital_clock(sampler: Sampler) -> Model:
    """A digital clock: a wide case, a wedge or a cube with glowing digits, or flip leaves."""
    width = sampler.size(0.2, 0.5)
    height, deep = width * sampler.uniform(0.38, 0.55), sampler.uniform(0.035, 0.1)
    body = rounded_box((width, deep, height), (0, 0, 0), sampler.choice((0.004, 0.02, 0.04)))
    w, h = width * 0.84, height * 0.68
    face = Material(_digits(sampler.rng))
    show = front_panel(w, h, (0, -deep / 2 - 0.003, height * 0.16))
    rim = window((w + 0.012, h + 0.012), 0.008, 0.01, -deep / 2 + 0.002)
    extras = [rim.translated(0, 0, height * 0.16 - 0.006)]
    if sampler.chance(0.5):
        extras += [box((0.02, 0.012, 0.008), (x, 0, height - 0.003)) for x in (-0.05, 0.0, 0.05)]
    if sampler.chance(0.5):
        extras += [box((0.02, deep * 0.8, 0.014), (s * width * 0.35, 0, -0.01)) for s in (-1, 1)]
    return settled("clock", (body_of(sampler), [body]), (sampler.dark(), extras), (face, [show]))


def _digits(rng: np.random.Generator) -> U8:
    """Hours and minutes (40, 96, 3), lit on dark or dark on pale, in seven segments or type."""
    lit = rng.random() < 0.65
    image = np.full((40, 96, 3), rng.uniform(5, 30) if lit else rng.uniform(150, 220), np.uint8)
    ink = tuple(int(v) for v in (rng.uniform(80, 255, 3) if lit else rng.uniform(10, 50, 3)))
    hour, minute = int(rng.integers(0, 24)), int(rng.integers(0, 60))
    segments = (
        "abcdef",
        "bc",
        "abged",
        "abgcd",
        "fgbc",
        "afgcd",
        "afgedc",
        "abc",
        "abcdefg",
        "abcdfg",
    )
    lines = {"a": (0, 0, 1, 0), "b": (1, 0, 1, 1), "c": (1, 1, 1, 2), "d": (0, 2, 1, 2)}
    lines |= {"e": (0, 1, 0, 2), "f": (0, 0, 0, 1), "g": (0, 1, 1, 1)}
    for place, digit in enumerate(f"{hour:02d}{minute:02d}"):
        left = 8 + place * 19 + (8 if place > 1 else 0)
        for name in segments[int(digit)]:
            x0, y0, x1, y1 = lines[name]
            start, end = (left + x0 * 12, 7 + y0 * 13), (left + x1 * 12, 7 + y1 * 13)
            cv2.line(image, start, end, ink, 3)
    for y in (14, 26):
        cv2.circle(image, (48, y), 2, ink, -1)
    return image


def cuckoo_clock(sampler: Sampler) -> Model:
    """A cuckoo clock: a little house with a steep roof, a door, leaves, weights on chains."""
    width, height, deep = (
        sampler.size(0.2, 0.28),
        sampler.size(0.2, 0.28),
        sampler.uniform(0.1, 0.15),
    )
    house = [box((width, deep, height), (0, -deep / 2, 0))]
    ridge = height + width * 0.45
    gable = [(-width / 2, height - 0.002), (width / 2, height - 0.002), (0.0, ridge)]
    house.append(upright(np.array(gable), deep, (0, 0, 0)))
    slope = float(np.hypot(width / 2, ridge - height)) * 1.3
    tilt = float(np.degrees(np.arctan2(ridge - height, width / 2)))
    roof = [
        box((slope, deep + 0.06, 0.016), (s * slope / 2, -deep / 2, 0))
        .rotated("y", s * tilt)
        .translated(0, 0, ridge + 0.004)
        for s in (-1, 1)
    ]
    r, z = width * 0.34, height * 0.42
    dial = cylinder(r, 0.01, segments=20).rotated("x", 90).translated(0, -deep, z)
    door = box((width * 0.22, 0.01, width * 0.26), (0, -deep - 0.003, height * 0.93))
    trim = []
    for _ in range(sampler.integer(4, 8)):
        side = sampler.choice((-1, 1))
        at = (side * width * sampler.uniform(0.42, 0.55), -deep - 0.008, sampler.uniform(0, height))
        leaf = ellipsoid((0.016, 0.006, 0.032)).rotated("y", sampler.uniform(-60, 60))
        trim.append(leaf.translated(*at))
    weights = []
    for x in (-width * 0.2, width * 0.2):
        drop = -sampler.uniform(0.15, 0.45)
        weights.append(rod((x, -deep / 2, drop), (x, -deep / 2, 0.004), 0.003, 5))
        weights.append(cone((0.008, 0.016), 0.09, (x, -deep / 2, drop - 0.08), 8))
    weights.append(rod((0, -deep * 0.75, -0.13), (0, -deep * 0.75, 0.004), 0.003, 5))
    weights.append(ellipsoid((0.026, 0.005, 0.03), (0, -deep * 0.75, -0.14), 10))
    face, ink = face_and_ink(sampler)
    at = (0.0, -deep - 0.012, z)
    marks = [*marks_on(sampler, r, at), *hands_on(sampler, r, (0, at[1] - 0.006, z), 0.0)]
    wood = sampler.wood()
    return settled(
        "clock",
        (wood, house),
        (sampler.wood(), [*roof, door, *trim]),
        (face, [dial]),
        (ink, marks),
        (sampler.metal(), weights),
    )


def alarm_clock(sampler: Sampler) -> Model:
    """A large twin-bell alarm clock or a mantel clock with a curved back, hung or stood."""
    r, deep = sampler.uniform(0.07, 0.13), sampler.uniform(0.05, 0.08)
    face, ink = face_and_ink(sampler)
    extras: list[Mesh] = []
    if sampler.chance(0.6):
        case = [cylinder(r, deep, segments=24).rotated("x", 90)]
        for s in (-1, 1):
            bell = lathe([(r * 0.45, 0), (r * 0.4, r * 0.2), (0.01, r * 0.35)], segments=14)
            extras.append(bell.translated(0, -deep / 2, r * 1.08).rotated("y", s * 32))
            leg = rod((0, -deep / 2, -r * 0.9), (0, -deep / 2, -r * 1.3), r * 0.07)
            extras.append(leg.rotated("y", s * 30))
            extras.append(
                rod((0, -deep / 2, r * 0.9), (0, -deep / 2, r * 1.12), 0.006).rotated("y", s * 32)
            )
        ring = torus(r * 0.28, r * 0.04, segments=14).rotated("x", 90)
        extras.append(ring.translated(0, -deep / 2, r * 1.5))
        extras.append(rod((0, -deep / 2, r * 0.9), (0, -deep / 2, r * 1.28), r * 0.04))
    else:
        x = np.linspace(-1, 1, 13)
        hat = np.stack([-x * r * 2.2, r * (0.12 + 1.15 * np.exp(-((x * 1.7) ** 2)))], axis=1)
        outline = np.concatenate([[(-r * 2.2, -r * 1.15), (r * 2.2, -r * 1.15)], hat])
        case = [prism(outline, deep).rotated("x", 90)]
        extras.append(box((r * 4.7, deep + 0.03, 0.02), (0, -deep / 2, -r * 1.15 - 0.018)))
    rim = torus(r * 0.93, r * 0.06, segments=24).rotated("x", 90).translated(0, -deep, 0)
    dial = cylinder(r * 0.9, 0.005, segments=24).rotated("x", 90).translated(0, -deep, 0)
    at = (0.0, -deep - 0.007, 0.0)
    marks = [*marks_on(sampler, r * 0.85, at), *hands_on(sampler, r * 0.85, (0, at[1] - 0.005, 0))]
    return settled(
        "clock",
        (body_of(sampler), case),
        (sampler.metal(), [*extras, rim]),
        (face, [dial]),
        (ink, marks),
    )


DESIGNS: dict[str, tuple[ModelFactory, ...]] = {
    "clock": (pendulum_case, digital_clock, cuckoo_clock, alarm_clock)
}
