"""More stools: ceramic drum, bent-leg stacking, gas lift on a disc or wheels, wire, child's box."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import (
    Mesh,
    box,
    cylinder,
    ellipsoid,
    lathe,
    rod,
    rounded_box,
    torus,
)
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
    swept,
)
from onemap_tools.train.variety.designs.swivel_parts import star


def drum_stool(sampler: Sampler) -> Model:
    """A ceramic or wooden drum stool: barrel, hourglass or facetted, with studs and bands."""
    height, radius = sampler.size(0.4, 0.5), sampler.size(0.13, 0.2)
    bulge, segments = sampler.choice([0.35, 0.2, -0.35, 0.0]), sampler.choice([6, 8, 18, 22])
    levels = np.linspace(0, 1, 11)
    reach = radius * (1 + bulge * np.sin(np.pi * levels)) * (0.85 if bulge > 0 else 1.0)
    profile = list(zip(reach.tolist(), (levels * height * 0.96).tolist(), strict=True))
    end = profile[-1][0]
    body = [lathe([*profile, (end * 0.9, height * 0.985), (end * 0.5, height)], segments=segments)]
    trim: list[Mesh] = []
    if segments > 8:
        for level in (0.12, 0.88):
            at = radius * (1 + bulge * np.sin(np.pi * level)) * (0.85 if bulge > 0 else 1.0)
            if sampler.chance(0.5):
                trim.append(torus(float(at), 0.008, (0, 0, level * height * 0.96), 22))
            else:
                for a in np.linspace(0, 2 * np.pi, 17)[:-1].tolist():
                    point = (float(at * np.cos(a)), float(at * np.sin(a)), level * height * 0.96)
                    trim.append(ellipsoid((0.011, 0.011, 0.011), point, 6))
    holes = []
    if sampler.chance(0.5) and bulge >= 0 and segments > 8:
        middle = float(radius * (1 + bulge) * (0.85 if bulge > 0 else 1.0))
        hole = cylinder(0.035, 0.03, (0, 0, -0.015), 12).rotated("x", 90)
        hole = hole.translated(0, -middle + 0.012, height * 0.48)
        holes = [hole.rotated("z", turn) for turn in (0.0, 90.0, 180.0, 270.0)]
    pad: list[Mesh] = []
    if sampler.chance(0.25):
        pad = [cushion(outline(end * 2, end * 2, end * 2, 2.0), 0.05, (0, 0, height - 0.008))]
    glaze = sampler.ceramic() if sampler.chance(0.6) else sampler.wood()
    return standing(
        "stool",
        (glaze, body),
        (glaze if sampler.chance(0.5) else sampler.metal(), trim),
        (sampler.dark(), holes),
        (sampler.upholstery(), pad),
    )


def stacking_stool(sampler: Sampler) -> Model:
    """A stacking stool: a round or square board on three or four legs bent over at the top."""
    height, radius = sampler.size(0.42, 0.72), sampler.size(0.16, 0.2)
    count, flat = sampler.choice([3, 3, 4]), sampler.chance(0.6)
    square = sampler.choice([2.0, 2.0, 5.0])
    board = outline(2 * radius, 2 * radius, 2 * radius, square)
    seat = [slab(board, 0.03, (0, 0, height - 0.03), 0.2)]
    legs, lean = [], sampler.uniform(0.0, 0.05)
    for turn in (np.arange(count) * 360 / count + 45).tolist():
        top = height - 0.038
        path = bent([(0.06, 0, top), (radius * 0.98, 0, top), (radius + lean, 0, 0)], 0.07, 5)
        if flat:
            edge = np.array([0.0, sampler.uniform(0.022, 0.028), 0.0])
            leg = sheet(np.stack([path - edge, path + edge], axis=1), 0.016)
        else:
            leg = swept(path, 0.011)
        legs.append(leg.rotated("z", turn))
    if height > 0.55 or sampler.chance(0.2):
        legs.append(torus(radius + lean * 0.6, 0.009, (0, 0, height * 0.38), 20))
    cover = sampler.choice([sampler.wood, sampler.plastic, sampler.upholstery])()
    return standing("stool", (cover, seat), (sampler.wood() if flat else sampler.metal(), legs))


def lift_stool(sampler: Sampler) -> Model:
    """A bar stool on a gas lift: a trumpet foot or castors, a foot loop, a padded low-rim seat."""
    height, radius = sampler.size(0.48, 0.8), sampler.size(0.18, 0.22)
    square, shape = sampler.choice([2.0, 3.0, 7.0]), sampler.choice(["disc", "disc", "wheels"])
    groups = []
    metal = sampler.metal()
    frame: list[Mesh] = []
    top = height - 0.07
    if shape == "wheels":
        groups = star(sampler, sampler.size(0.22, 0.27), top)
    else:
        flare = [(0.2, 0.0), (0.205, 0.012), (0.12, 0.025), (0.05, 0.05), (0.03, 0.09)]
        frame.append(lathe([*flare, (0.03, top * 0.6)], segments=22))
        frame.append(cylinder(0.018, top * 0.41, (0, 0, top * 0.6 - 0.005), 10))
        frame.append(box((0.16, 0.16, 0.025), (0, 0, top - 0.022)))
    if height > 0.58:
        z, loop = height * 0.38, [(-0.03, 0, 0), (-0.14, -0.06, 0), (-0.14, -0.2, 0)]
        path = [*loop, *[(-x, y, w) for x, y, w in loop[::-1]]]
        frame.append(swept(bent(path, 0.08), 0.011).translated(0, 0, z))
    board = outline(2 * radius, 2 * radius * 0.95, 2 * radius, square)
    seat = [cushion(board, 0.075, (0, 0, top))]
    if sampler.chance(0.4):
        u, v = np.meshgrid(np.linspace(0.06, np.pi - 0.06, 13), np.array([0.0, 1.0]), indexing="ij")
        rim = sampler.uniform(0.05, 0.14)
        z = top + 0.02 + v * rim * (0.4 + 0.6 * np.sin(u))
        reach = radius * 1.03
        grid = np.stack([-reach * np.cos(u), reach * np.sin(u), z], axis=-1)
        seat.append(sheet(grid, 0.025))
    if sampler.chance(0.4):
        frame.append(slab(board * 0.98, 0.02, (0, 0, top - 0.015), 0.3))
    return standing("stool", *groups, (metal, frame), (sampler.upholstery(), seat))


def wire_stool(sampler: Sampler) -> Model:
    """A stool of bent wire or rod: hairpin, drum cage or hourglass, with a thin top."""
    height, radius = sampler.size(0.42, 0.75), sampler.size(0.15, 0.21)
    r, kind, frame = sampler.uniform(0.004, 0.007), sampler.choice(["hairpin", "cage", "twist"]), []
    top = height - 0.025
    if kind == "hairpin":
        for turn in (np.arange(4) * 90 + 45).tolist():
            ends = [(radius * 0.7, s * 0.05, top) for s in SIDES]
            pin = bent([ends[0], (radius * 1.05, 0, 0.0), ends[1]], 0.03)
            frame.append(swept(pin, r + 0.002, 6).rotated("z", turn))
    else:
        count, twist = sampler.integer(9, 18), 2.2 if kind == "twist" else 0.0
        for a in (np.arange(count) * 2 * np.pi / count).tolist():
            for way in (-1, 1) if kind == "twist" else (1,):
                low = (radius * float(np.cos(a)), radius * float(np.sin(a)), r)
                b = a + way * twist
                high = (radius * float(np.cos(b)), radius * float(np.sin(b)), top)
                frame.append(rod(low, high, r, 5))
        frame += [torus(radius, r * 1.4, (0, 0, z), 20) for z in (r * 1.4, top - 0.004)]
    board = outline(2 * radius, 2 * radius, 2 * radius, 2.0 if kind != "hairpin" else 3.0) * 1.05
    soft = sampler.chance(0.4)
    seat = [cushion(board, 0.06, (0, 0, top)) if soft else slab(board, 0.025, (0, 0, top), 0.25)]
    cover = sampler.upholstery() if soft else sampler.wood()
    return standing("stool", (cover, seat), (sampler.metal(), frame))


def box_stool(sampler: Sampler) -> Model:
    """A stool of boards: two side boards with a cut foot, a top with a hand slot, a stretcher."""
    width, depth, height = (
        sampler.size(0.32, 0.45),
        sampler.size(0.22, 0.32),
        sampler.size(0.22, 0.46),
    )
    thick, splay = sampler.uniform(0.016, 0.026), sampler.uniform(0.0, 0.05)
    x, top = width / 2 - sampler.uniform(0.03, 0.07), height - thick
    board = outline(width, width, depth, sampler.choice([5.0, 9.0]))
    boards = [slab(board, thick, (0, 0, top), 0.2)]
    foot = depth * 0.3
    for s in SIDES:
        for d in SIDES:
            y = d * (depth * 0.45 - foot / 2)
            boards.append(
                beam((s * (x + splay), y, 0), (s * (x + splay / 2), y, top / 2), (thick, foot))
            )
        boards.append(
            beam((s * (x + splay / 2), 0, top / 2 - 0.004), (s * x, 0, top), (thick, depth * 0.9))
        )
    if sampler.chance(0.7):
        boards.append(box((2 * x + splay, thick, top * 0.25), (0, 0, top * 0.55)))
    else:
        boards += [box((2 * x, thick, 0.05), (0, s * depth * 0.4, top - 0.05)) for s in SIDES]
    slot = [rounded_box((0.1, 0.028, 0.006), (0, 0, height - 0.003), 0.002)]
    pad = [cushion(board * 0.98, 0.04, (0, 0, height - 0.003))] if sampler.chance(0.25) else []
    slot = [] if pad or sampler.chance(0.4) else slot
    wood = sampler.wood() if sampler.chance(0.8) else sampler.plastic()
    return standing("stool", (wood, boards), (sampler.dark(), slot), (sampler.upholstery(), pad))


DESIGNS: dict[str, tuple[ModelFactory, ...]] = {
    "stool": (drum_stool, stacking_stool, lift_stool, wire_stool, box_stool)
}
