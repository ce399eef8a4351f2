"""Parts that ovens share: casing, door, knobs, gas burners."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import Mesh, Vec, box, cylinder, rounded_box
from onemap_simulator.generation.sampler import Sampler
from onemap_tools.train.variety.designs.appliance_parts import disc, feet, round_rect, slab

CATEGORY = "oven"
TOP_M = 0.9
DEPTH_M = 0.6
FRONT_Y = -DEPTH_M / 2


def oven_door(sampler: Sampler, wide: float, tall: float, at: Vec) -> tuple[list[Mesh], list[Mesh]]:
    """An oven door, the middle of the lower edge of its front ``at``, and its window."""
    x, y, z = at
    leaf = [rounded_box((wide, 0.045, tall), (x, y + 0.0225, z), sampler.choice([0.005, 0.015]))]
    w, h = wide * sampler.uniform(0.55, 0.86), tall * sampler.uniform(0.4, 0.62)
    low = z + (tall * 0.84 - h) / 2
    if sampler.chance(0.3):
        corner = min(h, w) * sampler.uniform(0.1, 0.45)
        glass = [slab(round_rect(w, h, corner, corner), 0.012, (x, y + 0.006, low))]
    else:
        glass = [box((w, 0.012, h), (x, y, low))]
    if sampler.chance(0.5):
        for side in (-1, 1):
            leaf.append(
                box((0.012, 0.018, h + 0.024), (x + side * (w / 2 + 0.006), y, low - 0.012))
            )
        leaf += [box((w, 0.018, 0.012), (x, y, edge)) for edge in (low - 0.012, low + h)]
    return leaf, glass


def control_knobs(sampler: Sampler, xs: list[float], y: float, z: float) -> list[Mesh]:
    """Knobs on a front, all alike: discs with a bar, or plain, on a collar."""
    radius, bar = sampler.uniform(0.014, 0.026), sampler.chance(0.5)
    meshes = []
    for x in xs:
        meshes.append(disc(radius, 0.016 if bar else 0.034, (x, y + 0.002, z), 12))
        if bar:
            turn = sampler.choice([0.0, 0.0, 40.0, 90.0])
            blade = box((0.01, 0.03, radius * 2), (0, 0, -radius)).rotated("y", turn)
            meshes.append(blade.translated(x, y - 0.02, z))
        else:
            meshes.append(disc(radius * 1.35, 0.008, (x, y + 0.002, z), 12))
    return meshes


def spread(count: int, width: float) -> list[float]:
    """Evenly spaced places across a width about 0."""
    return [float(x) for x in np.linspace(-width / 2, width / 2, count)]


def gas_burners(sampler: Sampler, width: float, columns: int) -> tuple[list[Mesh], list[Mesh]]:
    """Gas burners and the cast-iron grates over them, on a hob at the top."""
    burners, grates = [], []
    cell = width / columns
    for x in spread(columns, width - cell):
        for y in (-0.13, 0.12):
            radius = sampler.uniform(0.028, 0.055)
            burners.append(cylinder(radius, 0.014, (x, y, TOP_M), 12))
            burners.append(cylinder(radius * 0.7, 0.024, (x, y, TOP_M), 12))
        half = cell / 2 - 0.012
        z = TOP_M + 0.036
        for side in (-1, 1):
            grates.append(box((0.012, 0.5, 0.012), (x + side * half, -0.005, z)))
            grates += [
                box((0.014, 0.014, 0.038), (x + side * half, y, TOP_M)) for y in (-0.24, 0.23)
            ]
        grates += [box((2 * half, 0.012, 0.012), (x, y, z)) for y in (-0.249, -0.005, 0.239)]
        grates.append(box((0.012, 0.5, 0.014), (x, -0.005, z)))
        grates += [box((2 * half, 0.012, 0.014), (x, y, z)) for y in (-0.13, 0.12)]
    return burners, grates


def oven_casing(sampler: Sampler, width: float, low: float) -> tuple[list[Mesh], list[Mesh]]:
    """The casing behind the fronts and what it stands on."""
    casing = [box((width, DEPTH_M - 0.055, TOP_M - low - 0.03), (0, 0.0275, low))]
    if sampler.chance(0.5):
        return casing, feet(width, DEPTH_M - 0.06, low + 0.002)
    return casing, [box((width - 0.02, DEPTH_M - 0.12, low), (0, 0.04, 0))]
