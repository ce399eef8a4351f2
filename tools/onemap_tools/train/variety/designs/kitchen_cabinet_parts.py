"""Parts that kitchen base cabinets share: carcass, worktop, fronts and their pulls."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import Mesh, Vec, box, ellipsoid, rounded_box
from onemap_simulator.generation.model import SupportSurface
from onemap_simulator.generation.sampler import Sampler
from onemap_tools.train.variety.designs.appliance_parts import disc, feet, grip, slab

CATEGORY = "kitchen cabinet"
TOP_M = 0.9
DEPTH_M = 0.6
FRONT_Y = -DEPTH_M / 2
Span = tuple[float, float]


def top_surface(width: float, shift: float = 0.0) -> tuple[SupportSurface, ...]:
    """Where things stand on the worktop, moved by ``shift`` in depth."""
    return (SupportSurface(-width / 2, -0.2 + shift, width / 2, 0.26 + shift, TOP_M),)


def worktop(sampler: Sampler, width: float, thick: float) -> list[Mesh]:
    """A worktop with a square or rounded edge, at times with an upstand at the back."""
    size, at = (width, DEPTH_M + 0.02, thick), (0.0, 0.0, TOP_M - thick)
    board = [rounded_box(size, at, 0.012) if sampler.chance(0.4) else box(size, at)]
    if sampler.chance(0.3):
        tall = sampler.uniform(0.04, 0.12)
        board.append(box((width, 0.018, tall + 0.004), (0, DEPTH_M / 2 - 0.012, TOP_M - 0.004)))
    return board


def closed_carcass(
    sampler: Sampler, width: float, low: float, top: float
) -> tuple[list[Mesh], list[Mesh]]:
    """The closed body, and the sunk plinth or the legs under it."""
    body = [box((width - 0.004, DEPTH_M - 0.03, top - low), (0, 0.015, low))]
    if sampler.chance(0.7):
        return body, [box((width - 0.004, DEPTH_M - 0.1, low + 0.002), (0, 0.035, 0))]
    return body, feet(width, DEPTH_M - 0.04, low + 0.002, sampler.uniform(0.014, 0.025))


def front_leaf(wide: float, tall: float, at: Vec, style: int) -> list[Mesh]:
    """A front: flat, framed, raised, of planks or grooved; ``at``: the lower middle of its back."""
    x, y, z = at
    meshes = [box((wide, 0.018, tall), (x, y - 0.009, z))]
    rail = min(0.065, tall * 0.22, wide * 0.22)
    if style in (1, 2):
        meshes += [box((wide, 0.012, rail), (x, y - 0.022, z + h)) for h in (0, tall - rail)]
        side = (rail, 0.012, tall - 2 * rail)
        meshes += [box(side, (x + s * (wide - rail) / 2, y - 0.022, z + rail)) for s in (-1, 1)]
        if style == 2:
            inner = (wide - 2 * rail - 0.04, 0.016, tall - 2 * rail - 0.04)
            if min(inner) > 0.01:
                meshes.append(rounded_box(inner, (x, y - 0.02, z + rail + 0.02), 0.007))
    elif style == 3:
        count = max(2, round(wide / 0.09))
        pitch = wide / count
        for index in range(count):
            middle = x + (index + 0.5) * pitch - wide / 2
            meshes.append(box((pitch - 0.007, 0.01, tall), (middle, y - 0.022, z)))
    elif style == 4:
        for h in np.arange(0.0, tall - 0.012, 0.026):
            meshes.append(box((wide, 0.008, 0.018), (x, y - 0.021, z + float(h))))
    return meshes


def front_pull(sampler: Sampler, kind: int, at: Vec, upright: bool, wide: float) -> list[Mesh]:
    """A knob, a cup or a handle on a front at ``at``."""
    x, y, z = at
    if kind == 0:
        return [disc(0.006, 0.018, at, 8), ellipsoid((0.016, 0.012, 0.016), (x, y - 0.022, z), 10)]
    if kind == 1 and not upright:
        cup = [(-0.045, -0.006), (0.045, -0.006), (0.04, 0.02), (-0.04, 0.02)]
        return [slab(cup, 0.026, (x, y + 0.002, z))]
    return grip(sampler, min(0.16, wide * 0.5) if upright else wide, at, upright)


def doors_between(
    sampler: Sampler, width: float, span: Span, style: int, kind: int
) -> tuple[list[Mesh], list[Mesh]]:
    """One or two doors with pulls between two heights."""
    low, high = span
    count = 2 if width > 0.62 else 1
    wide = width / count
    leaves, pulls = [], []
    single = sampler.choice([-1, 1])
    for index in range(count):
        x = (index - (count - 1) / 2) * wide
        y = FRONT_Y + 0.018
        leaves += front_leaf(wide - 0.008, high - low - 0.008, (x, y, low + 0.004), style)
        side = single if count == 1 else 1 - 2 * index
        at = (x + side * (wide / 2 - 0.045), y - 0.026, high - min(0.14, (high - low) * 0.3))
        pulls += front_pull(sampler, kind, at, True, high - low)
    return leaves, pulls
