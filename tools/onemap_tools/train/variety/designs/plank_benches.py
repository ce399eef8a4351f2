"""Benches: one plank on trestles, bent slats as in a park, crossed or looped metal ends."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import (
    Mesh,
    box,
    rod,
)
from onemap_simulator.generation.model import Model, support_surface
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.seat_shapes import (
    SIDES,
    beam,
    bent,
    grounded,
    outline,
    sheet,
    slab,
    standing,
    swept,
)


def trestle_bench(sampler: Sampler) -> Model:
    """A bench of one thick plank on trestles, wedged boards, splayed pegs or a log's edge."""
    width, depth, height = sampler.size(1.0, 1.7), sampler.size(0.26, 0.4), sampler.size(0.42, 0.48)
    thick, kind = (
        sampler.uniform(0.03, 0.07),
        sampler.choice(["cross", "board", "peg", "a", "slab"]),
    )
    edge = outline(width, width, depth, sampler.choice([8.0, 16.0, 30.0]))
    if sampler.chance(0.3):
        edge[:, 1] *= 1 + sampler.uniform(0.04, 0.1) * np.sin(edge[:, 0] * 7)
    plank = [slab(edge, thick, (0, 0, height - thick), sampler.uniform(0.08, 0.3))]
    top, x, y = height - thick + 0.004, width / 2 - sampler.uniform(0.12, 0.28), depth * 0.4
    legs: list[Mesh] = []
    bar = sampler.uniform(0.035, 0.06)
    for s in SIDES:
        if kind == "cross":
            for d in SIDES:
                low = (s * x + d * 0.014, d * y, 0.0)
                legs.append(beam(low, (s * x + d * 0.014, -d * y * 0.85, top), (0.026, bar)))
        elif kind == "a":
            for d in SIDES:
                legs.append(beam((s * x, d * y, 0), (s * x, d * y * 0.5, top), (bar, bar)))
            legs.append(box((bar * 0.6, y * 1.5, bar * 0.8), (s * x, 0, top * 0.3)))
        elif kind == "peg":
            for d in SIDES:
                low = (s * (x + 0.08), d * y * 1.05, 0.0)
                legs.append(grounded(low, (s * x, d * y * 0.6, top), (0.016, 0.022)))
        elif kind == "board":
            legs.append(beam((s * (x + 0.03), 0, 0), (s * x, 0, top), (bar * 0.7, depth * 0.85)))
        else:
            legs.append(slab(outline(0.3, 0.3, depth * 0.8, 2.5), top, (s * x, 0, 0), 0.02))
    if kind in ("cross", "board", "a"):
        at = top * (0.5 if kind == "cross" else 0.32)
        legs.append(box((2 * x + 0.1, 0.025, bar * 1.2), (0, 0, at - bar * 0.6)))
    wood = sampler.wood()
    second = wood if sampler.chance(0.6) else sampler.metal()
    return standing(
        "bench",
        (wood, plank),
        (second, legs),
        support_surfaces=(support_surface(width - 0.1, depth * 0.85, height),),
    )


def slatted_bench(sampler: Sampler) -> Model:
    """A park bench without arms: bent slats for seat, most with a back, on iron or wooden ends."""
    width, height = sampler.size(1.1, 1.6), sampler.size(0.42, 0.47)
    has_back = sampler.chance(0.7)
    back_h, lean = sampler.size(0.76, 0.88), sampler.uniform(0.06, 0.16)
    profile = [(-0.22, height - 0.05), (-0.19, height), (0.18, height - 0.03)]
    if has_back:
        profile += [(0.24, height + 0.12), (0.22 + lean, back_h)]
    else:
        profile += [(0.22, height - 0.06)]
    curve = bent([(0.0, y, z) for y, z in profile], 0.09, 5)
    length = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1))])
    count = sampler.integer(6, 12) if has_back else sampler.integer(4, 8)
    pitch = length[-1] / count
    slats, ends = [], []
    wide, thick = pitch * sampler.uniform(0.6, 0.85), sampler.uniform(0.016, 0.028)
    for index in range(count):
        at = (index + 0.5) * pitch
        rows = [
            [float(np.interp(at + d * wide / 2, length, curve[:, axis])) for axis in (1, 2)]
            for d in (-1, 1)
        ]
        grid = np.array([[(s * width / 2, y, z) for y, z in rows] for s in SIDES])
        slats.append(sheet(grid, thick).translated(0, 0, thick / 2))
    x, r = width / 2 - sampler.uniform(0.08, 0.2), sampler.uniform(0.014, 0.022)
    iron = sampler.chance(0.6)
    middle = (0.0,) if width > 1.4 else ()
    for at in (-x, *middle, x):
        ends.append(swept(curve + (at, 0, -r), r))
        for foot, hip in ((-0.22, -0.15), (0.26, 0.14)):
            if iron:
                path = [(at, foot, 0), (at, hip * 0.8, height * 0.4), (at, hip, height - 0.03)]
                ends.append(swept(bent(path, 0.15), r))
            else:
                ends.append(beam((at, foot, 0), (at, hip, height - 0.02), (0.05, 0.06)))
        ends.append(rod((at, -0.19, height * 0.45), (at, 0.2, height * 0.45), r * 0.8))
    return standing(
        "bench",
        (sampler.wood(), slats),
        (sampler.metal() if iron else sampler.wood(), ends),
        support_surfaces=(support_surface(width, 0.34, height + thick - 0.01),),
    )


