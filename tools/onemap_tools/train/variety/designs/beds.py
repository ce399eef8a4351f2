"""Beds with a solid base: platform, box spring, sleigh, chest with drawers, flat-pack."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import box, cylinder, rounded_box
from onemap_simulator.generation.model import Model, assemble
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.bedding import bed_size, bedding, head_area
from onemap_tools.train.variety.designs.feet import feet, footing
from onemap_tools.train.variety.designs.upholstery import (
    bent,
    other,
    puff,
    settled,
    tufted,
    wall,
)


def platform(sampler: Sampler) -> Model:
    """A low platform wider than its mattress, on a recessed plinth, with a slab or no headboard."""
    width, length = bed_size(sampler)
    rim, thick, base = sampler.size(0.06, 0.28), sampler.size(0.05, 0.12), sampler.size(0.14, 0.26)
    broad, long = width + 2 * rim, length + sampler.choice((0.06, rim + 0.06))
    y = long / 2 - length / 2 - 0.03
    wood = [rounded_box((broad, long, thick), (0, 0, base - thick), 0.015)]
    plinth = [box((broad - 0.3, long - 0.3, base - thick + 0.005), (0, 0, 0))]
    kind, back = sampler.integer(0, 3), long / 2
    if kind == 1:
        size = (broad + sampler.choice((0.0, 0.5)), 0.05, sampler.size(0.6, 0.95))
        wood.append(rounded_box(size, (0, back + 0.025, 0.02), 0.015))
    elif kind == 2:
        for i in (-0.5, 0.5):
            slab = rounded_box((broad / 2 - 0.02, 0.05, 0.45), (0, 0, 0), 0.02).rotated("x", -12)
            wood.append(slab.translated(i * broad / 2, back - 0.02, base - 0.01))
    elif kind == 3:
        for z in np.arange(base, sampler.size(0.6, 0.9), 0.14):
            wood.append(box((broad, 0.03, 0.12), (0, back + 0.005, float(z))))
        wood += [box((0.06, 0.03, 0.62), (s * broad / 3, back + 0.034, 0.03)) for s in (-1, 1)]
    groups, top = bedding(sampler, width, length, base - 0.005, y)
    return settled(
        assemble(
            "bed",
            (sampler.wood(), wood),
            (sampler.dark() if sampler.chance(0.5) else sampler.wood(), plinth),
            *groups,
            support_surfaces=head_area(width, length, top),
        )
    )


def box_spring(sampler: Sampler) -> Model:
    """A box spring: a thick upholstered base, two layers of mattress, a tall padded headboard."""
    width, length = bed_size(sampler)
    foot, base = sampler.size(0.03, 0.12), sampler.size(0.28, 0.38)
    height, broad = sampler.size(0.95, 1.4), width + sampler.choice((0.0, 0.06, 0.3))
    halves, back = sampler.choice((1, 2)), length / 2 + 0.04
    cover = sampler.upholstery()
    body = [
        rounded_box((width / halves - 0.006, length, base - foot), (i * width / 2, 0, foot), 0.025)
        for i in ((0.0,) if halves == 1 else (-0.5, 0.5))
    ]
    kind, head = sampler.integer(0, 3), []
    if kind == 0:
        head.append(box((broad, 0.05, height - 0.02), (0, back + 0.03, 0.01)))
        pads = tufted((broad, 0.09, height - base), max(4, round(broad / 0.22)), 4)
        head += [m.translated(0, back + 0.01, base) for m in pads]
    elif kind == 1:  # upright channels
        count = sampler.integer(5, 11)
        for i in range(count):
            at = (i - (count - 1) / 2) * broad / count
            head.append(puff((broad / count, 0.13, height), (at, back + 0.03, 0), 4, 10, 12))
    elif kind == 2:  # stacked pads
        rows = sampler.integer(2, 5)
        for k in range(rows):
            tall = height / rows
            head.append(puff((broad, 0.14, tall), (0, back + 0.04, k * tall), 9, 5))
    else:  # one pad with a curved crown, wings at the sides
        u = np.linspace(-1, 1, 19)
        path = np.stack([u * broad / 2, np.full(19, back + 0.03)], axis=1)
        crown = height + sampler.uniform(-0.1, 0.15) * np.cos(np.pi * u / 2)
        head.append(wall(path, 0.0, crown, 0.12, 0.05))
        if sampler.chance(0.5):
            size = (0.08, 0.26, height * 0.92)
            head += [
                rounded_box(size, (s * (broad / 2 + 0.045), back - 0.06, 0), 0.03) for s in (-1, 1)
            ]
    groups, top = bedding(sampler, width, length, base - 0.005)
    return settled(
        assemble(
            "bed",
            (cover, body),
            (other(sampler, cover, 0.75), head),
            footing(sampler, width - 0.06, length - 0.06, foot + 0.01),
            *groups,
            support_surfaces=head_area(width, length, top),
        )
    )


def sleigh(sampler: Sampler) -> Model:
    """A sleigh bed: head and foot boards that roll outwards, side rails curved or straight."""
    width, length = bed_size(sampler)
    base, height = sampler.size(0.3, 0.42), sampler.size(0.95, 1.2)
    low, thick = sampler.size(0.55, 0.85), sampler.size(0.035, 0.06)
    broad, curl = width + 0.1, sampler.uniform(0.1, 0.2)
    rail = sampler.size(0.18, 0.26)
    t = np.linspace(0, 1, 13)
    frame = []
    for tall, side in ((height, 1), (low, -1)):
        lean = 0.03 * np.sin(t * np.pi) * -1 + curl * t**2.6
        path = np.stack([side * (length / 2 + 0.04 + lean), 0.06 + t * (tall - 0.06)], axis=1)
        frame.append(bent(path, thick, broad))
        end = path[-1]
        scroll = cylinder(thick * 1.1, broad + 0.02, (0, 0, -(broad + 0.02) / 2), 14)
        frame.append(scroll.rotated("y", 90).translated(0, float(end[0]), float(end[1])))
        for x in (-1, 1):
            frame.append(bent(path, thick + 0.04, 0.05).translated(x * (broad / 2 + 0.01), 0, 0))
            foot = box((0.08, 0.1, 0.1), (x * (broad / 2 - 0.01), side * (length / 2 + 0.04), 0))
            frame.append(foot)
    dip = sampler.choice((0.0, 0.1))
    u = np.linspace(-1, 1, 11)
    for x in (-1, 1):
        path = np.stack([np.full(11, x * (width / 2 + 0.025)), u * (length / 2 + 0.03)], axis=1)
        frame.append(wall(path, base - rail + 0.02, base + 0.05 + dip * u**4, 0.035, 0.01))
    frame.append(box((width, length, 0.05), (0, 0, base - 0.06)))
    groups, top = bedding(sampler, width - 0.02, length - 0.04, base - 0.012)
    wood = sampler.wood() if sampler.chance(0.8) else sampler.upholstery()
    return settled(
        assemble("bed", (wood, frame), *groups, support_surfaces=head_area(width, length, top))
    )


def storage_bed(sampler: Sampler) -> Model:
    """A chest bed: drawers in the base, one maybe pulled out, a headboard with a shelf or none."""
    width, length = bed_size(sampler)
    base, broad = sampler.size(0.36, 0.5), width + 0.05
    body = [box((broad, length, base - 0.05), (0, 0, 0.05))]
    plinth = [box((broad - 0.06, length - 0.06, 0.055), (0, 0, 0))]
    count, rows = sampler.integer(2, 3), 1 if base < 0.44 else 2
    pitch, tall = (length - 0.06) / count, (base - 0.1) / rows
    fronts, knobs = [], []
    for side in (-1, 1):
        for i in range(count):
            for k in range(rows):
                out = sampler.uniform(0.05, 0.3) if sampler.chance(0.12) else 0.0
                y, z = (i - (count - 1) / 2) * pitch, 0.07 + k * tall
                x = side * (broad / 2 + 0.009 + out)
                fronts.append(box((0.018, pitch - 0.02, tall - 0.015), (x, y, z)))
                if out:
                    size = (out + 0.02, pitch - 0.06, tall * 0.6)
                    body.append(box(size, (side * (broad / 2 + out / 2 - 0.01), y, z + 0.02)))
                grip = (x + side * 0.018, y, z + tall * 0.6)
                knobs.append(box((0.022, sampler.choice((0.03, 0.14)), 0.02), grip))
    kind, back = sampler.integer(0, 2), length / 2
    if kind == 1:
        body.append(box((broad, 0.04, sampler.size(0.75, 0.95)), (0, back + 0.02, 0)))
    elif kind == 2:  # a bookcase headboard
        high = sampler.size(0.85, 1.05)
        body.append(box((broad, 0.02, high), (0, back + 0.19, 0)))
        for x in np.linspace(-broad / 2 + 0.01, broad / 2 - 0.01, sampler.integer(2, 4)):
            body.append(box((0.02, 0.178, high), (float(x), back + 0.09, 0)))
        for z in (base, high - 0.01):
            body.append(box((broad + 0.006, 0.19, 0.022), (0, back + 0.096, z)))
    groups, top = bedding(sampler, width, length - 0.02, base - 0.005)
    wood = sampler.wood()
    return settled(
        assemble(
            "bed",
            (wood, body),
            (wood if sampler.chance(0.5) else sampler.wood(), fronts),
            (sampler.metal(), knobs),
            (sampler.dark(), plinth),
            *groups,
            support_surfaces=head_area(width, length, top),
        )
    )


def plain_frame(sampler: Sampler) -> Model:
    """A flat-pack bed: thin side boards, legs, a panel headboard of boards or an arch."""
    width, length = bed_size(sampler)
    base, rail = sampler.size(0.2, 0.4), sampler.size(0.1, 0.2)
    height, broad, back = sampler.size(0.65, 1.05), width + 0.06, length / 2 + 0.02
    wood = [
        box((0.025, length, rail), (s * (width / 2 + 0.016), 0, base - rail / 2)) for s in (-1, 1)
    ]
    wood.append(box((broad - 0.01, 0.025, rail), (0, -back + 0.004, base - rail / 2)))
    wood.append(box((width, length, 0.02), (0, 0, base - 0.03)))
    if sampler.chance(0.5):
        u = np.linspace(-1, 1, 19)
        path = np.stack([u * broad / 2, np.full(19, back)], axis=1)
        arch = height - sampler.uniform(0.05, 0.45) * (height - base) * np.abs(u) ** 2.5
        wood.append(wall(path, base - rail / 2, arch, 0.03, 0.01))
    else:
        gap = sampler.choice((0.006, 0.05))
        count = sampler.integer(2, 4)
        tall = (height - base + rail / 2) / count
        for k in range(count):
            wood.append(
                box((broad, 0.025, tall - gap), (0, back, base - rail / 2 + k * tall + gap))
            )
        wood += [
            box((0.05, 0.03, height), (s * (broad / 2 - 0.1), back + 0.027, 0)) for s in (-1, 1)
        ]
    style = sampler.choice(("block", "tapered", "splayed", "peg"))
    wood += feet(sampler, broad, length, base - rail / 2 + 0.02, style)
    groups, top = bedding(sampler, width, length - 0.03, base - 0.008)
    return settled(
        assemble(
            "bed",
            (sampler.wood(), wood),
            *groups,
            support_surfaces=head_area(width, length, top),
        )
    )


DESIGNS: dict[str, tuple[ModelFactory, ...]] = {
    "bed": (
        platform,
        box_spring,
        sleigh,
        storage_bed,
        plain_frame,
    ),
}
