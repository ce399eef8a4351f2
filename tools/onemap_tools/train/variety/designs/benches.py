"""Benches: tufted, hallway with shoe shelf, storage chest."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import (
    Mesh,
    box,
    cylinder,
    ellipsoid,
    rod,
    rounded_box,
)
from onemap_simulator.generation.model import Model, support_surface
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.seat_shapes import (
    SIDES,
    bent,
    corners,
    grounded,
    outline,
    slab,
    standing,
    swept,
    tufts,
    turned,
)


def _low_legs(sampler: Sampler, width: float, depth: float, height: float) -> list[Mesh]:
    """Legs under a long seat: turned, tapered, hairpin, curved or square frames."""
    kind = sampler.choice(["turned", "splayed", "hairpin", "frame", "cabriole"])
    x, y, meshes = width / 2 - 0.07, depth / 2 - 0.05, []
    if kind == "frame":
        for s in SIDES:
            bar = sampler.choice([0.03, 0.04])
            meshes += [box((bar, bar, height), (s * x, d * y, 0)) for d in SIDES]
            meshes.append(box((bar, 2 * y, bar), (s * x, 0, 0.002)))
        return meshes
    r = sampler.uniform(0.018, 0.028)
    vase = [(r * 0.5, 0.0), (r * 0.9, 0.1), (r * 0.6, 0.25), (r * 1.3, 0.6), (r * 0.7, 0.8)]
    for sx, sy in corners(2, 2):
        at = (sx * x, sy * y, height)
        if kind == "turned":
            meshes.append(turned((sx * x, sy * y, 0), at, [*vase, (r * 1.2, 0.85), (r * 1.2, 1.0)]))
        elif kind == "splayed":
            meshes.append(grounded((sx * (x + 0.04), sy * (y + 0.03), 0), at, (r * 0.5, r)))
        elif kind == "hairpin":
            foot = (sx * (x + 0.03), sy * (y + 0.02), 0.0)
            ends = (sx * x - 0.045, sy * y, height), (sx * x + 0.045, sy * y, height)
            meshes.append(swept(bent([ends[0], foot, ends[1]], 0.02), 0.006, 6))
        else:
            knee = (sx * (x + 0.03), sy * (y + 0.02), height * 0.7)
            path = [
                at,
                knee,
                (sx * (x - 0.01), sy * y, height * 0.2),
                (sx * (x + 0.03), sy * y, 0.01),
            ]
            meshes.append(swept(bent(path, 0.12), r * 0.75))
    return meshes


def tufted_bench(sampler: Sampler) -> Model:
    """A bedroom bench: a thick buttoned or channelled pad, perhaps rolled ends, on short legs."""
    width, depth, height = sampler.size(1.0, 1.5), sampler.size(0.38, 0.5), sampler.size(0.43, 0.52)
    thick = sampler.uniform(0.09, 0.18)
    z, pad, trim = height - thick, [], []
    style = sampler.choice(["buttons", "channels", "plain", "blocks"])
    if style in ("channels", "blocks"):
        count = sampler.integer(5, 11) if style == "channels" else sampler.integer(2, 4)
        each = width / count
        for index in range(count):
            at = ((index - (count - 1) / 2) * each, 0, z)
            pad.append(rounded_box((each * 1.02, depth, thick), at, min(each * 0.3, 0.05)))
    else:
        shape = outline(width, width, depth, sampler.choice([6.0, 14.0]))
        pad.append(slab(shape, thick, (0, 0, z), 0.25))
        if style == "buttons":
            xs = np.linspace(-width * 0.4, width * 0.4, sampler.integer(4, 8))
            trim = tufts(xs, np.linspace(-depth * 0.3, depth * 0.3, sampler.integer(2, 3)), height)
    if sampler.chance(0.25):
        roll = sampler.uniform(0.06, 0.09)
        for s in SIDES:
            end = cylinder(roll, depth, (0, 0, -depth / 2), 14).rotated("x", 90)
            pad.append(end.translated(s * (width / 2 - roll * 0.7), 0, height + roll * 0.5))
    if sampler.chance(0.3):
        trim += [box((width * 0.98, 0.006, 0.014), (0, s * depth / 2, z + 0.01)) for s in SIDES]
    rail = [box((width * 0.96, depth * 0.9, 0.03), (0, 0, z - 0.025))]
    legs = _low_legs(sampler, width, depth, z - 0.02)
    if sampler.chance(0.3):
        legs.append(box((width - 0.16, 0.03, 0.03), (0, 0, z * 0.35)))
        legs += [
            box((0.03, depth - 0.1, 0.03), (s * (width / 2 - 0.07), 0, z * 0.35)) for s in SIDES
        ]
    frame = sampler.wood() if sampler.chance(0.6) else sampler.metal()
    return standing(
        "bench",
        (sampler.upholstery(), pad),
        (sampler.metal(), trim),
        (frame, [*rail, *legs]),
        support_surfaces=(support_surface(width, depth, height),),
    )


def hallway_bench(sampler: Sampler) -> Model:
    """A hallway bench: a seat over shoe shelves of boards or slats, perhaps with a cushion."""
    width, depth, height = sampler.size(0.7, 1.3), sampler.size(0.3, 0.4), sampler.size(0.42, 0.5)
    thick, open_frame = sampler.uniform(0.016, 0.032), sampler.chance(0.5)
    half, reach = width / 2 - thick / 2, depth / 2 - 0.045
    top = height - (0.05 if sampler.chance(0.5) else 0.0)
    frame, boards, pad = [], [box((width, depth, thick), (0, 0, top - thick))], []
    if top < height:
        count = sampler.choice([1, 1, 2, 3])
        each = (width - 0.01) / count
        for index in range(count):
            middle = (index - (count - 1) / 2) * each
            pad.append(rounded_box((each - 0.004, depth, 0.052), (middle, 0, top - 0.002), 0.022))
    if open_frame:
        bar = sampler.uniform(0.02, 0.03)
        for s in SIDES:
            for d in SIDES:
                x, y = s * (width / 2 - bar / 2), d * (depth / 2 - bar / 2)
                frame.append(box((bar, bar, top - thick), (x, y, 0)))
        frame += [box((0.014, depth - bar, 0.02), (s * (half - 0.002), 0, 0.1)) for s in SIDES]
    else:
        frame = [box((thick, depth - 0.004, top - thick), (s * half, 0, 0)) for s in SIDES]
    inner = width - 2 * thick - 0.004 if not open_frame else width - 0.012
    for z in np.linspace(0.08, top * 0.5, sampler.integer(1, 2)).tolist():
        if sampler.chance(0.5):
            boards.append(box((inner, depth - 0.03, thick * 0.8), (0, 0, z)))
        else:
            for at in np.linspace(-reach, reach, sampler.integer(3, 5)).tolist():
                boards.append(
                    rod((-inner / 2, at, z + 0.012), (inner / 2, at, z + 0.012), 0.009, 6)
                )
    if not open_frame:
        for index in range(1, sampler.integer(1, 4)):
            at = -inner / 2 + inner * index / 4
            boards.append(box((thick * 0.8, depth - 0.034, top - thick - 0.07), (at, 0, 0.07)))
    wood = sampler.wood()
    sides = sampler.metal() if open_frame else wood
    return standing(
        "bench",
        (wood, boards),
        (sides, frame),
        (sampler.upholstery(), pad),
        support_surfaces=(support_surface(width, depth, height),),
    )


def chest_bench(sampler: Sampler) -> Model:
    """A storage bench: a panelled or upholstered chest with a padded lid, shut or ajar."""
    width, depth, height = sampler.size(0.8, 1.4), sampler.size(0.36, 0.48), sampler.size(0.42, 0.5)
    base, lid = sampler.choice([0.0, 0.03, 0.08]), sampler.uniform(0.03, 0.09)
    soft, side, padded = sampler.chance(0.4), height - lid, lid > 0.05
    trim: list[Mesh] = []
    if soft:
        body = [rounded_box((width - 0.006, depth - 0.006, side - base), (0, 0, base), 0.015)]
    else:
        body = _open_chest((width - 0.01, depth - 0.01), base, side)
        fronts, trim = _chest_front(sampler, width - 0.01, depth, (base, side))
        body += fronts
    edge = lid * 0.4 if soft or padded else 0.004
    top = [rounded_box((width, depth, lid), (0, -depth / 2, 0), edge)]
    buttons: list[Mesh] = []
    if padded and sampler.chance(0.4):
        xs = np.linspace(-width * 0.38, width * 0.38, sampler.integer(4, 7))
        buttons = tufts(xs, [-depth * 0.7, -depth * 0.3], lid)
    ajar = not soft and sampler.chance(0.25)
    angle = -sampler.uniform(8, 60) if ajar else 0.0
    top, buttons = (
        [mesh.rotated("x", angle).translated(0, depth / 2, side - 0.003) for mesh in meshes]
        for meshes in (top, buttons)
    )
    feet: list[Mesh] = []
    if base > 0.05:
        at = corners(width - 0.14, depth - 0.12)
        feet = [ellipsoid((0.04, 0.04, base * 0.55), (x, y, base * 0.55), 10) for x, y in at]
    elif base:
        feet = [box((width - 0.06, depth - 0.06, base + 0.002))]
    cover = sampler.upholstery()
    shell = cover if soft else sampler.wood()
    return standing(
        "bench",
        (shell, body),
        (cover if soft or padded else shell, top),
        (sampler.metal(), [*trim, *buttons]),
        (sampler.wood(), feet),
        support_surfaces=() if ajar else (support_surface(width, depth, height - 0.003),),
    )


def _open_chest(size: tuple[float, float], low: float, high: float) -> list[Mesh]:
    """Four walls and a floor."""
    width, depth = size
    walls = [box((width, 0.018, high - low), (0, s * (depth / 2 - 0.009), low)) for s in SIDES]
    ends = (0.018, depth - 0.036, high - low)
    walls += [box(ends, (s * (width / 2 - 0.009), 0, low)) for s in SIDES]
    return [*walls, box((width - 0.036, depth - 0.036, 0.015), (0, 0, low + 0.002))]


def _chest_front(
    sampler: Sampler, width: float, depth: float, span: tuple[float, float]
) -> tuple[list[Mesh], list[Mesh]]:
    """What divides the front (frames, planks, drawers or nothing) and its handles."""
    (low, high), front, count = span, -depth / 2 + 0.005, sampler.integer(2, 4)
    each, tall, boards, handles = width / count, high - low, list[Mesh](), list[Mesh]()
    kind = sampler.choice(["frames", "planks", "drawers", "plain"])
    for index in range(0 if kind == "plain" else count):
        at = (index - (count - 1) / 2) * each
        if kind == "frames":
            boards += [box((each, 0.02, 0.05), (at, front, z)) for z in (low + 0.002, high - 0.052)]
            rail = (0.045, 0.018, tall - 0.01)
            boards += [box(rail, (at + s * (each / 2 - 0.024), front, low)) for s in SIDES]
        elif kind == "planks":
            boards.append(box((each - 0.012, 0.02, tall - 0.01), (at, front, low + 0.004)))
        else:
            boards.append(box((each - 0.016, 0.024, tall - 0.03), (at, front, low + 0.012)))
            y, z = front - 0.035, high - 0.09
            handles.append(rod((at - 0.05, y, z), (at + 0.05, y, z), 0.006))
            handles += [rod((at + s * 0.04, front, z), (at + s * 0.04, y, z), 0.005) for s in SIDES]
    return boards, handles


DESIGNS: dict[str, tuple[ModelFactory, ...]] = {"bench": (tufted_bench, hallway_bench, chest_bench)}
