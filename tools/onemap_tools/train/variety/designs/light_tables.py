"""Light kitchen and garden tables."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import (
    Mesh,
    box,
    cone,
    cylinder,
    rod,
)
from onemap_simulator.generation.model import Model, assemble, support_surface
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.woodwork import (
    SIDES,
    board,
    corners,
    frame,
    lean,
    oval,
    racetrack,
    slab,
    stretch,
)


def splayed(sampler: Sampler) -> Model:
    """A Scandinavian table: a soft-cornered top with a knife edge on four splayed round legs."""
    depth, height = sampler.size(0.75, 1.0), sampler.size(0.71, 0.75)
    width = depth * sampler.uniform(1.0, 1.8)
    thick, stout = sampler.uniform(0.022, 0.035), sampler.uniform(0.02, 0.035)
    below, power = height - thick, sampler.choice([2.0, 2.6, 4.0, 12.0])
    top = slab(oval(width, depth, power, 32), thick, below, sampler.uniform(0.0, 0.03))
    out, pull = sampler.uniform(0.7, 0.86), sampler.uniform(0.03, 0.14)
    out = out if power > 3 else 0.68
    legs: list[Mesh] = []
    for x, y in corners(width * out, depth * out):
        shaft = cone((stout * 0.5, stout), below, segments=10)
        legs.append(lean(shaft, -pull * np.sign(x), -pull * np.sign(y)).translated(x, y))
    x, y = width * out / 2 - pull, depth * out / 2 - pull
    legs += [box((2 * x, 0.022, 0.07), (0, s * y, below - 0.07)) for s in SIDES]
    legs += [box((0.022, 2 * y, 0.07), (s * x, 0, below - 0.072)) for s in SIDES]
    surface = support_surface(width * 0.75, depth * 0.75, height)
    return assemble(
        "table", (board(sampler), [top]), (frame(sampler), legs), support_surfaces=(surface,)
    )


def diner(sampler: Sampler) -> Model:
    """A 1950s kitchen table: laminate with a ribbed metal band on bent tube legs."""
    width, depth, height = (
        sampler.size(0.8, 1.3),
        sampler.size(0.65, 0.85),
        sampler.size(0.72, 0.77),
    )
    radius, corner = sampler.uniform(0.012, 0.018), sampler.uniform(0.05, 0.2)
    top = slab(racetrack(width, depth, corner), 0.02, height - 0.02)
    bands = [
        slab(racetrack(width + 0.012, depth + 0.012, corner), 0.008, height - z)
        for z in (0.016, 0.03, 0.044)
    ]
    fill = slab(racetrack(width - 0.01, depth - 0.01, corner), 0.03, height - 0.046)
    tubes: list[Mesh] = []
    under, splay = height - 0.047, sampler.uniform(0.0, 0.06)
    for x, y in corners(width, depth, corner * 0.4 + 0.05):
        for step in (0.0, 0.055):
            sx, sy = float(np.sign(x)), float(np.sign(y))
            at = (x - sx * step, y, 0.0)
            tubes.append(
                lean(cylinder(radius, under), -sx * (0.04 + splay), -sy * splay).translated(*at)
            )
    rail = (
        [box((width - 0.25, depth - 0.2, 0.05), (0, 0, under - 0.05))]
        if sampler.chance(0.6)
        else []
    )
    surface = support_surface(width, depth, height, 0.07)
    return assemble(
        "table",
        (sampler.enamel(), [top, *rail]),
        (sampler.metal(), [*bands, fill, *tubes]),
        support_surfaces=(surface,),
    )


def folding(sampler: Sampler) -> Model:
    """A light slatted garden or camping table on crossing folding legs."""
    width, depth, height = sampler.size(0.7, 1.3), sampler.size(0.6, 0.8), sampler.size(0.69, 0.75)
    slats, thick = sampler.choice([1, 5, 6, 8]), sampler.uniform(0.018, 0.03)
    below, each = height - thick, depth / slats
    top = [
        box(
            (width, each - (0.014 if slats > 1 else 0.0), thick),
            (0, (i - (slats - 1) / 2) * each, below),
        )
        for i in range(slats)
    ]
    x, across = width / 2 - 0.09, sampler.chance(0.5)
    bars: list[Mesh] = [box((0.04, depth - 0.06, 0.024), (s * x, 0, below - 0.024)) for s in SIDES]
    wide = depth / 2 - 0.06
    for s in SIDES:
        for e in SIDES:
            if across:
                start, end = (s * x, e * wide, 0.0), (s * x, -e * wide * 0.9)
            else:
                start, end = (e * x, s * wide, 0.0), (-e * x * 0.9, s * (wide - 0.03))
            section = (0.026 + 0.004 * e, 0.03 + 0.004 * e)
            bars.append(stretch(section, start, end, below - 0.002))
    for e in SIDES:
        low = (-x, e * wide * 0.8, 0.08) if across else (e * x * 0.85, -wide, 0.08)
        high = (x, e * wide * 0.8, 0.08) if across else (e * x * 0.85, wide, 0.08)
        bars.append(rod(low, high, 0.011))
    surface = support_surface(width, depth, height)
    return assemble(
        "table", (board(sampler), top), (frame(sampler), bars), support_surfaces=(surface,)
    )


DESIGNS: dict[str, tuple[ModelFactory, ...]] = {
    "table": (
        splayed,
        diner,
        folding,
    )
}
