"""Table lamps: mushrooms, candlesticks with pleats, banker's, lava, spots, bulky bodies."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import (
    Mesh,
    box,
    cone,
    cylinder,
    ellipsoid,
    lathe,
    rod,
    rounded_box,
    torus,
    tube,
)
from onemap_simulator.generation.model import Material, Model
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.flat_forms import settled, skin
from onemap_tools.train.variety.designs.lamp_shades import bulb, pleated, shade_of, shell


def mushroom(sampler: Sampler) -> Model:
    """A mushroom: a wide dome or cap of glass or metal on a bulging or straight stem."""
    height, radius = sampler.size(0.28, 0.5), sampler.size(0.13, 0.22)
    cap_h = radius * sampler.uniform(0.5, 1.0)
    low = height - cap_h
    angle = np.linspace(0, np.pi / 2, 7)
    cap = [(radius * float(np.cos(a)) + 0.002, cap_h * float(np.sin(a))) for a in angle]
    lip = radius * sampler.uniform(0.88, 1.0)
    dome = lathe([(lip * 0.9, 0.0), (lip * 0.96, -0.012), *cap], (0, 0, low), 20)
    r = radius * sampler.uniform(0.25, 0.5)
    flare = r * sampler.uniform(1.1, 1.9)
    stem = lathe([(flare, 0), (flare * 0.97, 0.01), (r * 0.7, low * 0.5), (r, low + 0.003)])
    if sampler.chance(0.3):
        stem = lathe([(flare, 0), (flare, 0.02), (0.015, 0.03), (0.015, low + 0.003)])
    body = sampler.plastic() if sampler.chance(0.4) else sampler.metal()
    cap_material = body if sampler.chance(0.3) else sampler.pale()
    return settled("lamp", (body, [stem]), (cap_material, [dome]))


def candlestick_lamp(sampler: Sampler) -> Model:
    """A turned candlestick of beads and rings under a pleated or plain cloth shade."""
    height, radius = sampler.size(0.4, 0.62), sampler.size(0.12, 0.2)
    low, foot = height - radius * 1.1, radius * sampler.uniform(0.45, 0.6)
    profile = [(foot, 0.0), (foot, 0.012), (foot * 0.6, 0.035), (0.014, 0.05)]
    count = sampler.integer(2, 5)
    step = (low - 0.06) / count
    for index in range(count):
        z, r = 0.055 + index * step, sampler.uniform(0.018, 0.045)
        profile += [(0.013, z), (r, z + step * 0.35), (r * 0.9, z + step * 0.6), (0.012, z + step)]
    stick = lathe([*profile, (0.01, low + 0.04)], segments=14)
    top = low + 0.02
    if sampler.chance(0.6):
        high = radius * sampler.uniform(0.9, 1.3)
        shade = pleated((radius, radius * sampler.uniform(0.45, 0.75)), high, top)
    else:
        shade = shade_of(sampler, radius, top)
    cloth = sampler.pale() if sampler.chance(0.5) else sampler.fabric()
    arm = rod((-radius * 0.5, 0, top + 0.03), (radius * 0.5, 0, top + 0.03), 0.004, 5)
    material = sampler.metal() if sampler.chance(0.5) else sampler.wood()
    return settled(
        "lamp",
        (material, [stick, arm]),
        (cloth, [shade]),
        (sampler.pale(), [bulb((0, 0, top + 0.06), 0.028)]),
    )


def bankers_lamp(sampler: Sampler) -> Model:
    """A banker's lamp: a long half-round glass shade on a brass arch or stem, with a pull chain."""
    width, height = sampler.size(0.24, 0.36), sampler.size(0.32, 0.42)
    r = sampler.uniform(0.06, 0.085)
    angle = np.radians(np.linspace(-5, 185, 11))
    arc = np.stack([r * np.cos(angle), r * np.sin(angle)], axis=1)
    loop = np.concatenate([arc, arc[::-1] * 0.93])
    rings = np.empty((2, len(loop), 3))
    for ring, x in zip(rings, (-width / 2, width / 2), strict=True):
        ring[:, 0], ring[:, 1], ring[:, 2] = x, loop[:, 0], loop[:, 1]
    half = sampler.uniform(-25, 5)
    shade = skin(rings, closed=True).rotated("x", half)
    z = height - r
    base_w = sampler.uniform(0.15, 0.2)
    frame = [rounded_box((base_w, 0.13, 0.03), (0, 0, 0), 0.012)]
    if sampler.chance(0.5):
        frame.append(tube([(0, 0.03, 0.02), (0, 0.05, z * 0.6), (0, 0.02, z + r * 0.9)], 0.009))
    else:
        frame += [
            cylinder(0.01, z + r * 0.9, segments=8),
            ellipsoid((0.025, 0.025, 0.03), (0, 0, z * 0.4)),
        ]
    frame.append(rod((-width * 0.45, 0, z + r * 0.3), (width * 0.45, 0, z + r * 0.3), 0.008, 6))
    frame.append(rod((width * 0.2, -0.03, z - 0.07), (width * 0.2, -0.03, z + r * 0.3), 0.003, 5))
    frame.append(ellipsoid((0.009, 0.009, 0.012), (width * 0.2, -0.03, z - 0.075), 6))
    return settled(
        "lamp", (sampler.metal(), frame), (sampler.plastic(), [shade.translated(0, 0, z)])
    )