def crossed_bench(sampler: Sampler) -> Model:
    """A long bench on crossed or looped metal ends with a thin pad, strap top or curved seat."""
    width, depth, height = sampler.size(0.9, 1.5), sampler.size(0.36, 0.46), sampler.size(0.43, 0.5)
    thick, kind = sampler.uniform(0.04, 0.08), sampler.choice(["cross", "loop", "trapeze"])
    top_kind = sampler.choice(["pad", "straps", "scoop"])
    z = height - (thick if top_kind == "pad" else 0.02)
    x, y, bar = width / 2 - 0.08, depth / 2 - 0.02, sampler.uniform(0.016, 0.03)
    frame: list[Mesh] = []
    for s in SIDES:
        if kind == "cross":
            for d in SIDES:
                low = (s * x + d * bar * 0.52, d * y, 0.0)
                frame.append(beam(low, (s * x + d * bar * 0.52, -d * y, z), (bar, bar * 1.3)))
        else:
            inset = 0.6 if kind == "trapeze" else 1.0
            loop = [(s * x, -y * inset, z), (s * x, -y, bar / 2), (s * x, y, bar / 2)]
            frame.append(swept(bent([*loop, (s * x, y * inset, z)], 0.05), bar / 2))
    if kind == "cross":
        frame.append(rod((-x, 0, z / 2), (x, 0, z / 2), bar * 0.4))
    for s in SIDES:
        frame.append(box((width - 0.04, bar, bar), (0, s * (y - 0.01), z - bar + 0.002)))
        frame.append(box((bar, depth - 0.05, bar), (s * (width / 2 - 0.02), 0, z - bar)))
    seat: list[Mesh] = []
    level = (width, height)
    if top_kind == "pad":
        shape = outline(width, width, depth, 14.0)
        seat.append(slab(shape, thick, (0, 0, z), 0.3))
    elif top_kind == "straps":
        level = (width, z + 0.016)
        count = int(width / sampler.uniform(0.07, 0.14))
        for at in (np.arange(count) - (count - 1) / 2) * width / count:
            seat.append(box((width / count * 0.7, depth, 0.012), (float(at), 0, z + 0.004)))
        seat += [box((width, 0.05, 0.008), (0, d * depth, z + 0.0085)) for d in (-0.25, 0.0, 0.25)]
    else:
        level = (width * 0.6, z + 0.024)
        t = np.linspace(-1, 1, 9)
        rise = sampler.uniform(0.02, 0.1)
        grid = np.array(
            [[(a * width / 2, d * depth / 2, z + 0.012 + rise * a**4) for d in (-1, 1)] for a in t]
        )
        seat.append(sheet(grid, 0.022))
    cover = sampler.upholstery() if top_kind != "scoop" else sampler.wood()
    return standing(
        "bench",
        (sampler.metal() if sampler.chance(0.7) else sampler.wood(), frame),
        (cover, seat),
        support_surfaces=(support_surface(level[0], depth, level[1]),),
    )


DESIGNS: dict[str, tuple[ModelFactory, ...]] = {
    "bench": (trestle_bench, slatted_bench, crossed_bench)
}
