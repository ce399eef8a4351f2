"""Chairs of the dining room and garden: Windsor, wishbone, parsons, plastic."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import Mesh, cylinder, rod, rounded_box
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
    strip,
    swept,
    turned,
)


def windsor_chair(sampler: Sampler) -> Model:
    """A Windsor: a thick saddle seat, spindles under a hoop or comb, turned legs with an H."""
    width, depth, seat_h = sampler.size(0.4, 0.5), sampler.size(0.4, 0.45), sampler.size(0.42, 0.46)
    r = sampler.uniform(0.014, 0.02)
    plain = [(r * 0.8, 0.0), (r * 1.1, 0.6), (r * 0.9, 1.0)]
    fancy = [(r * 0.7, 0.0), (r, 0.2), (r * 0.7, 0.35), (r * 1.4, 0.5), (r * 0.8, 0.6)]
    profile = sampler.choice([plain, [*fancy, (r * 1.2, 0.9)]])
    top, meshes = seat_h - 0.035, []
    feet = np.array(corners(width * 0.98, depth * 0.95))
    hips = feet * (0.65, 0.62)
    for (fx, fy), (hx, hy) in zip(feet.tolist(), hips.tolist(), strict=True):
        meshes.append(turned((fx, fy, 0.0), (hx, hy, top + 0.01), profile))
    at = sampler.uniform(0.35, 0.5)
    x, y = (feet[3] + (hips[3] - feet[3]) * at).tolist()
    swell = [(0.007, 0.0), (0.012, 0.5), (0.007, 1.0)]
    meshes += [turned((s * x, -y, top * at), (s * x, y, top * at), swell) for s in SIDES]
    meshes.append(turned((-x, 0.0, top * at), (x, 0.0, top * at), swell))
    shape = outline(width, width * sampler.uniform(0.8, 0.95), depth, sampler.uniform(2.2, 3.2))
    seat = [slab(shape, 0.04, (0, 0, seat_h - 0.04), 0.3)]
    meshes += _spindle_back(sampler, width * 0.43, depth * 0.4, seat_h)
    wood = sampler.wood()
    second = wood if sampler.chance(0.5) else sampler.wood()
    return standing("chair", (wood, meshes), (second, seat))


def _spindle_back(sampler: Sampler, half: float, back_y: float, seat_h: float) -> list[Mesh]:
    rise, lean = sampler.size(0.42, 0.62), sampler.uniform(0.06, 0.13)
    hoop, top, rear = sampler.chance(0.5), seat_h + rise, back_y + lean
    meshes = []
    for t in np.linspace(-0.82, 0.82, sampler.integer(5, 8)).tolist():
        low = (t * half * 0.85, back_y - 0.03 * t**2, seat_h - 0.01)
        reach = rise * ((1 - abs(t) ** 4) ** 0.5 if hoop else 1.0) - 0.03
        high = (t * half, back_y + lean * reach / rise, seat_h + reach)
        meshes.append(rod(low, high, 0.006, 6))
    if hoop:
        x, y, wide = half * 0.9, back_y - 0.03, half * 1.12
        corner = [(-x, y, seat_h - 0.01), (-wide, rear, top), (wide, rear, top)]
        meshes.append(swept(bent([*corner, (x, y, seat_h - 0.01)], 0.3, 9), 0.011))
        return meshes
    rail = half * 1.08
    ends = (-rail, rear - 0.012, top - 0.035), (rail, rear - 0.012, top - 0.035)
    meshes.append(strip(*ends, sampler.uniform(0.05, 0.1), 0.02, 0.02))
    post = [(0.014, 0.0), (0.018, 0.5), (0.012, 1.0)]
    for s in SIDES:
        low = (s * half * 0.88, back_y - 0.02, seat_h - 0.01)
        meshes.append(turned(low, (s * half, rear - 0.005, top), post))
    return meshes


def wishbone_chair(sampler: Sampler) -> Model:
    """A wishbone chair: one bent rail as arms and back, a Y-shaped splat, a woven seat."""
    width, depth = sampler.size(0.5, 0.56), sampler.size(0.46, 0.52)
    seat_h, rail_h = sampler.size(0.42, 0.46), sampler.size(0.7, 0.78)
    front, x, y = width * 0.47, width * 0.36, depth * 0.44
    wide = width * 0.52
    meshes = [
        grounded((s * front, -y, 0), (s * front, -y, seat_h + 0.01), (0.013, 0.019)) for s in SIDES
    ]
    rail = bent(
        [
            (-wide, -depth * 0.1, rail_h - 0.03),
            (-wide, depth * 0.52, rail_h),
            (wide, depth * 0.52, rail_h),
            (wide, -depth * 0.1, rail_h - 0.03),
        ],
        0.24,
        7,
    )
    meshes.append(swept(rail, sampler.uniform(0.013, 0.018)))
    for s in SIDES:
        path = bent(
            [
                (s * x, y, 0),
                (s * x, y * 0.92, seat_h),
                (s * wide * 0.99, depth * 0.14, rail_h - 0.012),
            ],
            0.2,
        )
        meshes.append(swept(path, 0.015))
    back_y = depth * 0.5
    fork = (seat_h + rail_h) / 2 - 0.02
    if sampler.chance(0.7):
        meshes.append(beam((0, y, seat_h - 0.03), (0, back_y - 0.015, fork), (0.045, 0.01)))
        for s in SIDES:
            high = (s * 0.085, back_y, rail_h)
            meshes.append(beam((s * 0.012, back_y - 0.015, fork - 0.015), high, (0.024, 0.01)))
    else:
        for t in np.linspace(-0.1, 0.1, sampler.integer(3, 5)):
            meshes.append(rod((float(t), y, seat_h - 0.02), (float(t), back_y, rail_h), 0.007, 6))
    for z in (seat_h - 0.02, seat_h * 0.5):
        meshes += [rod((s * front, -y, z), (s * x, y, z), 0.012) for s in SIDES]
        meshes.append(rod((-x, y, z), (x, y, z), 0.012))
    meshes.append(rod((-front, -y, seat_h - 0.02), (front, -y, seat_h - 0.02), 0.013))
    shape = outline(2 * front + 0.01, 2 * x + 0.01, 2 * y + 0.01, 9.0)
    seat = [slab(shape, 0.03, (0, 0, seat_h - 0.025), 0.4)]
    return standing("chair", (sampler.wood(), meshes), (sampler.fabric(), seat))


def parsons_chair(sampler: Sampler) -> Model:
    """A parsons chair: seat and tall back covered all over, with legs or a skirt to the floor."""
    width, depth = sampler.size(0.44, 0.52), sampler.size(0.48, 0.56)
    seat_h, back_h = sampler.size(0.45, 0.5), sampler.size(0.92, 1.12)
    thick, lean = sampler.uniform(0.07, 0.1), sampler.uniform(0.03, 0.1)
    skirt, y = sampler.chance(0.25), depth / 2 - thick / 2
    crown = sampler.choice([0.0, 0.04, 0.09])
    base = 0.0 if skirt else seat_h - sampler.uniform(0.12, 0.17)
    body = [rounded_box((width, depth, seat_h - base), (0, 0, base), 0.01 if skirt else 0.03)]
    across, rows = np.linspace(1, -1, 9), np.linspace(0, 1, 5)
    rise = back_h - seat_h + 0.05
    grid = np.empty((9, 5, 3))
    grid[..., 0] = -across[:, None] * width / 2 * 0.97
    grid[..., 1] = y + lean * rows**1.5
    grid[..., 2] = seat_h - 0.05 + rows * (rise + crown * (1 - across[:, None] ** 2))
    body.append(sheet(grid, thick))
    trim: list[Mesh] = []
    buttons = sampler.choice([0, 0, 2, 3])
    for level in np.linspace(0.4, 0.85, buttons).tolist():
        for x in (-0.25, 0.0, 0.25):
            button = cylinder(0.014, 0.012, segments=8).rotated("x", 90)
            at = y + lean * level**1.5 - thick / 2
            trim.append(button.translated(x * width, at, seat_h - 0.05 + level * rise))
    if not buttons and sampler.chance(0.4):
        for z in (seat_h - 0.02, base + 0.02):
            front = -depth / 2 + 0.004
            trim.append(rod((-width * 0.47, front, z), (width * 0.47, front, z), 0.006, 6))
    legs: list[Mesh] = []
    size = sampler.uniform(0.035, 0.05)
    for sx, sy in [] if skirt else corners(width - 0.06, depth - 0.06):
        slant = 0.03 if sy > 0 else 0.0
        legs.append(beam((sx, sy + slant, 0), (sx, sy, base + 0.02), (size, size)))
    covers = sampler.upholstery(), sampler.metal(), sampler.wood()
    return standing("chair", *zip(covers, (body, trim, legs), strict=True))


def garden_chair(sampler: Sampler) -> Model:
    """A stacking plastic garden chair: arms and legs in one piece, slots in the back."""
    width, depth = sampler.size(0.5, 0.56), sampler.size(0.46, 0.52)
    seat_h, back_h = sampler.size(0.4, 0.44), sampler.size(0.78, 0.9)
    arm_h, lean = sampler.size(0.6, 0.66), sampler.uniform(0.07, 0.12)
    x, y = width / 2 - 0.03, depth / 2
    slope = lean / (back_h - seat_h)
    plate = outline(width - 0.06, width - 0.1, depth, 5.0)
    meshes = [slab(plate, 0.03, (0, 0, seat_h - 0.03), 0.4)]
    for s in SIDES:
        hip = (s * (x - 0.03), y - 0.02, seat_h - 0.005)
        meshes.append(beam((s * (x + 0.02), -y, 0), (s * x, -y + 0.04, arm_h), (0.05, 0.06)))
        meshes.append(beam((s * (x + 0.01), y + 0.06, 0), hip, (0.05, 0.06)))
        meshes.append(beam(hip, (s * x * 0.9, y + lean, back_h - 0.05), (0.05, 0.035)))
        rear = y + slope * (arm_h - seat_h)
        path = [(s * x, -y - 0.01), (s * (x + 0.01), 0.0), (s * (x - 0.03), rear)]
        grid = [[(px + t * 0.028, py, arm_h) for px, py in path] for t in (-1, 0, 1)]
        meshes.append(sheet(np.array(grid), 0.022))
    levels = [seat_h + 0.06, back_h - 0.09]
    for z, tall in zip(levels, (0.05, 0.09), strict=True):
        at = y + slope * (z - seat_h)
        meshes.append(strip((-x * 0.93, at, z), (x * 0.93, at, z), tall, 0.03, 0.016))
    slat = sampler.uniform(0.025, 0.04)
    for t in np.linspace(-0.78, 0.78, sampler.integer(4, 8)).tolist():
        bow, at = 0.03 * (1 - t**2), t * x * 0.9
        low = (at, y + lean * 0.1 + bow, levels[0] + 0.03)
        high = (at, y + lean * 0.85 + bow, levels[1] + 0.02)
        meshes.append(beam(low, high, (slat, 0.012)))
    if sampler.chance(0.5):
        rear, end = y + lean + 0.01, back_h - 0.04
        crest = [(-x * 0.9, rear, end), (0, rear + 0.03, end + 0.1), (x * 0.9, rear, end)]
        meshes.append(swept(bent(crest, 0.3, 8), 0.018))
    pads: list[Mesh] = []
    if sampler.chance(0.25):
        shape = outline(width - 0.14, width - 0.16, depth - 0.06, 6.0)
        pads = [cushion(shape, 0.05, (0, -0.01, seat_h - 0.002))]
    return standing("chair", (sampler.plastic(), meshes), (sampler.fabric(), pads))


DESIGNS: dict[str, tuple[ModelFactory, ...]] = {
    "chair": (windsor_chair, wishbone_chair, parsons_chair, garden_chair)
}
