"""Beds in a frame of posts and bars: iron, four-poster, daybed."""

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
    tube,
)
from onemap_simulator.generation.model import Model, assemble
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.bedding import bed_size, bedding, head_area
from onemap_tools.train.variety.designs.upholstery import bent, settled, sideways, wall


def _iron_end(sampler: Sampler, width: float, y: float, height: float, low: float) -> list[Mesh]:
    r, bars = sampler.size(0.014, 0.024), sampler.integer(4, 9)
    arched = sampler.chance(0.5)
    u = np.linspace(-1, 1, 13)
    rise = (height * 0.22 if arched else 0.0) * (1 - u**2)
    iron: list[Mesh] = []
    for side in (-1, 1):
        iron.append(cylinder(r, height, (side * width / 2, y, 0), 10))
        if not arched or sampler.chance(0.5):
            iron.append(ellipsoid((r * 2, r * 2, r * 2), (side * width / 2, y, height + r), 10))
    across = u * width / 2
    iron.append(tube([(x, y, height - 0.02 + z) for x, z in zip(across, rise, strict=True)], r, 8))
    iron.append(rod((-width / 2, y, low), (width / 2, y, low), r * 0.8))
    middle = low + (height - low) * sampler.uniform(0.5, 0.8)
    doubled = sampler.chance(0.4)
    if doubled:
        iron.append(rod((-width / 2, y, middle), (width / 2, y, middle), r * 0.7))
    for x in np.linspace(-width / 2, width / 2, bars + 2)[1:-1]:
        at = float(x)
        top = height - 0.02 + float(np.interp(at, across, rise))
        iron.append(rod((at, y, low), (at, y, top), r * 0.55, 6))
        if doubled:
            iron.append(ellipsoid((r * 1.2, r * 1.2, r * 1.6), (at, y, middle), 8))
    return iron


def metal_bedstead(sampler: Sampler) -> Model:
    """An iron or brass bedstead: tube posts with knobs, bars at head and foot, open below."""
    width, length = bed_size(sampler)
    base, y = sampler.size(0.3, 0.46), length / 2 + 0.03
    head, foot = sampler.size(0.9, 1.2), sampler.size(0.5, 0.85)
    broad = width + 0.06
    iron = _iron_end(sampler, broad, y, head, base - 0.06)
    if sampler.chance(0.8):
        iron += _iron_end(sampler, broad, -y, foot, base - 0.06)
    else:
        iron += [cylinder(0.022, base + 0.01, (s * broad / 2, -y, 0), 10) for s in (-1, 1)]
        iron.append(rod((-broad / 2, -y, base - 0.03), (broad / 2, -y, base - 0.03), 0.02))
    iron += [box((0.03, 2 * y, 0.05), (s * (broad / 2 - 0.012), 0, base - 0.06)) for s in (-1, 1)]
    for at in np.linspace(-y + 0.12, y - 0.12, 7):
        iron.append(box((width, 0.03, 0.014), (0, float(at), base - 0.02)))
    groups, top = bedding(sampler, width, length - 0.02, base - 0.008)
    return settled(
        assemble(
            "bed",
            (sampler.metal() if sampler.chance(0.7) else sampler.plastic(), iron),
            *groups,
            support_surfaces=head_area(width, length, top),
        )
    )


def _post(sampler: Sampler, height: float, thick: float, turned: bool) -> Mesh:
    if not turned:
        return box((thick, thick, height))
    r, steps = thick / 2, sampler.integer(3, 4)
    profile = [(r * 1.1, 0.0), (r * 1.1, 0.3 * height)]
    for k in range(steps):
        z = 0.32 + 0.66 * k / steps
        profile += [(r * 0.6, z * height), (r * 1.05, (z + 0.3 / steps) * height)]
        profile += [(r * 0.75, (z + 0.5 / steps) * height)]
    return lathe([*profile, (r * 0.5, height)], segments=10)


