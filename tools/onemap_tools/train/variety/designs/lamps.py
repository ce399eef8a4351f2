"""Floor lamps: arcs, tripods, uplighters, jointed arms, globes and paper."""

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
    torus,
    tube,
)
from onemap_simulator.generation.model import Material, Model
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.flat_forms import settled
from onemap_tools.train.variety.designs.lamp_shades import bulb, shade_of, shell


def _metal(sampler: Sampler) -> Material:
    if sampler.chance(0.65):
        return sampler.metal()
    return sampler.plastic() if sampler.chance(0.5) else sampler.dark()


def _cloth(sampler: Sampler) -> Material:
    if sampler.chance(0.5):
        return sampler.pale()
    return sampler.fabric() if sampler.chance(0.6) else sampler.plastic()


def _foot(sampler: Sampler, radius: float) -> list[Mesh]:
    """A heavy foot: disc, dome, cube, cross of bars or ring."""
    kind = sampler.integer(0, 4)
    if kind == 0:
        return [cylinder(radius, 0.022, segments=20)]
    if kind == 1:
        return [lathe([(radius, 0), (radius, 0.012), (radius * 0.5, 0.04), (0.012, 0.08)])]
    if kind == 2:
        return [box((radius * 1.5, radius * 1.5, 0.06))]
    if kind == 3:
        return [
            box((2 * radius, 0.03, 0.022)),
            box((0.03, 2 * radius, 0.026)),
        ]
    return [torus(radius, 0.012, (0, 0, 0.012)), rod((-radius, 0, 0.012), (radius, 0, 0.012), 0.01)]


def arc_lamp(sampler: Sampler) -> Model:
    """A tall arc from a heavy block that carries a dome or drum far out."""
    height, reach = sampler.size(1.6, 2.0), sampler.size(0.8, 1.25)
    angle = np.radians(np.linspace(180, sampler.uniform(5, 25), 13))
    rise = height * sampler.uniform(0.4, 0.6)
    path = [(-reach / 2, 0.0, 0.03)]
    path += [(reach / 2 * np.cos(a), 0.0, rise + (height - rise) * np.sin(a)) for a in angle]
    frame = [tube(path, sampler.uniform(0.01, 0.016), 8)]
    x, z, radius = path[-1][0], path[-1][2], sampler.size(0.13, 0.2)
    if sampler.chance(0.65):
        dome = [(radius, -radius * 0.8), (radius * 0.87, -radius * 0.4), (radius * 0.5, -0.06)]
        shade = shell([*dome, (0.03, 0.0)], (x, 0, z))
    else:
        shade = shell([(radius, -radius), (radius, 0)], (x, 0, z))
        frame.append(rod((x - radius, 0, z - 0.004), (x + radius, 0, z - 0.004), 0.005))
    foot = box((0.26, 0.26, 0.12)) if sampler.chance(0.5) else cylinder(0.16, 0.07, segments=20)
    stone = sampler.ceramic() if sampler.chance(0.5) else _metal(sampler)
    turn = sampler.choice((0.0, 180.0, -35.0, 215.0))
    lit = bulb((x, 0, z - radius * 0.5))
    rod_group = (_metal(sampler), [mesh.rotated("z", turn) for mesh in frame])
    return settled(
        "lamp",
        (stone, [foot.translated(-reach / 2, 0, 0).rotated("z", turn)]),
        rod_group,
        (_cloth(sampler), [shade.rotated("z", turn)]),
        (sampler.pale(), [lit.rotated("z", turn)]),
    )


