"""Guitars: acoustic and electric ones of many outlines, and ukuleles."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import box, cylinder, torus
from onemap_simulator.generation.model import Model
from onemap_simulator.generation.sampler import Sampler
from onemap_tools.train.variety.designs.guitar_parts import (
    mirrored,
    neck,
    posed,
    slab,
    spline,
)


def acoustic_guitar(sampler: Sampler) -> Model:
    """An acoustic guitar with a waisted deep body, rosette, pickguard, binding, open or cutaway."""
    big = sampler.size(0.9, 1.1)
    low, waist, up = (
        sampler.uniform(0.18, 0.21),
        sampler.uniform(0.11, 0.135),
        sampler.uniform(0.135, 0.155),
    )
    half = [
        (0.05, 0.0),
        (low * 0.75, 0.03),
        (low, 0.14),
        (waist, 0.29),
        (up, 0.39),
        (up * 0.75, 0.46),
        (0.03, 0.48),
    ]
    points = mirrored(half)
    if sampler.chance(0.35):
        points[4:7] = [(up * 0.9, 0.36), (up * 0.45, 0.4), (0.05, 0.42)]
    outline = spline(points, 3) * big
    thick = sampler.uniform(0.08, 0.115)
    body = [slab(outline, thick)]
    middle = outline.mean(axis=0)
    face = slab(middle + (outline - middle) * 0.95, 0.004).translated(0, -thick + 0.001, 0)
    board, metal, pegs = neck(0.48 * big, 0.36 * big, -thick - 0.012, 0)
    hole = (
        cylinder(0.05, 0.006, segments=16)
        .rotated("x", 90)
        .translated(0, -thick - 0.002, 0.33 * big)
    )
    ring = (
        torus(0.058, 0.005, segments=18).rotated("x", 90).translated(0, -thick - 0.004, 0.33 * big)
    )
    bridge = [box((0.14, 0.014, 0.03), (0, -thick - 0.008, 0.14 * big))]
    groups = [
        (sampler.wood(), body),
        (sampler.wood(), [face]),
        (sampler.wood(), [*board, *bridge]),
        (sampler.metal(), [*metal, *pegs]),
        (sampler.dark(), [hole]),
        (sampler.pale(), [ring]),
    ]
    if sampler.chance(0.5):
        guard = np.array([(0.055, 0.32), (0.1, 0.3), (0.11, 0.2), (0.06, 0.24)])[::-1] * big
        groups.append((sampler.dark(), [slab(guard[::-1], 0.004).translated(0, -thick - 0.002, 0)]))
    return posed(sampler, groups, thick)


def _electric(
    sampler: Sampler, points: list[tuple[float, float]], smooth: int, top: float
) -> Model:
    """An electric guitar or bass of the outline: pickups, bridge, knobs, guard."""
    big, thick = sampler.size(0.95, 1.08), sampler.uniform(0.04, 0.055)
    outline = (spline(points, smooth) if smooth > 1 else np.asarray(points)) * big
    body = [slab(outline, thick, 0.04 if smooth > 1 else 0.0)]
    bass = sampler.chance(0.25)
    board, metal, pegs = neck(
        top * big, (0.58 if bass else 0.46) * big, -thick - 0.012, sampler.integer(0, 2)
    )
    dark = [
        box((0.09, 0.014, 0.03), (0, -thick - 0.007, z * big))
        for z in (0.15, 0.22, 0.28)[: sampler.integer(2, 3)]
    ]
    metal += [box((0.09, 0.02, 0.04), (0, -thick - 0.008, 0.08 * big))]
    knobs = [
        cylinder(0.012, 0.018, segments=10).rotated("x", 90).translated(x, -thick, z * big)
        for x, z in ((0.085, 0.16), (0.1, 0.12), (0.1, 0.08))[: sampler.integer(2, 3)]
    ]
    groups = [
        (sampler.plastic() if sampler.chance(0.7) else sampler.wood(), body),
        (sampler.wood(), board),
        (sampler.metal(), [*metal, *pegs, *knobs]),
        (sampler.dark(), dark),
    ]
    if smooth > 1 and sampler.chance(0.6):
        guard = (
            np.array(
                [(0.07, 0.3), (-0.07, 0.3), (-0.09, 0.16), (0.02, 0.06), (0.13, 0.1), (0.1, 0.2)]
            )
            * big
        )
        groups.append((sampler.pale(), [slab(guard, 0.004).translated(0, -thick - 0.001, 0)]))
    return posed(sampler, groups, thick)


def double_cutaway(sampler: Sampler) -> Model:
    """An electric guitar with two horns, even or uneven, and a contoured body."""
    horn, other = sampler.uniform(0.36, 0.44), sampler.uniform(0.33, 0.4)
    wide = sampler.uniform(0.9, 1.1)
    points = [
        (0.06, 0.0),
        (0.15, 0.04),
        (0.155, 0.12),
        (0.11, 0.21),
        (0.14, 0.29),
        (0.125, other),
        (0.085, other - 0.02),
        (0.05, 0.3),
        (0.03, 0.31),
        (-0.03, 0.31),
        (-0.05, 0.31),
        (-0.085, horn - 0.02),
        (-0.125, horn),
        (-0.15, 0.3),
        (-0.115, 0.2),
        (-0.16, 0.12),
        (-0.15, 0.03),
        (-0.06, 0.0),
    ]
    return _electric(sampler, [(x * wide, z) for x, z in points], 2, 0.31)


def single_cutaway(sampler: Sampler) -> Model:
    """An electric guitar with a rounded body and one cutaway below its neck."""
    low, up = sampler.uniform(0.155, 0.18), sampler.uniform(0.115, 0.14)
    points = [
        (0.05, 0.0),
        (low * 0.8, 0.03),
        (low, 0.11),
        (0.1, 0.23),
        (up * 0.95, 0.3),
        (up, 0.34),
        (0.075, 0.325),
        (0.035, 0.3),
        (0.03, 0.36),
        (-0.03, 0.38),
        (-up * 0.7, 0.38),
        (-up, 0.32),
        (-0.1, 0.22),
        (-low, 0.11),
        (-low * 0.8, 0.03),
        (-0.05, 0.0),
    ]
    return _electric(sampler, points, 2, 0.37)


def angular_guitar(sampler: Sampler) -> Model:
    """An electric guitar with a body of straight edges: a V, an offset bolt or a star."""
    kind, w = sampler.integer(0, 2), sampler.uniform(0.9, 1.1)
    if kind == 0:
        points = [
            (0.0, 0.13),
            (0.13, -0.06),
            (0.2, -0.05),
            (0.06, 0.36),
            (-0.06, 0.36),
            (-0.2, -0.05),
            (-0.13, -0.06),
        ]
    elif kind == 1:
        points = [
            (-0.1, 0.0),
            (0.04, 0.05),
            (0.2, -0.04),
            (0.14, 0.2),
            (0.2, 0.33),
            (0.04, 0.3),
            (-0.04, 0.3),
            (-0.16, 0.42),
            (-0.12, 0.2),
            (-0.2, 0.06),
        ]
    else:
        points = [
            (0.0, 0.06),
            (0.19, -0.05),
            (0.1, 0.15),
            (0.17, 0.36),
            (0.04, 0.29),
            (-0.04, 0.29),
            (-0.17, 0.4),
            (-0.1, 0.15),
            (-0.19, -0.05),
        ]
    return _electric(sampler, [(x * w, z) for x, z in points], 1, 0.32)


def ukulele(sampler: Sampler) -> Model:
    """A ukulele or a small round-bodied travel guitar, half as long as a guitar."""
    size = sampler.size(0.58, 0.8)
    low = sampler.uniform(0.15, 0.19)
    half = [
        (0.05, 0.0),
        (low * 0.8, 0.03),
        (low, 0.14),
        (low * 0.62, 0.27),
        (low * 0.75, 0.36),
        (0.04, 0.42),
    ]
    if sampler.chance(0.3):
        half = [(0.05, 0.0), (0.15, 0.05), (0.19, 0.17), (0.15, 0.28), (0.06, 0.4), (0.035, 0.44)]
    thick = 0.09
    body = slab(spline(mirrored(half), 3), thick)
    board, metal, pegs = neck(0.43, 0.3, -thick - 0.012, 0)
    hole = cylinder(0.045, 0.006, segments=16).rotated("x", 90).translated(0, -thick - 0.002, 0.27)
    bridge = box((0.11, 0.014, 0.03), (0, -thick - 0.008, 0.11))
    groups = [
        (sampler.wood() if sampler.chance(0.6) else sampler.plastic(), [body]),
        (sampler.wood(), [*board, bridge]),
        (sampler.metal(), [*metal, *pegs]),
        (sampler.dark(), [hole]),
    ]
    small = [(m, [p.scaled(size, size, size) for p in ms]) for m, ms in groups]
    return posed(sampler, small, thick * size)