def four_poster(sampler: Sampler) -> Model:
    """A four-poster: a tall post at each corner, rails or a canopy above, curtains tied back."""
    width, length = bed_size(sampler)
    base, height = sampler.size(0.34, 0.5), sampler.size(1.75, 2.15)
    thick, turned = sampler.size(0.05, 0.1), sampler.chance(0.5)
    x, y = width / 2 + thick / 2, length / 2 + thick / 2
    post = _post(sampler, height, thick, turned)
    wood = [post.translated(sx * x, sy * y) for sx in (-1, 1) for sy in (-1, 1)]
    kind = sampler.integer(0, 3)
    for z, tall in ((base - 0.12, 0.14), (height - 0.05, 0.05)):
        if z < base or kind != 0:
            wood += [box((0.03, 2 * y, tall), (s * x, 0, z)) for s in (-1, 1)]
            wood += [box((2 * x, 0.03, tall * 0.94), (0, s * y, z + 0.003)) for s in (-1, 1)]
    u = np.linspace(-1, 1, 15)
    path = np.stack([u * (x - 0.01), np.full(15, y)], axis=1)
    crown = sampler.size(0.85, 1.2) + sampler.choice((0.0, 0.12)) * np.cos(np.pi * u / 2)
    wood.append(wall(path, base - 0.1, crown, 0.036, 0.01))
    wood.append(box((width, length, 0.03), (0, 0, base - 0.04)))
    cloth = []
    if kind == 2:
        cloth.append(box((2 * x + 0.06, 2 * y + 0.06, 0.02), (0, 0, height + 0.001)))
        cloth += [box((0.014, 2 * y, 0.2), (s * (x + 0.035), 0, height - 0.18)) for s in (-1, 1)]
        cloth.append(box((2 * x + 0.05, 0.014, 0.2), (0, -y - 0.035, height - 0.18)))
    if kind >= 2:
        t = np.linspace(0, 1, 9)
        profile = 0.05 + 0.05 * np.abs(t - 0.4) * 2
        tops = t * (height - 0.12) + 0.06
        drape = lathe(list(zip(profile.tolist(), tops.tolist(), strict=True)), segments=10)
        spots = [(sx * x, sy * (y - 0.04)) for sx in (-1, 1) for sy in (-1, 1)]
        cloth += [drape.scaled(0.8, 1.3, 1).translated(*at) for at in spots]
    groups, top = bedding(sampler, width - 0.01, length - 0.02, base - 0.012)
    frame = sampler.wood() if sampler.chance(0.75) else sampler.metal()
    return settled(
        assemble(
            "bed",
            (frame, wood),
            (sampler.fabric(), cloth),
            *groups,
            support_surfaces=head_area(width, length, top),
        )
    )


def daybed(sampler: Sampler) -> Model:
    """A single bed with ends of equal height and a low side at the wall, seen along its length."""
    width, length = sampler.size(0.8, 1.0), sampler.size(1.9, 2.05)
    base, height = sampler.size(0.28, 0.4), sampler.size(0.6, 0.85)
    thick, kind = sampler.size(0.03, 0.06), sampler.choice(("bars", "panel", "curl"))
    x, y = width / 2 + thick / 2 + 0.01, length / 2 + thick / 2
    frame = [box((2 * x, length + 0.02, 0.06), (0, 0, base - 0.065))]
    for side in (-1, 1):
        if kind == "curl":
            lean = np.linspace(0, 1, 9)
            path = np.stack([side * (y + 0.12 * lean**2), 0.1 + lean * (height - 0.1)], axis=1)
            frame.append(bent(path, thick, width))
        elif kind == "panel":
            frame.append(rounded_box((2 * x, thick, height - 0.08), (0, side * y, 0.08), 0.012))
        else:
            frame.append(box((2 * x, thick * 0.9, 0.05), (0, side * y, height - 0.05)))
            for at in np.linspace(-x + 0.1, x - 0.1, sampler.integer(3, 7)):
                frame.append(
                    cylinder(0.011, height - base + 0.03, (float(at), side * y, base - 0.06), 6)
                )
        frame += [
            box((thick, thick, height + 0.01), (s * (x - 0.01), side * y, 0)) for s in (-1, 1)
        ]
    guard = height - sampler.choice((0.0, 0.15))
    if kind == "bars":
        frame.append(box((thick, 2 * y, 0.05), (x - 0.01, 0, guard - 0.052)))
        for at in np.linspace(-y + 0.1, y - 0.1, sampler.integer(8, 14)):
            frame.append(
                cylinder(0.011, guard - base + 0.03, (x - 0.01, float(at), base - 0.06), 6)
            )
    elif sampler.chance(0.6):
        frame.append(box((thick * 0.8, 2 * y, guard - base + 0.08), (x - 0.01, 0, base - 0.085)))
    if sampler.chance(0.4):  # a guest bed on castors pulled out a little below
        out = sampler.uniform(0.02, 0.3)
        frame.append(box((width - 0.04, length - 0.1, base - 0.14), (-out, 0, 0.04)))
        frame += [
            cylinder(0.02, 0.045, (-out - width / 2 + 0.1, s * length / 3, 0), 8) for s in (-1, 1)
        ]
    groups, top = bedding(sampler, width, length - 0.02, base - 0.012)
    material = sampler.wood() if sampler.chance(0.6) else sampler.metal()
    model = assemble(
        "bed", (material, frame), *groups, support_surfaces=head_area(width, length, top)
    )
    return settled(sideways(model))


DESIGNS: dict[str, tuple[ModelFactory, ...]] = {
    "bed": (
        metal_bedstead,
        four_poster,
        daybed,
    ),
}