def tripod_lamp(sampler: Sampler) -> Model:
    """A shade on three legs of wood, straight or crossing, with braces or a plate."""
    height, radius = sampler.size(1.25, 1.65), sampler.size(0.18, 0.28)
    low, spread = height - radius * 1.1, sampler.uniform(0.22, 0.34)
    across = sampler.choice((0.0, 0.0, -0.3))
    legs, joints = [], []
    angles = np.radians(np.array([90, 210, 330]) + sampler.choice((0, 60)))
    for a in angles:
        x, y = spread * np.cos(a), spread * np.sin(a)
        thick = sampler.uniform(0.012, 0.02)
        legs.append(rod((x, y, 0.008), (x * across + 0.02 * np.cos(a), y * across, low), thick))
    joints.append(cylinder(0.05, 0.05, (0, 0, low * (0.75 if across else 0.97)), 12))
    joints.append(cylinder(0.012, height * 0.98 - low * 0.75, (0, 0, low * 0.75), 8))
    if not across and sampler.chance(0.5):
        ring = spread * 0.55
        joints.append(torus(ring, 0.008, (0, 0, low * 0.45), 18))
    shade = shade_of(sampler, radius, low)
    return settled(
        "lamp",
        (sampler.wood() if sampler.chance(0.7) else _metal(sampler), legs),
        (_metal(sampler), joints),
        (_cloth(sampler), [shade]),
        (sampler.pale(), [bulb((0, 0, low + radius * 0.5))]),
    )


def torchiere(sampler: Sampler) -> Model:
    """An uplighter: a bowl open to the ceiling on a tall thin pole, some with a reading arm."""
    height, radius = sampler.size(1.6, 1.9), sampler.size(0.13, 0.22)
    deep = radius * sampler.uniform(0.4, 0.8)
    bowl = shell([(0.03, 0), (radius * 0.6, deep * 0.3), (radius, deep)], (0, 0, height - deep))
    pole = [*_foot(sampler, sampler.uniform(0.12, 0.17))]
    pole.append(cylinder(sampler.uniform(0.009, 0.018), height - deep, (0, 0, 0.005), 8))
    pole.append(cone((0.02, 0.045), 0.06, (0, 0, height - deep - 0.05), 10))
    for share in (0.33, 0.66) if sampler.chance(0.4) else ():
        pole.append(ellipsoid((0.028, 0.028, 0.04), (0, 0, height * share), 8))
    shades = [bowl]
    if sampler.chance(0.45):
        z, side = height * sampler.uniform(0.55, 0.7), sampler.choice((-1, 1))
        elbow, end = (side * 0.16, -0.1, z + 0.14), (side * 0.26, -0.16, z + 0.04)
        pole.append(tube([(0, 0, z), (side * 0.08, -0.05, z + 0.12), elbow, end], 0.008))
        small = shell([(0.06, -0.1), (0.045, -0.03), (0.018, 0.0)], end)
        shades.append(small)
    lit = bulb((0, 0, height - deep * 0.5))
    glass = sampler.ceramic() if sampler.chance(0.5) else _metal(sampler)
    model_parts = (_metal(sampler), pole)
    return settled("lamp", model_parts, (glass, shades), (sampler.pale(), [lit]))


def reading_lamp(sampler: Sampler) -> Model:
    """A jointed reading lamp for floor or desk: two arms with springs and a bell or cone head."""
    tall = sampler.chance(0.45)
    post = sampler.uniform(0.7, 1.0) if tall else 0.04
    arm = sampler.uniform(0.25, 0.45) if tall else sampler.uniform(0.2, 0.36)
    a, b = np.radians(sampler.uniform(95, 130)), np.radians(sampler.uniform(5, 50))
    shoulder = np.array([0.0, 0.0, post])
    elbow = shoulder + arm * np.array([np.cos(a), 0, np.sin(a)])
    wrist = elbow + arm * sampler.uniform(0.8, 1.1) * np.array([np.cos(b), 0, np.sin(b)])
    gap, thin = sampler.choice((0.0, 0.012)), sampler.uniform(0.005, 0.009)
    arms = []
    for start, end in ((shoulder, elbow), (elbow, wrist)):
        for side in (-1, 1) if gap else (0,):
            shift = np.array([0, side * gap, 0])
            arms.append(tube([start + shift, end + shift], thin, 6))
    joints = [
        cylinder(0.018, 0.044, segments=10).rotated("x", 90).translated(p[0], 0.022, p[2])
        for p in (shoulder, elbow, wrist)
    ]
    foot = _foot(sampler, 0.15 if tall else sampler.uniform(0.08, 0.11))
    if tall:
        foot.append(cylinder(0.012, post, segments=8))
    else:
        foot.append(cylinder(0.02, post + 0.01, segments=10))
    r = sampler.uniform(0.065, 0.1)
    profile = [(r, -r * 1.7), (r * 0.85, -r), (r * 0.4, -r * 0.4), (r * 0.3, 0.02)]
    if sampler.chance(0.4):
        profile = [(r, -r * 1.4), (r * 0.35, 0.0), (r * 0.35, 0.03)]
    nod = -sampler.uniform(-10, 45)
    head = shell(profile).rotated("y", nod).translated(*wrist)
    lit = bulb((0, 0, -r * 0.9), 0.03).rotated("y", nod).translated(*wrist)
    turn = sampler.choice((0.0, 180.0, -40.0, 220.0))
    paint = _metal(sampler)
    groups = [(paint, [*foot, head]), (_metal(sampler), [*arms, *joints]), (sampler.pale(), [lit])]
    return settled("lamp", *((m, [x.rotated("z", turn) for x in ms]) for m, ms in groups))


