"""Stools: milking, padded low, saddle, tractor, step, folding, garden drum, stacking, gas lift."""

from __future__ import annotations

import numpy as np

from onemap_shared.geometry import F64
from onemap_simulator.generation.mesh import box, cylinder, lathe, rod, rounded_box, torus
from onemap_simulator.generation.model import Model
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.seat_shapes import (
    SIDES,
    beam,
    bent,
    corners,
    cushion,
    grounded,
    outline,
    sheet,
    slab,
    standing,
    swept,
    tufts,
    turned,
)


def milking_stool(sampler: Sampler) -> Model:
    """A milking stool: a thick round or half-round board on three or four pegged legs."""
    height, radius = sampler.size(0.26, 0.5), sampler.size(0.14, 0.2)
    thick, count = sampler.uniform(0.025, 0.06), sampler.choice([3, 3, 4])
    shape = outline(2 * radius, 2 * radius, radius * sampler.uniform(1.5, 2.0), 2.0)
    if sampler.chance(0.25):
        shape[:, 1] = np.minimum(shape[:, 1], radius * 0.25)
    seat = [slab(shape, thick, (0, 0, height - thick), sampler.uniform(0.1, 0.45))]
    r, spread = sampler.uniform(0.013, 0.022), sampler.uniform(1.0, 1.3)
    tapers = [
        [(r * 0.7, 0.0), (r, 0.6), (r, 1.0)],
        [(r * 0.8, 0.0), (r * 1.3, 0.3), (r * 0.7, 0.4), (r * 1.3, 0.7), (r, 1.0)],
        [(r * 1.2, 0.0), (r * 0.9, 1.0)],
    ]
    profile, pegged, legs = sampler.choice(tapers), sampler.chance(0.5), []
    feet = []
    for angle in (np.arange(count) * 2 * np.pi / count - np.pi / 2 + np.pi / count).tolist():
        x, y = radius * float(np.cos(angle)), radius * float(np.sin(angle)) * 0.85
        feet.append((x * spread * 0.8, y * spread * 0.8, height * 0.35))
        top = (x * 0.52, y * 0.42, height + 0.003 if pegged else height - thick * 0.5)
        legs.append(turned((x * spread, y * spread, 0.0), top, profile))
    if sampler.chance(0.3):
        for a, b in zip(feet, feet[1:] + feet[:1], strict=True):
            legs.append(rod(a, b, r * 0.55))
    wood = sampler.wood()
    top_material = wood if sampler.chance(0.6) else sampler.wood()
    return standing("stool", (top_material, seat), (wood, legs))


def padded_stool(sampler: Sampler) -> Model:
    """A low upholstered stool: a fat round or square pad, buttons or piping, short legs."""
    height, width = sampler.size(0.36, 0.5), sampler.size(0.36, 0.5)
    depth, square = width * sampler.uniform(0.75, 1.0), sampler.choice([2.0, 2.0, 4.0, 8.0])
    thick = sampler.uniform(0.1, height * 0.6)
    shape, z = outline(width, width, depth, square), height - thick
    pad = [cushion(shape, thick, (0, 0, z))]
    trim = []
    if sampler.chance(0.5):
        ring = np.column_stack([shape * 1.0, np.full(len(shape), z + thick * 0.4)])
        trim.append(swept(ring, 0.008, 6, closed=True))
    if sampler.chance(0.4):
        trim += tufts([0.0], [0.0], height - 0.002, 0.018)
    if sampler.chance(0.3):
        pad.append(slab(shape * 0.97, 0.06, (0, 0, z - 0.055), 0.1))
        z -= 0.055
    reach, flare, legs = sampler.uniform(0.5, 0.62), sampler.choice([1.0, 1.25]), []
    for x, y in corners(width, depth):
        foot = (x * reach * flare, y * reach * flare, 0.0)
        legs.append(grounded(foot, (x * reach, y * reach, z + 0.02), (0.01, 0.02)))
    if sampler.chance(0.35):
        plinth = [(0.42, 0.0), (0.42, 0.02), (0.25, 0.05), (0.1, 0.08), (0.1, z + 0.01)]
        legs = [lathe([(r * depth, h) for r, h in plinth], segments=18)]
    frame = sampler.wood() if sampler.chance(0.6) else sampler.metal()
    second = sampler.upholstery() if sampler.chance(0.5) else sampler.metal()
    return standing("stool", (sampler.upholstery(), pad), (second, trim), (frame, legs))


