"""Flat wall clocks: round, square, sunburst, skeleton."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import (
    Mesh,
    box,
    cylinder,
    ellipsoid,
    lathe,
    rod,
    torus,
)
from onemap_simulator.generation.model import Model
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.clock_parts import (
    body_of,
    face_and_ink,
    hands_on,
    marks_on,
    spoke,
)
from onemap_tools.train.variety.designs.flat_forms import (
    rounded_outline,
    settled,
    upright,
)

# A sign of a numeral: where each stroke starts and ends across, in half widths.
STROKES = {
    "|": [(0.0, 0.0)],
    "V": [(0.0, -0.8), (0.0, 0.8)],
    "X": [(-0.8, 0.8), (0.8, -0.8)],
}


def round_clock(sampler: Sampler) -> Model:
    """A round clock: station, kitchen or ship's, a rim of some section, or none at all."""
    r, deep = sampler.size(0.11, 0.24), sampler.uniform(0.03, 0.06)
    kind = sampler.integer(0, 3)
    inner = 0.9
    rim = [(r, 0.0), (r, deep), (r * 0.9, deep), (r * 0.88, deep * 0.5), (r * 0.88, 0.0), (r, 0.0)]
    if kind == 1:
        rim = [(r * 0.9, 0), (r, deep * 0.3), (r * 0.95, deep), (r * 0.86, deep * 0.8)]
        rim += [(r * 0.86, 0), (r * 0.9, 0)]
    elif kind == 2:
        inner = 0.75
        rim = [
            (r, 0),
            (r, deep * 0.4),
            (r * 0.86, deep),
            (r * 0.74, deep * 0.6),
            (r * 0.74, 0),
            (r, 0),
        ]
    hoop = [lathe(rim, segments=28, capped=False).rotated("x", 90)]
    if kind == 3:
        hoop, inner = [], 1.0
    dial = cylinder(r * inner, deep * 0.45, segments=28).rotated("x", 90)
    face, ink = face_and_ink(sampler)
    at = (0.0, -deep * 0.45 - 0.002, 0.0)
    marks = [
        *marks_on(sampler, r * inner, at),
        *hands_on(sampler, r * inner, (0, at[1] - 0.006, 0)),
    ]
    if sampler.chance(0.2) and hoop:
        hoop.append(
            torus(r * 0.18, r * 0.03, segments=14).rotated("x", 90).translated(0, -0.01, r * 1.15)
        )
    groups = [(face, [dial]), (ink, marks)]
    return settled("clock", *([(body_of(sampler), hoop)] if hoop else []), *groups)


def square_clock(sampler: Sampler) -> Model:
    """A square, oblong or eight-sided clock with a flat or rounded case."""
    width, deep = sampler.size(0.22, 0.42), sampler.uniform(0.03, 0.06)
    height = width * sampler.choice((1.0, 1.0, 0.7, 1.35))
    r = min(width, height) / 2
    face, ink = face_and_ink(sampler)
    if sampler.chance(0.35):
        corner = np.radians(np.arange(8) * 45 + 22.5)
        outline = np.stack([np.cos(corner) * width / 2, np.sin(corner) * height / 2], axis=1)
    else:
        outline = rounded_outline(width, height, sampler.choice((0.004, 0.03, 0.08)))
    case = [upright(outline, deep, (0, 0, 0))]
    inner = sampler.uniform(0.78, 0.9)
    if sampler.chance(0.5):
        dial = cylinder(r * inner, 0.006, segments=26).rotated("x", 90).translated(0, -deep, 0)
    else:
        dial = upright(outline * inner, 0.006, (0, -deep, 0))
    at = (0.0, -deep - 0.008, 0.0)
    marks = [
        *marks_on(sampler, r * inner, at),
        *hands_on(sampler, r * inner, (0, at[1] - 0.006, 0)),
    ]
    return settled("clock", (body_of(sampler), case), (face, [dial]), (ink, marks))


def sunburst(sampler: Sampler) -> Model:
    """A sunburst of the 1950s: rays with points or balls around a small dial."""
    r, count = sampler.size(0.25, 0.4), sampler.choice((12, 16, 24, 36))
    hub, deep = r * sampler.uniform(0.3, 0.5), 0.03
    second = sampler.choice((1.0, 0.75, 0.6))
    kind, rays, tips = sampler.integer(0, 2), [], []
    for index in range(count):
        a, long = 360 * index / count, r * (second if index % 2 else 1.0)
        if kind == 0:
            wide = hub * 5.5 / count
            ray = upright(
                np.array([(-wide / 2, hub * 0.9), (wide / 2, hub * 0.9), (0, long)]),
                0.01,
                (0, -0.008, 0),
            )
        elif kind == 1:
            ray = rod((0, -0.014, hub * 0.9), (0, -0.014, long), 0.005, 6)
            ball = ellipsoid((0.014, 0.014, 0.014), (0, -0.014, long), 8)
            tips.append(ball.rotated("y", a))
        else:
            ray = box((hub * 2.5 / count, 0.014, long - hub * 0.9), (0, -0.014, hub * 0.9))
        rays.append(ray.rotated("y", a))
    dial = cylinder(hub, deep, segments=24).rotated("x", 90)
    face, ink = face_and_ink(sampler)
    marks = marks_on(sampler, hub, (0, -deep - 0.002, 0))
    hands = hands_on(sampler, hub, (0, -deep - 0.008, 0))
    groups = [(body_of(sampler), rays), (face, [dial]), (ink, [*marks, *hands])]
    return settled("clock", *groups, *([(sampler.plastic(), tips)] if tips else []))


def skeleton_clock(sampler: Sampler) -> Model:
    """A large open clock: two hoops that hold Roman numerals of bars, no dial, large hands."""
    r, thick = sampler.size(0.25, 0.42), sampler.uniform(0.006, 0.011)
    inner = sampler.uniform(0.6, 0.72)
    frame = [
        torus(ring, thick, segments=32).rotated("x", 90).translated(0, -thick, 0)
        for ring in (r, r * inner)
    ]
    numerals = ("-", "|", "||", "|||", "|V", "V", "V|", "V||", "V|||", "|X", "X", "X|")
    marks: list[Mesh] = []
    low, high, step = r * inner, r, r * 0.055
    for hour, text in enumerate(numerals):
        signs = "X||" if text == "-" else text
        pens = [2 if sign in "VX" else 1 for sign in signs]
        x = -sum(pens) * step / 2
        for sign, pen in zip(signs, pens, strict=True):
            middle = x + pen * step / 2
            for bottom, top in STROKES[sign]:
                start = (middle + bottom * step, -thick, low)
                marks.append(
                    rod(start, (middle + top * step, -thick, high), thick * 0.7, 5).rotated(
                        "y", hour * 30
                    )
                )
            x += pen * step
    count = sampler.choice((3, 4, 6))
    spokes = [
        spoke(360 * i / count + 15, (0, r * inner), 0.008, (0, -thick, 0)) for i in range(count)
    ]
    hub = cylinder(r * 0.09, 0.02, segments=14).rotated("x", 90)
    hands = hands_on(sampler, r, (0, -0.026, 0), 0.0)
    metal = body_of(sampler)
    return settled(
        "clock", (metal, [*frame, *spokes, hub]), (metal, marks), (sampler.dark(), hands)
    )


DESIGNS: dict[str, tuple[ModelFactory, ...]] = {
    "clock": (round_clock, square_clock, sunburst, skeleton_clock)
}