def lava_lamp(sampler: Sampler) -> Model:
    """A lava lamp or rocket: glass between a metal cone and cap, blobs in it."""
    height, r = sampler.size(0.34, 0.55), sampler.size(0.05, 0.08)
    waist, neck = height * 0.3, height * 0.85
    foot = lathe(
        [(r * 1.1, 0), (r * 1.05, 0.01), (r * 0.62, waist * 0.55), (r, waist)], segments=18
    )
    glass = [(r * 0.98, waist - 0.004), (r * 1.02, waist * 1.15), (r * 0.85, height * 0.6)]
    body = lathe([*glass, (r * 0.58, neck + 0.004)], segments=18)
    cap = lathe([(r * 0.62, neck), (r * 0.45, height), (r * 0.2, height + 0.006)], segments=18)
    blobs: list[Mesh] = []
    for _ in range(sampler.integer(3, 6)):
        z, a = sampler.uniform(waist * 1.2, height * 0.75), sampler.uniform(0, 2 * np.pi)
        size = r * sampler.uniform(0.25, 0.45)
        at = (r * 0.66 * float(np.cos(a)), r * 0.66 * float(np.sin(a)), z)
        blobs.append(ellipsoid((size, size, size * 1.4), at, 10))
    return settled(
        "lamp",
        (sampler.metal(), [foot, cap]),
        (sampler.plastic(), [body]),
        (sampler.plastic(), blobs),
    )


def body_lamp(sampler: Sampler) -> Model:
    """A bulky ceramic or glass body: gourd, stacked balls, bottle, cube or ribs, with a shade."""
    height, radius = sampler.size(0.42, 0.65), sampler.size(0.15, 0.23)
    low = height - radius * 1.05
    r, kind = radius * sampler.uniform(0.5, 0.85), sampler.integer(0, 4)
    if kind == 0:
        gourd = [(r * 0.6, 0), (r, low * 0.25), (r * 0.45, low * 0.55), (r * 0.6, low * 0.72)]
        body = [lathe([*gourd, (0.02, low * 0.92)], segments=18)]
    elif kind == 1:
        count = sampler.integer(2, 4)
        ball = low * 0.92 / count / 2
        body = [
            ellipsoid((min(ball * 1.2, r),) * 2 + (ball * 1.02,), (0, 0, ball * (2 * i + 1)), 14)
            for i in range(count)
        ]
    elif kind == 2:
        body = [
            lathe([(r * 0.8, 0), (r * 0.8, low * 0.5), (0.02, low * 0.75), (0.018, low * 0.92)])
        ]
    elif kind == 3:
        body = [box((r * 1.4, r * 1.4, low * 0.88), (0, 0, 0.012)), box((r * 1.6, r * 1.6, 0.016))]
    else:
        rib = [(r * (0.8 + 0.15 * (i % 2)), low * 0.9 * i / 12) for i in range(13)]
        body = [lathe(rib, segments=16)]
    neck = [cylinder(0.012, low * 0.2 + radius * 0.4, (0, 0, low * 0.85), 8)]
    if sampler.chance(0.5):
        neck.append(ellipsoid((0.012, 0.012, 0.016), (0, 0, height + radius * 0.02), 8))
        neck.append(cylinder(0.004, radius * 0.8, (0, 0, height - radius * 0.75), 5))
    cloth = sampler.pale() if sampler.chance(0.5) else sampler.fabric()
    glaze = sampler.ceramic() if sampler.chance(0.6) else sampler.wood()
    return settled(
        "lamp", (glaze, body), (sampler.metal(), neck), (cloth, [shade_of(sampler, radius, low)])
    )