def _saddle_grid(width: float, depth: float, height: float, dip: float) -> F64:
    """Points of a seat that is hollow from side to side."""
    x, y = np.meshgrid(np.linspace(-1, 1, 9), np.linspace(-1, 1, 5), indexing="ij")
    z = height - dip * (1 - x**2) - dip * 0.3 * y**2
    return np.stack([x * width / 2, y * depth / 2, z], axis=-1)


def saddle_stool(sampler: Sampler) -> Model:
    """A bar or counter stool: a hollow saddle seat on four leaning square legs with rungs."""
    height, width = sampler.size(0.6, 0.8), sampler.size(0.38, 0.46)
    depth, thick = sampler.size(0.24, 0.32), sampler.uniform(0.025, 0.05)
    grid = _saddle_grid(width, depth, height - thick / 2, sampler.uniform(0.015, 0.05))
    seat = [sheet(grid, thick)]
    leg, flare = sampler.uniform(0.026, 0.04), sampler.uniform(1.05, 1.35)
    x, y, top = width * 0.36, depth * 0.34, height - thick - 0.012
    round_legs = sampler.chance(0.3)
    legs = []
    for sx, sy in corners(2, 2):
        low, high = (sx * x * flare, sy * y * flare, 0.0), (sx * x, sy * y, top)
        if round_legs:
            legs.append(grounded(low, high, (leg * 0.4, leg * 0.55)))
        else:
            legs.append(beam(low, high, (leg, leg)))
    for level in (0.3, 0.52)[: sampler.integer(1, 2)]:
        for at, across in ((level, False), (level + 0.08, True)):
            z, k = top * at, flare + (1 - flare) * at
            size = (0.016, 2 * y * k, 0.028) if across else (2 * x * k, 0.016, 0.028)
            offset = (x * k, 0.0) if across else (0.0, y * k)
            legs += [box(size, (s * offset[0], s * offset[1], z)) for s in SIDES]
    apron = [box((2 * x, 0.018, 0.05), (0, s * y, top - 0.06)) for s in SIDES]
    cover = sampler.wood() if sampler.chance(0.5) else sampler.upholstery()
    return standing("stool", (cover, seat), (sampler.wood(), [*legs, *apron]))


def tractor_stool(sampler: Sampler) -> Model:
    """A tractor seat: a dished pan with a cut front, on a screw and three or four iron legs."""
    height, width = sampler.size(0.45, 0.78), sampler.size(0.38, 0.44)
    u, v = np.meshgrid(np.linspace(0.06, 1, 6), np.linspace(-1, 1, 15), indexing="ij")
    angle = v * np.pi * 0.93 + np.pi / 2
    reach = 1 - 0.22 * np.exp(-((np.abs(v) - 1) ** 2) / 0.02)
    x, y = u * np.cos(angle) * width / 2 * reach, u * np.sin(angle) * width * 0.44 * reach
    lip = sampler.uniform(0.08, 0.15)
    z = height - lip + u**3 * lip * (0.45 + 0.55 * np.clip(np.sin(angle), -0.4, 1))
    seat = [
        sheet(np.stack([x, y, z], axis=-1), 0.012),
        cylinder(0.05, 0.02, (0, 0, height - lip - 0.022)),
    ]
    count, metal = sampler.choice([3, 4]), sampler.metal()
    hub = (height - lip) * sampler.uniform(0.5, 0.75)
    frame = [cylinder(0.016, height - lip - hub + 0.1, (0, 0, hub - 0.11), 8)]
    frame.append(cylinder(0.036, 0.05, (0, 0, hub - 0.05), 12))
    spread, curved = sampler.uniform(0.2, 0.26), sampler.chance(0.5)
    for angle_of in (np.arange(count) * 2 * np.pi / count + np.pi / 6).tolist():
        c, s = float(np.cos(angle_of)), float(np.sin(angle_of))
        path = [(c * 0.02, s * 0.02, hub - 0.02), (c * spread, s * spread, 0.0)]
        if curved:
            path.insert(1, (c * spread * 0.75, s * spread * 0.75, hub - 0.03))
        frame.append(swept(bent(path, 0.2), 0.012))
    ring = 0.3 * hub
    at = spread * (1.0 if curved else 0.72)
    if sampler.chance(0.7):
        frame.append(torus(at * 0.99, 0.009, (0, 0, ring), 20))
    cover = metal if sampler.chance(0.4) else sampler.choice([sampler.wood, sampler.plastic])()
    return standing("stool", (cover, seat), (metal, frame))


