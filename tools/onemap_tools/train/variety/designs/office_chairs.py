"""Chairs that turn: mesh and executive office chairs, gaming chair, task chair, banker's chair."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import Mesh, Vec, box, cylinder, ellipsoid, lathe, rod
from onemap_simulator.generation.mesh import rounded_box as pad
from onemap_simulator.generation.model import Model
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.seat_shapes import (
    SIDES,
    beam,
    bent,
    cushion,
    outline,
    sheet,
    slab,
    standing,
    strip,
    swept,
    tufts,
    turned,
)
from onemap_tools.train.variety.designs.swivel_parts import armrests, back_grid, star


def mesh_office_chair(sampler: Sampler) -> Model:
    """An office chair with a framed mesh back, perhaps a headrest and armrests."""
    seat_h, width = sampler.size(0.44, 0.52), sampler.size(0.46, 0.52)
    groups = star(sampler, sampler.size(0.29, 0.34), seat_h)
    rise, y, lean = sampler.size(0.48, 0.62), 0.22, sampler.uniform(0.05, 0.12)
    low, high = seat_h + 0.12, seat_h + 0.12 + rise
    grid = back_grid(width, (low, high), y, lean, sampler.uniform(0.02, 0.06))
    rim = np.concatenate([grid[0], grid[1:, -1], grid[-1, -2::-1], grid[-2:0:-1, 0]])
    frame = [swept(rim, sampler.uniform(0.01, 0.016), closed=True)]
    spine = [
        (0, 0.05, seat_h - 0.01),
        (0, y + 0.07, seat_h),
        (0, y + lean + 0.03, low + rise * 0.55),
    ]
    frame.append(swept(bent(spine, 0.06), 0.022))
    rib = grid[:, 4] + (0, 0.012, 0)
    frame.append(swept(rib, 0.012))
    covers = [sheet(grid, 0.008)]
    if sampler.chance(0.5):
        top = (0, y + lean + 0.03, high + 0.1)
        frame.append(swept(bent([tuple(rib[3]), (0, y + lean + 0.05, high), top], 0.05), 0.012))
        head = back_grid(
            sampler.uniform(0.24, 0.3), (high + 0.03, high + 0.17), y + lean, 0.0, 0.03
        )
        covers.append(sheet(head, 0.03))
    seat = [cushion(outline(width, width * 0.92, 0.48, 5.0), 0.08, (0, 0, seat_h))]
    if sampler.chance(0.75):
        posts, rests = armrests(sampler, width / 2 + 0.05, seat_h)
        frame += [*posts, *rests]
    return standing(
        "chair",
        *groups,
        (sampler.plastic(), frame),
        (sampler.fabric(), covers),
        (sampler.upholstery(), seat),
    )


def executive_chair(sampler: Sampler) -> Model:
    """A wide executive chair: thick stitched pads in rolls, padded arms, a high back."""
    seat_h, width = sampler.size(0.42, 0.48), sampler.size(0.5, 0.58)
    groups = star(sampler, sampler.size(0.31, 0.36), seat_h)
    lean, rolls, tall = sampler.uniform(0.06, 0.14), sampler.integer(2, 6), sampler.size(0.6, 0.75)
    thin = sampler.chance(0.4)
    thick = 0.06 if thin else sampler.uniform(0.11, 0.15)
    cover = [pad((width, 0.5, thick), (0, -0.02, seat_h), 0.05)]
    top = seat_h + (0.03 if thin else thick - 0.02)
    each = tall / rolls
    for index in range(rolls):
        z, t = top + index * each, (index + 0.5) / rolls
        wide = width * (1.0 if index < rolls - 1 or thin else 0.86)
        roll = pad((wide, thick, each + 0.012), (0, 0, 0), 0.05 if not thin else 0.025)
        cover.append(roll.rotated("x", -8).translated(0, 0.24 + lean * t, z))
    shell = beam(
        (0, 0.24 + thick * 0.45, seat_h), (0, 0.27 + lean, top + tall * 0.9), (width * 0.8, 0.03)
    )
    arms: list[Mesh] = []
    rests: list[Mesh] = []
    if sampler.chance(0.85):
        x, arm_h = width / 2 + 0.04, seat_h + sampler.uniform(0.2, 0.26)
        for s in SIDES:
            path = [(s * (x - 0.06), -0.14, seat_h + 0.02), (s * x, -0.24, arm_h)]
            ends = [(s * x, 0.12, arm_h), (s * (x - 0.03), 0.26, arm_h + 0.02)]
            arms.append(swept(bent([*path, *ends], 0.1), 0.02))
            rests.append(pad((0.07, 0.3, 0.045), (s * x, -0.06, arm_h + 0.005), 0.02))
    leather, frame = (
        sampler.upholstery(),
        sampler.metal() if sampler.chance(0.5) else sampler.wood(),
    )
    return standing("chair", *groups, (leather, [*cover, *rests]), (frame, [*arms, shell]))


def gaming_chair(sampler: Sampler) -> Model:
    """A gaming chair: a bucket seat with side wings, shoulder holes, neck and lumbar pillows."""
    seat_h, width = sampler.size(0.42, 0.48), sampler.size(0.5, 0.56)
    groups = star(sampler, sampler.size(0.32, 0.36), seat_h)
    tall, lean = sampler.size(0.74, 0.86), sampler.uniform(6, 16)
    main = [pad((width - 0.14, 0.5, 0.1), (0, -0.03, seat_h), 0.04)]
    wing = pad((0.09, 0.48, 0.14), (0, 0, 0), 0.04)
    wings = [
        wing.rotated("y", -s * 12).translated(s * (width / 2 - 0.03), -0.03, seat_h + 0.005)
        for s in SIDES
    ]
    half, second = width / 2, sampler.upholstery()
    back = [_bucket_grid(half, tall)]
    stripes = []
    for s in SIDES:
        ends = (s * half * 0.3, -0.045, tall * 0.05), (s * half * 0.42, -0.045, tall * 0.05)
        stripes.append(strip(*ends, tall * 0.65, 0.0, 0.012))
    holes = [pad((0.085, 0.1, 0.05), (s * half * 0.36, 0, tall * 0.79), 0.02) for s in SIDES]
    if sampler.chance(0.8):
        stripes.append(ellipsoid((0.13, 0.05, 0.065), (0, -0.075, tall * 0.88)))
    if sampler.chance(0.7):
        stripes.append(pad((0.3, 0.1, 0.17), (0, -0.08, 0.1), 0.045))
    back, stripes, holes = (
        [mesh.rotated("x", -lean).translated(0, 0.23, seat_h + 0.05) for mesh in meshes]
        for meshes in (back, stripes, holes)
    )
    hinge = cylinder(0.05, 0.03, (0, 0, -0.015), 12).rotated("y", 90)
    holes += [hinge.translated(s * half * 0.78, 0.2, seat_h + 0.05) for s in SIDES]
    posts, rests = armrests(sampler, width / 2 + 0.08, seat_h)
    return standing(
        "chair",
        *groups,
        (sampler.upholstery(), [*main, *back]),
        (second, [*wings, *stripes]),
        (sampler.dark(), [*holes, *posts, *rests]),
    )


def _bucket_grid(half: float, tall: float) -> Mesh:
    """The back of a racing seat: narrow below, shoulders, a narrow head, sides turned forwards."""
    rows = [(0.0, 0.72), (0.3, 0.78), (0.55, 1.0), (0.72, 1.0), (0.8, 0.7), (0.95, 0.62), (1, 0.45)]
    across = (-1, -0.5, 0, 0.5, 1)
    grid = np.array([[(t * half * w, 0.0, z * tall) for z, w in rows] for t in across])
    grid[[0, -1], :4, 1] -= 0.06
    return sheet(grid, 0.08)


def task_chair(sampler: Sampler) -> Model:
    """A task chair: a thin round or square seat and a small back on a steel strap."""
    seat_h, width = sampler.size(0.42, 0.6), sampler.size(0.38, 0.46)
    groups = star(sampler, sampler.size(0.25, 0.31), seat_h)
    thick, square = sampler.uniform(0.035, 0.08), sampler.choice([2.0, 3.0, 6.0])
    shape = outline(width, width * sampler.uniform(0.85, 1.0), width, square)
    hard = sampler.chance(0.4)
    seat = [(slab if hard else cushion)(shape, 0.03 if hard else thick, (0, 0, seat_h))]
    y, low = width / 2, seat_h + sampler.uniform(0.16, 0.22)
    tall, wide = sampler.uniform(0.12, 0.3), sampler.uniform(0.3, 0.42)
    grid = back_grid(wide, (low, low + tall), y + 0.02, 0.03, sampler.uniform(0.02, 0.07))
    seat.append(sheet(grid, 0.014 if hard else thick))
    path = [
        (0, 0.0, seat_h - 0.012),
        (0, y + 0.075, seat_h - 0.012),
        (0, y + 0.06, low + tall * 0.6),
    ]
    strap = bent(path, 0.07)
    frame = [sheet(np.stack([strap - (0.025, 0, 0), strap + (0.025, 0, 0)]), 0.01)]
    frame.append(box((0.07, 0.03, 0.06), (0, y + 0.066, low + tall * 0.4)))
    if sampler.chance(0.3) and seat_h > 0.5:
        ring = [(0.19 * np.cos(a), 0.19 * np.sin(a), 0.2) for a in np.linspace(0, 6.283, 18)[:-1]]
        frame.append(swept(ring, 0.01, closed=True))
        frame += [rod((0, 0, 0.2), (s * 0.19, 0, 0.2), 0.008) for s in SIDES]
    cover = sampler.choice([sampler.upholstery, sampler.plastic, sampler.wood])()
    return standing("chair", *groups, (cover, seat), (sampler.metal(), frame))


def bankers_chair(sampler: Sampler) -> Model:
    """A wooden banker's chair: four curved feet on castors, a saddle seat, an arm rail."""
    seat_h, width = sampler.size(0.43, 0.48), sampler.size(0.5, 0.56)
    radius, wood, wheels = sampler.size(0.26, 0.3), [], []
    for a in (45, 135, 225, 315):
        x, y = radius * float(np.cos(np.radians(a))), radius * float(np.sin(np.radians(a)))
        path = bent([(x * 0.08, y * 0.08, 0.2), (x * 0.6, y * 0.6, 0.17), (x, y, 0.055)], 0.2)
        wood.append(swept(path, 0.024))
        wheels.append(
            cylinder(0.028, 0.022, (0, 0, -0.011), 10).rotated("x", 90).translated(x, y, 0.028)
        )
    post = [(0.045, 0.14), (0.05, 0.2), (0.032, 0.23), (0.036, seat_h - 0.05), (0.1, seat_h - 0.04)]
    wood.append(lathe(post, segments=14))
    seat = slab(outline(width, width * 0.9, 0.46, 3.0), 0.045, (0, 0, seat_h - 0.045), 0.3)
    arm_h, wide = seat_h + sampler.uniform(0.2, 0.26), width / 2 + 0.02
    tops = [(-wide, -0.16, arm_h), (-wide, 0.27, arm_h + 0.03), (wide, 0.27, arm_h + 0.03)]
    rail = bent([*tops, (wide, -0.16, arm_h)], 0.2, 7)
    wood.append(swept(rail, 0.021))
    count = sampler.integer(5, 9)
    lengths = np.linspace(0.12, 0.88, count) * (len(rail) - 1)
    spindle = [(0.008, 0.0), (sampler.uniform(0.011, 0.016), 0.4), (0.008, 1.0)]
    for at in lengths.tolist():
        index = int(at)
        px, py, pz = (rail[index] + (rail[index + 1] - rail[index]) * (at - index)).tolist()
        wood.append(turned((px * 0.84, py * 0.8 - 0.01, seat_h - 0.01), (px, py, pz), spindle))
    if sampler.chance(0.6):
        ends: tuple[Vec, Vec] = (-0.16, 0.26, arm_h + 0.03), (0.16, 0.26, arm_h + 0.03)
        wood.append(strip(*ends, sampler.uniform(0.08, 0.16), 0.015, 0.024))
    pads = []
    if sampler.chance(0.35):
        pads = [
            cushion(outline(width * 0.9, width * 0.8, 0.42, 3.0), 0.045, (0, -0.01, seat_h - 0.002))
        ]
        pads += tufts([-0.09, 0.09], [-0.1, 0.08], seat_h + 0.043)
    timber = sampler.wood()
    return standing(
        "chair", (timber, [*wood, seat]), (sampler.dark(), wheels), (sampler.upholstery(), pads)
    )


DESIGNS: dict[str, tuple[ModelFactory, ...]] = {
    "chair": (mesh_office_chair, executive_chair, gaming_chair, task_chair, bankers_chair)
}