def globe_lamp(sampler: Sampler) -> Model:
    """A ball of glass on a pole, or several balls on branches."""
    height, radius = sampler.size(1.3, 1.7), sampler.uniform(0.1, 0.2)
    pole = _foot(sampler, sampler.uniform(0.12, 0.18))
    balls = []
    count = sampler.choice((1, 1, 2, 3, 5))
    if count == 1:
        balls.append(ellipsoid((radius, radius, radius), (0, 0, height - radius), 18))
        pole.append(cylinder(0.011, height - 1.9 * radius, segments=8))
        pole.append(cone((0.02, 0.05), 0.04, (0, 0, height - 2 * radius - 0.015), 12))
    else:
        pole.append(cylinder(0.011, height * 0.95, segments=8))
        for index in range(count):
            a, z = index * 2.4, height * (0.95 - 0.14 * index)
            r = radius * sampler.uniform(0.45, 0.65)
            x, y = 0.17 * np.cos(a), 0.17 * np.sin(a)
            pole.append(rod((0, 0, z - 0.05), (x, y, z), 0.007, 6))
            balls.append(ellipsoid((r, r, r), (x, y, z + r * 0.8), 14))
    return settled("lamp", (_metal(sampler), pole), (sampler.pale(), balls))


def paper_lantern(sampler: Sampler) -> Model:
    """A paper lantern with wire ribs: a ball, a tall ribbed column or stacked bodies on feet."""
    kind = sampler.integer(0, 2)
    radius = sampler.uniform(0.14, 0.24)
    height = sampler.size(0.9, 1.5) if kind else radius * 1.7
    count = 14 + 8 * (kind > 0)
    share = np.linspace(0, 1, count)
    if kind == 0:
        outline = radius * np.sqrt(np.clip(1 - (2 * share - 1) ** 2 * 0.94, 0, 1))
    elif kind == 1:
        outline = radius * (0.72 + 0.1 * np.sin(share * np.pi))
    else:
        outline = radius * (0.6 + 0.35 * np.abs(np.sin(share * np.pi * sampler.integer(2, 4))))
    lift = 0.08
    profile = []
    for index, (r, s) in enumerate(zip(outline.tolist(), share.tolist(), strict=True)):
        profile.append((r * (1.0 if index % 2 else 0.95), lift + height * s))
    paper = lathe(profile, segments=18)
    top = float(outline[-1])
    low = float(outline[0]) * 0.9
    wires = [torus(low, 0.005, (0, 0, lift), 16), torus(top, 0.005, (0, 0, lift + height), 16)]
    for a in np.radians([90, 210, 330]):
        x, y = low * np.cos(a), low * np.sin(a)
        wires.append(rod((1.25 * x, 1.25 * y, 0.005), (x, y, lift + 0.01), 0.006, 6))
    wires.append(cylinder(0.02, 0.02, (0, 0, lift + height - 0.005), 8))
    return settled(
        "lamp",
        (sampler.pale() if sampler.chance(0.7) else sampler.plastic(), [paper]),
        (sampler.wood() if sampler.chance(0.4) else _metal(sampler), wires),
    )


DESIGNS: dict[str, tuple[ModelFactory, ...]] = {
    "lamp": (
        arc_lamp,
        tripod_lamp,
        torchiere,
        reading_lamp,
        globe_lamp,
        paper_lantern,
    )
}
