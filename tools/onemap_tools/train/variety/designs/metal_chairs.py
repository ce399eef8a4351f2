"""Chairs on metal frames: cantilever, pressed sheet, school, folding."""

from __future__ import annotations

import numpy as np

from onemap_shared.geometry import F64
from onemap_simulator.generation.mesh import Mesh, box, cylinder, rod, rounded_box
from onemap_simulator.generation.model import Model
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.seat_shapes import (
    SIDES,
    beam,
    bent,
    corners,
    grounded,
    outline,
    sheet,
    skin,
    slab,
    standing,
    strip,
    swept,
)


def cantilever_chair(sampler: Sampler) -> Model:
    """A cantilever chair: one run of bent tube as runners, seat frame and back, no rear legs."""
    width, seat_h = sampler.size(0.44, 0.52), sampler.size(0.43, 0.47)
    back_h = sampler.size(0.78, 0.92)
    x, front, rear = width / 2, -0.25, 0.22
    r, lean = sampler.uniform(0.011, 0.016), sampler.uniform(0.04, 0.12)
    side = [
        (x, rear, r),
        (x, front, r),
        (x, front, seat_h - 0.03),
        (x, rear - 0.03, seat_h - 0.05),
        (x, rear + lean, back_h),
    ]
    other = [(-px, py, pz) for px, py, pz in side[::-1]]
    frame, wood = [swept(bent([*other, *side], 0.07, 5), r)], []
    rail = (rear + lean - 0.005, back_h - 0.03)
    frame.append(rod((-x, *rail), (x, *rail), r))
    if sampler.chance(0.4):
        for s in SIDES:
            start, knee = (s * x, front + 0.04, seat_h - 0.03), (s * x * 1.1, front, 0.66)
            frame.append(swept(bent([start, knee, (s * x, rear + 0.05, 0.67)], 0.1), r * 0.9))
            wood.append(rounded_box((0.04, 0.26, 0.02), (s * x * 1.06, -0.04, 0.672), 0.01))
    padded = sampler.chance(0.5)
    thick = sampler.uniform(0.03, 0.05) if padded else 0.01
    seat = [rounded_box((width - 0.01, 0.43, thick + 0.01), (0, -0.02, seat_h - 0.028), 0.02)]
    low, high = seat_h + sampler.uniform(0.1, 0.2), back_h - sampler.uniform(0.0, 0.04)
    slope = (lean + 0.03) / (back_h - seat_h)
    rises = [(rear - 0.03 + slope * (z - seat_h), z) for z in (low, high)]
    grid = np.array([[(-x * t, *rise) for rise in rises] for t in np.linspace(1, -1, 5)])
    seat.append(sheet(grid, thick + 2 * r if padded else 0.014))
    cover = sampler.upholstery()
    return standing("chair", (sampler.metal(), frame), (cover, seat), (sampler.wood(), wood))


def sheet_metal_chair(sampler: Sampler) -> Model:
    """An industrial chair of pressed sheet: tapering channel legs, a hoop back with a splat."""
    width, seat_h = sampler.size(0.36, 0.42), sampler.size(0.43, 0.47)
    back_h = sampler.size(0.76, 0.88)
    foot, hip, top = width * 0.56, width * 0.46, seat_h - 0.02
    meshes = [_channel_leg(sx, sy, foot, hip, top) for sx, sy in corners(2, 2)]
    shape = outline(hip * 2, hip * 2 * sampler.uniform(0.88, 1.0), hip * 2, 6.0)
    meshes.append(slab(shape, 0.028, (0, 0, seat_h - 0.028), 0.35))
    meshes.append(box((2 * hip - 0.03, 2 * hip - 0.03, 0.05), (0, 0, top - 0.05)))
    if sampler.chance(0.6):
        z, r = top * 0.45, (foot + hip) / 2 - 0.03
        meshes += [rod((-r, s * -r, z), (r, s * r, z), 0.008) for s in SIDES]
    lean, x, y = 0.07, hip * 0.93, hip * 0.9
    hoop = [(-x, y, top), (-x * 1.05, y + lean, back_h), (x * 1.05, y + lean, back_h), (x, y, top)]
    hoop_r = sampler.uniform(0.011, 0.016)
    meshes.append(swept(bent(hoop, sampler.uniform(0.06, 0.16), 6), hoop_r))
    if sampler.chance(0.75):
        wide, rise = sampler.uniform(0.03, 0.11), back_h - seat_h
        for t in (-0.7, 0.0, 0.7) if sampler.chance(0.3) else (0.0,):
            ends = (t * x, y - 0.005, seat_h - 0.01), (t * x, y + lean - 0.005, seat_h + rise)
            meshes.append(beam(*ends, (wide * (0.5 if t else 2.0), 0.006)))
    else:
        z = seat_h + (back_h - seat_h) * 0.45
        board = (-x, y + lean * 0.45, z), (x, y + lean * 0.45, z)
        meshes.append(strip(*board, (back_h - z) * 0.97, 0.035, 0.008))
    seat = [slab(shape * 0.97, 0.02, (0, 0, seat_h - 0.002), 0.3)] if sampler.chance(0.4) else []
    pads = [box((0.036, 0.036, 0.012), (*at, 0)) for at in corners(*[2 * foot - 0.034] * 2)]
    metal = sampler.metal() if sampler.chance(0.5) else sampler.enamel()
    return standing("chair", (metal, meshes), (sampler.wood(), seat), (sampler.dark(), pads))