def step_stool(sampler: Sampler) -> Model:
    """A step stool: two or three treads between boards or tubes."""
    width, steps = sampler.size(0.36, 0.46), sampler.choice([2, 2, 2, 3])
    rise, run = sampler.uniform(0.19, 0.25), sampler.uniform(0.17, 0.23)
    thick = sampler.uniform(0.016, 0.025)
    treads, frame = [], []
    depth = steps * run
    for index in range(steps):
        y = -depth / 2 + (index + 0.5) * run
        size = (width, run + 0.015, thick)
        treads.append(rounded_box(size, (0, y, (index + 1) * rise - thick), 0.006))
    kind, x = sampler.choice(["boards", "tubes", "plastic"]), width / 2 - 0.025
    for s in SIDES:
        for index in range(steps):
            y, high = -depth / 2 + (index + 0.5) * run, (index + 1) * rise - thick
            if kind == "tubes":
                frame.append(rod((s * x, y - run / 2 - 0.02, 0.01), (s * x, y, high), 0.011))
                frame.append(rod((s * x, y + run / 2, 0.01), (s * x, y + run * 0.3, high), 0.011))
            elif kind == "boards":
                frame.append(box((0.02, run + 0.002, high), (s * x, y, 0)))
            else:
                frame.append(beam((s * x, y, 0), (s * (x - 0.02), y, high), (0.03, run)))
        if kind == "tubes":
            frame.append(rod((s * x, -depth / 2 - 0.02, 0.1), (s * x, depth / 2, 0.1), 0.009))
    if kind != "tubes" and sampler.chance(0.6):
        frame.append(box((width - 0.06, 0.018, rise * 0.7), (0, depth / 2 - 0.03, rise * 0.6)))
    grips = [
        box(
            (width * 0.8, 0.012, 0.004),
            (0, -depth / 2 + (i + 0.5) * run + d, (i + 1) * rise - 0.001),
        )
        for i in range(steps)
        for d in (-0.05, 0.0, 0.05)
    ]
    body = sampler.plastic() if kind == "plastic" else sampler.wood()
    sides = sampler.metal() if kind == "tubes" else body
    grips = grips if sampler.chance(0.5) else []
    return standing("stool", (body, treads), (sides, frame), (sampler.dark(), grips))


def crossed_stool(sampler: Sampler) -> Model:
    """A stool on crossed legs: slung canvas, or a padded top over curved or straight crosses."""
    width, depth, height = sampler.size(0.4, 0.55), sampler.size(0.34, 0.42), sampler.size(0.4, 0.5)
    x, y, sling = width / 2 - 0.02, depth / 2 - 0.02, sampler.chance(0.45)
    frame, seat = [], []
    thick = sampler.uniform(0.018, 0.032)
    curved = sampler.chance(0.35)
    top = height if sling else height - sampler.uniform(0.06, 0.12)
    for s in SIDES:
        for d in SIDES:
            yy = s * y + d * thick * 0.52
            if curved:
                mid = top * 0.5
                path = [
                    (d * x, yy, 0.012),
                    (d * x * 0.75, yy, mid * 0.75),
                    (-d * x * 0.75, yy, mid * 1.25),
                ]
                frame.append(swept(bent([*path, (-d * x, yy, top - 0.01)], 0.15), thick * 0.6))
            else:
                frame.append(beam((d * x, yy, 0.0), (-d * x, yy, top), (thick * 1.4, thick)))
    for s in SIDES:
        frame.append(rod((s * x * 0.96, -y, top - 0.025), (s * x * 0.96, y, top - 0.025), 0.013))
        if sling or sampler.chance(0.5):
            frame.append(rod((s * x * 0.8, -y, top * 0.1), (s * x * 0.8, y, top * 0.1), 0.011))
    frame.append(rod((0, -y - 0.02, top / 2), (0, y + 0.02, top / 2), 0.01))
    if sling:
        grid = _saddle_grid(width - 0.02, depth - 0.1, height - 0.005, sampler.uniform(0.03, 0.09))
        seat.append(sheet(grid, 0.008))
    else:
        shape = outline(width, width, depth, 7.0)
        seat.append(cushion(shape, height - top + 0.02, (0, 0, top - 0.02)))
        frame.append(slab(shape * 0.97, 0.03, (0, 0, top - 0.035), 0.1))
    wood = sampler.wood() if sampler.chance(0.7) else sampler.metal()
    return standing("stool", (wood, frame), (sampler.upholstery(), seat))


DESIGNS: dict[str, tuple[ModelFactory, ...]] = {
    "stool": (milking_stool, padded_stool, saddle_stool, tractor_stool, step_stool, crossed_stool)
}