def pendant_stand(sampler: Sampler) -> Model:
    """A small shade or bare bulb that hangs from a bent or square-cornered stand."""
    height, reach = sampler.size(0.38, 0.55), sampler.uniform(0.14, 0.22)
    wooden = sampler.chance(0.5)
    left = -reach / 2
    if wooden:
        thick = 0.025
        stand = [
            box((reach + 0.12, 0.14, 0.022), (0, 0, 0)),
            box((thick, thick, height - 0.02), (left, 0, 0.02)),
            box((reach + 0.03, thick, thick), (0.015, 0, height - thick)),
        ]
    else:
        arc = np.radians(np.linspace(180, 0, 9))
        top = height - reach / 2
        path = [
            (left, 0, 0.01),
            *((reach / 2 * np.cos(a), 0, top + reach / 2 * np.sin(a)) for a in arc),
        ]
        stand = [tube(path, 0.008, 8), cylinder(0.09, 0.02, (left, 0, 0), 18)]
    x, hang = reach / 2, height - (0.05 if wooden else reach / 2)
    z = hang - sampler.uniform(0.03, 0.1)
    cord = [
        rod((x, 0, z), (x, 0, hang + 0.04), 0.003, 5),
        cone((0.018, 0.012), 0.04, (x, 0, z - 0.02), 8),
    ]
    groups: list[tuple[Material, list[Mesh]]] = [
        (sampler.wood() if wooden else sampler.metal(), stand),
        (sampler.dark(), cord),
        (sampler.pale(), [bulb((x, 0, z - 0.05), 0.038)]),
    ]
    if sampler.chance(0.6):
        r = sampler.uniform(0.06, 0.095)
        cup = [(r, -r * 1.1), (r * 0.8, -r * 0.5), (0.02, 0.0)]
        groups.append((sampler.plastic(), [shell(cup, (x, 0, z + 0.01))]))
    return settled("lamp", *groups)


def studio_spot(sampler: Sampler) -> Model:
    """An industrial spot: a drum with a lens and barn doors in a fork on a tripod or short legs."""
    height, r = sampler.choice((sampler.size(0.4, 0.6), sampler.size(1.2, 1.7))), 0.0
    r = sampler.uniform(0.1, 0.2) if height > 1 else sampler.uniform(0.07, 0.11)
    deep, spread = r * sampler.uniform(1.3, 2.2), height * 0.2 + 0.06
    z, tilt = height - r * 1.1, sampler.uniform(-20, 25)
    drum = [(r * 0.45, 0), (r * 0.8, deep * 0.2), (r * 0.85, deep * 0.6), (r, deep)]
    head = [lathe([*drum, (r * 0.9, deep), (r * 0.8, deep * 0.9)], segments=18)]
    head += [torus(r * 0.88, r * 0.05, (0, 0, deep * s), 16) for s in (0.35, 0.5)]
    lens = [lathe([(r * 0.78, deep * 0.93), (r * 0.4, deep * 0.98), (0.01, deep)], segments=16)]
    if sampler.chance(0.5):
        for side in (0, 90, 180, 270):
            door = box((r * 1.3, 0.005, r * 0.9)).rotated("x", -35).translated(0, r, deep)
            head.append(door.rotated("z", side))
    facing = [
        [m.translated(0, 0, -deep / 2).rotated("x", 90 + tilt).translated(0, 0, z) for m in group]
        for group in (head, lens)
    ]
    fork = [(-r * 1.08, 0.0, z), (-r * 1.08, 0.0, z - r * 1.25), (r * 1.08, 0.0, z - r * 1.25)]
    legs = [tube([*fork, (r * 1.08, 0.0, z)], 0.008), rod((-r * 1.1, 0, z), (r * 1.1, 0, z), 0.008)]
    hub = max(z - r * 1.25, 0.1)
    legs.append(cylinder(0.014, hub * 0.5, (0, 0, hub * 0.5), 8))
    for a in np.radians([90, 210, 330]):
        foot = (spread * np.cos(a), spread * np.sin(a), 0.01)
        legs.append(rod(foot, (0, 0, hub * 0.9), 0.013))
    return settled(
        "lamp",
        (sampler.metal(), facing[0]),
        (sampler.pale(), facing[1]),
        (sampler.wood() if sampler.chance(0.5) else sampler.metal(), legs),
    )


DESIGNS: dict[str, tuple[ModelFactory, ...]] = {
    "lamp": (
        mushroom,
        candlestick_lamp,
        bankers_lamp,
        lava_lamp,
        body_lamp,
        pendant_stand,
        studio_spot,
    )
}
