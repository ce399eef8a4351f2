"""Armchairs that lean back: loose cushions in wood or steel tube, recliners."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import Mesh, box, rod, rounded_box, tube
from onemap_simulator.generation.model import Model, assemble
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.upholstery import bent, other, puff, seat_area, settled


def _reclining_pads(sampler: Sampler, width: float, depth: float, rise: float) -> list[Mesh]:
    """A seat cushion that tips back by a few degrees and a back cushion on its rear edge."""
    thick, tip, lean = sampler.size(0.09, 0.15), sampler.uniform(4, 10), sampler.uniform(16, 28)
    seat = puff((width, depth, thick), (0, -depth / 2, 0), 9, 4.5)
    back = puff((width, thick, rise), (0, -thick / 2, thick * 0.7), 8, 4)
    pads = [seat.rotated("x", tip), back.rotated("x", -lean)]
    if sampler.chance(0.25):
        pillow = puff((width * 0.8, 0.1, 0.18), (0, -thick, rise - 0.06), 5, 3)
        pads.append(pillow.rotated("x", -lean))
    return pads


def lounge_chair(sampler: Sampler) -> Model:
    """A wooden lounge chair: open sides with flat or paddle arms, two loose cushions."""
    inner, depth = sampler.size(0.52, 0.6), sampler.size(0.74, 0.86)
    seat, arm_z = sampler.size(0.3, 0.36), sampler.size(0.5, 0.58)
    post, y = sampler.size(0.03, 0.05), depth / 2
    paddle, kind = sampler.size(0.05, 0.11), sampler.choice(("posts", "splayed", "loop", "panel"))
    wood: list[Mesh] = []
    for side in (-1, 1):
        x = side * (inner / 2 + post / 2 + 0.01)
        if kind == "loop":  # one bent strip: floor, front, arm, back
            front = [(-y + 0.02, 0.02), (-y - 0.01, 0.2), (-y + 0.01, arm_z - 0.06)]
            path = [(y, 0.02), *front, (-y + 0.07, arm_z), (0.0, arm_z), (y, arm_z - 0.05)]
            wood.append(bent(path, 0.035, paddle * 0.8).translated(x, 0, 0))
            wood.append(rod((x, y - 0.1, 0.03), (x, y - 0.06, arm_z - 0.03), post / 2))
        elif kind == "panel":
            wood.append(box((post * 0.7, depth * 0.9, arm_z), (x, 0, 0)))
        else:
            reach = 1.0 if kind == "posts" else 1.12
            for at in (-y + 0.06, y - 0.1):
                wood.append(rod((x, at * reach, 0), (x, at, arm_z), post / 2))
            wood.append(rounded_box((post, depth - 0.14, 0.05), (x, -0.02, seat - 0.05), 0.015))
        if kind != "loop":
            size = (paddle, depth * sampler.uniform(0.8, 1.0), 0.028)
            wood.append(rounded_box(size, (x, -0.02, arm_z - 0.006), 0.013))
    wide = inner + 0.03
    for at, z in ((-y + 0.1, seat - 0.02), (y - 0.16, seat - 0.08)):
        wood.append(box((wide, 0.04, 0.06), (0, at, z - 0.05)))
    for at in np.linspace(-y + 0.18, y - 0.24, 4):
        wood.append(box((inner, 0.04, 0.014), (0, float(at), seat - 0.07)))
    pads = _reclining_pads(sampler, inner, depth - 0.16, sampler.size(0.5, 0.62))
    rise, slats = sampler.size(0.5, 0.6), []
    for x in np.linspace(-inner / 2 + 0.03, inner / 2 - 0.03, sampler.integer(3, 9)):
        slats.append(box((0.03, 0.02, rise), (float(x), 0.015, -0.06)))
    slats.append(rounded_box((inner + 0.02, 0.03, 0.06), (0, 0.015, rise - 0.08), 0.012))
    hinge = (0.0, y - 0.18, seat - 0.04)
    wood += [m.rotated("x", -20).translated(*hinge) for m in slats]
    return settled(
        assemble(
            "armchair",
            (sampler.wood(), wood),
            (sampler.upholstery(), [m.translated(0, hinge[1], hinge[2] + 0.02) for m in pads]),
            support_surfaces=seat_area(inner, seat + 0.12),
        )
    )


def cantilever(sampler: Sampler) -> Model:
    """A springing chair: a loop of tube or bent wood without back legs carries the cushions."""
    inner, depth = sampler.size(0.52, 0.6), sampler.size(0.72, 0.84)
    seat, arm_z, r = sampler.size(0.34, 0.4), sampler.size(0.56, 0.64), sampler.size(0.012, 0.018)
    y, wooden = depth / 2, sampler.chance(0.45)
    path = [(y - 0.05, r), (-y + 0.09, r), (-y + 0.02, 0.05), (-y, 0.14)]
    path += [(-y + 0.02, arm_z - 0.1), (-y + 0.06, arm_z - 0.02), (-y + 0.14, arm_z)]
    path += [(0.1, arm_z - 0.01), (y - 0.06, arm_z - 0.04)]
    x, frame = inner / 2 + 0.03, []
    for side in (-1, 1):
        if wooden:
            strip = bent([(a, max(z, 0.016)) for a, z in path], 0.03, 0.055)
            frame.append(strip.translated(side * x, 0, 0))
        else:
            frame.append(tube([(side * x, a, z) for a, z in path], r, 8))
            pad = rounded_box((0.05, 0.3, 0.025), (side * x, -0.05, arm_z + r * 0.5), 0.012)
            frame += [pad] if sampler.chance(0.5) else []
    ends = [(y - 0.05, r + 0.004), (-y + 0.03, seat - 0.02), (y - 0.2, seat - 0.06)]
    frame += [rod((-x, a, z), (x, a, z), max(r, 0.014)) for a, z in ends]
    lift = sampler.size(0.5, 0.64)
    lean = np.array([y - 0.16, seat - 0.05]) + np.outer([0, 0.5, 1], [0.3, 1.0]) * lift * 0.95
    for side in (-1, 1):
        spine = [(side * inner * 0.46, a, z) for a, z in lean.tolist()]
        rail = [(side * inner * 0.46, -y + 0.03, seat - 0.02), *spine]
        frame.append(tube(rail, r * 0.8, 6))
        frame.append(rod((side * x, y - 0.1, arm_z - 0.03), spine[1], r))
    pads = _reclining_pads(sampler, inner * 0.96, depth - 0.18, lift)
    return settled(
        assemble(
            "armchair",
            (sampler.wood() if wooden else sampler.metal(), frame),
            (sampler.upholstery(), [m.translated(0, y - 0.19, seat - 0.04) for m in pads]),
            support_surfaces=seat_area(inner, seat + 0.1),
        )
    )


def recliner(sampler: Sampler) -> Model:
    """A recliner: a leaning overstuffed back in rolls and a footrest, folded out or in."""
    inner, depth, arm = sampler.size(0.5, 0.58), sampler.size(0.8, 0.92), sampler.size(0.15, 0.22)
    seat, height, y = sampler.size(0.42, 0.48), sampler.size(0.95, 1.12), depth / 2
    width, arm_h, open_out = inner + 2 * arm, sampler.size(0.56, 0.64), sampler.chance(0.65)
    lean = sampler.uniform(22, 48) if open_out else sampler.uniform(8, 16)
    cover = sampler.upholstery()
    body = [rounded_box((width - 0.06, depth - 0.1, seat - 0.2), (0, 0, 0.05), 0.03)]
    pads, steel = [], []
    for side in (-1, 1):
        x = side * (width - arm) / 2
        body.append(rounded_box((arm * 0.85, depth - 0.02, arm_h - 0.1), (x, 0, 0.03), 0.04))
        pads.append(puff((arm, depth - 0.04, 0.14), (x, 0, arm_h - 0.12), 7, 3))
    pads.append(puff((inner, depth - 0.1, 0.2), (0, -0.04, seat - 0.16), 8, 3.5))
    tiers, long = sampler.integer(2, 4), height - seat
    wide = inner + sampler.choice((0.0, arm))
    back = [rounded_box((wide - 0.04, 0.1, long), (0, -0.05, 0), 0.04)]
    for k in range(tiers):
        size = (wide, 0.2, long / tiers * 1.1)
        back.append(puff(size, (0, -0.14, k * long / tiers), 5, 2.8))
    pads += [m.rotated("x", -lean).translated(0, y - 0.02, seat - 0.04) for m in back]
    if open_out:
        rest = puff((inner - 0.02, 0.14, 0.44), (0, 0, 0), 7, 3.5)
        pads.append(rest.rotated("x", 78).translated(0, -y + 0.01, seat - 0.13))
        for side in (-1, 1):
            x = side * inner * 0.36
            steel.append(rod((x, -y + 0.12, 0.16), (x, -y - 0.26, seat - 0.1), 0.012))
            steel.append(rod((x, -y + 0.04, 0.28), (x, -y - 0.1, seat - 0.12), 0.012))
    else:
        pads.append(puff((inner, 0.12, seat - 0.16), (0, -y + 0.05, 0.05), 6, 3.5))
    if sampler.chance(0.4):
        x = width / 2 - 0.02
        steel.append(rod((x, -0.1, 0.3), (x + 0.04, -0.2, 0.38), 0.014))
    base = [box((width - 0.12, depth - 0.16, 0.06), (0, 0, 0))]
    return settled(
        assemble(
            "armchair",
            (cover, body),
            (other(sampler, cover, 0.8), pads),
            (sampler.metal(), steel),
            (sampler.dark(), base),
            support_surfaces=seat_area(inner, seat + 0.03),
        )
    )


DESIGNS: dict[str, tuple[ModelFactory, ...]] = {
    "armchair": (lounge_chair, cantilever, recliner),
}