def _channel_leg(sx: float, sy: float, foot: float, hip: float, top: float) -> Mesh:
    """A corner leg of folded sheet that widens upwards."""
    fold = [(0.5, 0.5), (-0.5, 0.5), (-0.5, 0.3), (0.25, 0.25), (0.3, -0.5), (0.5, -0.5)]
    section = np.array(fold if sx * sy > 0 else fold[::-1]) * (sx, sy)
    rings = np.zeros((2, 6, 3))
    rings[0, :, :2] = section * 0.035 + np.array([sx, sy]) * (foot - 0.017)
    rings[1, :, :2] = section * 0.085 + np.array([sx, sy]) * (hip - 0.042)
    rings[1, :, 2] = top
    return skin(rings)


def school_chair(sampler: Sampler) -> Model:
    """A school chair: a bent steel tube frame with a plywood or plastic seat and back board."""
    scale = sampler.choice([0.72, 1.0, 1.0])
    width, seat_h = sampler.size(0.38, 0.44) * scale, sampler.size(0.42, 0.46) * scale
    back_h = sampler.size(0.76, 0.84) * scale
    x, y, r = width / 2 - 0.02, 0.2 * scale, sampler.uniform(0.009, 0.013)
    frame = []
    for s in SIDES:
        low = [(s * x, -y - 0.02, 0.0), (s * x, -y, seat_h - 0.02)]
        high = [(s * x, y, seat_h - 0.03), (s * x, y + 0.06, back_h)]
        frame.append(swept(bent([*low, *high], 0.06), r))
        frame.append(grounded((s * x, y + 0.06, 0), (s * x, y * 0.3, seat_h - 0.025), (r, r)))
    for at, z in ((-y * 0.5, seat_h - 0.023), (y * 0.6, seat_h - 0.028)):
        frame.append(rod((-x, at, z), (x, at, z), r * 0.8))
    if sampler.chance(0.5):
        frame += [rod((s * x, -y - 0.01, 0.1), (s * x, y + 0.045, 0.1), r * 0.8) for s in SIDES]
    boards = [sheet(_dished(width, 0.4 * scale, seat_h), 0.012)]
    tall = sampler.uniform(0.1, 0.2) * scale
    z = back_h - tall * 0.95
    at = y + 0.06 * (z - seat_h) / (back_h - seat_h) - 0.02
    boards.append(strip((-x - 0.012, at, z), (x + 0.012, at, z), tall, 0.03, 0.012))
    cover = sampler.wood() if sampler.chance(0.6) else sampler.plastic()
    ends = [(s * x, at) for s in SIDES for at in (-y - 0.02, y + 0.06)]
    feet = [cylinder(r * 1.5, 0.02, (*end, 0), 8) for end in ends]
    return standing("chair", (sampler.metal(), frame), (cover, boards), (sampler.dark(), feet))


def _dished(width: float, depth: float, height: float) -> F64:
    """Points of a seat that is hollow across and falls off at its front edge."""
    x, v = np.meshgrid(np.linspace(-1, 1, 7), np.linspace(-1, 1, 7), indexing="ij")
    z = height - 0.012 * (1 - x**2) - 0.03 * np.clip(-v - 0.6, 0, 1) + 0.012 * np.clip(v, 0, 1)
    return np.stack([x * width / 2, v * depth / 2, z], axis=-1)


def folding_chair(sampler: Sampler) -> Model:
    """A folding chair: crossed side frames, a slatted or plain seat and a short back."""
    width, seat_h = sampler.size(0.4, 0.46), sampler.size(0.42, 0.46)
    back_h = sampler.size(0.76, 0.9)
    front, rear = -sampler.size(0.2, 0.24), sampler.size(0.2, 0.24)
    x, gap, tubes = width / 2 - 0.015, 0.028, sampler.chance(0.5)
    frame = sampler.metal() if tubes else sampler.wood()
    top = (front + (rear - front) * 0.75 / seat_h * back_h - 0.06) * 0.9
    meshes = []
    for s in SIDES:
        long = (s * x, front, 0.0), (s * x, top, back_h)
        short = (s * (x - gap), rear, 0.0), (s * (x - gap), front * 0.7, seat_h - 0.01)
        for run in (long, short):
            meshes.append(grounded(*run, (0.011, 0.011)) if tubes else beam(*run, (0.02, 0.036)))
    for y, z, reach in ((front * 0.75, 0.09, x), (rear * 0.8, 0.07, x - gap)):
        meshes.append(rod((-reach, y, z), (reach, y, z), 0.009))
    seat: list[Mesh] = []
    deep, wide, count = sampler.uniform(0.34, 0.38), width - 0.05, sampler.choice([1, 1, 4, 6])
    for y in ((np.arange(count) - (count - 1) / 2) * deep / count).tolist():
        size = (wide, deep / count * (1.0 if count == 1 else 0.75), 0.018)
        seat.append(rounded_box(size, (0, y, seat_h - 0.01), 0.008))
    slope, boards = (top - front) / back_h, sampler.choice([1, 2])
    tall = sampler.uniform(0.1, 0.16) if boards == 1 else 0.06
    for z in (back_h - tall - 0.01, back_h - 0.17)[:boards]:
        at = front + slope * (z + tall / 2) - 0.012
        seat.append(strip((-x - 0.01, at, z), (x + 0.01, at, z), tall, 0.02, 0.014))
    cover = frame if sampler.chance(0.3) else sampler.choice([sampler.plastic, sampler.wood])()
    return standing("chair", (frame, meshes), (cover, seat))


DESIGNS: dict[str, tuple[ModelFactory, ...]] = {
    "chair": (cantilever_chair, sheet_metal_chair, school_chair, folding_chair)
}
