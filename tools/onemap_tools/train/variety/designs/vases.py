"""Vases: amphoras, cylinders, bottles, facets, bulbs, rings, flat ones; bare or with flowers."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import Mesh, lathe, torus, tube
from onemap_simulator.generation.model import Model
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.bouquets import Profile, glaze_of, hollow, with_stems
from onemap_tools.train.variety.designs.flat_forms import rounded_outline, settled, skin
from onemap_tools.train.variety.designs.plant_parts import Groups


def amphora(sampler: Sampler) -> Model:
    """An amphora or urn: full shoulders, narrow foot, two ears or tall handles, or a jug's one."""
    height, r = sampler.size(0.24, 0.5), sampler.size(0.08, 0.15)
    neck, waist = r * sampler.uniform(0.35, 0.55), sampler.uniform(0.5, 0.66)
    profile: Profile = [
        (r * 0.5, 0),
        (r * 0.45, height * 0.04),
        (r * 0.85, height * 0.3),
        (r, height * waist),
    ]
    profile += [
        (r * 0.8, height * 0.74),
        (neck, height * 0.82),
        (neck, height * 0.93),
        (neck * 1.4, height),
    ]
    ears = []
    for side in (-1, 1) if sampler.chance(0.75) else (1,):
        out = side * r * sampler.uniform(1.0, 1.3)
        low, high = (side * r * 0.9, 0.0, height * 0.68), (side * neck * 0.95, 0.0, height * 0.91)
        path = [low, (out, 0, height * 0.76), (out * 0.9, 0, height * 0.9), high]
        ears.append(tube(path, r * 0.1, 6))
    glaze = glaze_of(sampler)
    return with_stems(sampler, [(glaze, [hollow(profile), *ears])], neck, height)


def straight_vase(sampler: Sampler) -> Model:
    """A cylinder, tapered tube, trumpet or square column, plain or with rings."""
    height, r = sampler.size(0.18, 0.45), sampler.size(0.045, 0.09)
    kind, segments = sampler.integer(0, 3), 18
    upper = r * (1.0, 1.4, 0.75, 1.0)[kind]
    if kind == 3:
        segments, upper = 4, r * sampler.choice((0.9, 1.2))
    steps = np.linspace(0, 1, 7).tolist()
    curve = 2.2 if kind == 1 else 1.0
    profile: Profile = [(r + (upper - r) * t**curve, height * t) for t in steps]
    body = [hollow(profile, segments)]
    bands = []
    if kind in {0, 2} and sampler.chance(0.5):
        count = sampler.integer(1, 7)
        for index in range(count):
            t = 0.9 * (index + 1) / (count + 1)
            bands.append(torus(r + (upper - r) * t, 0.005, (0, 0, height * t), 18))
    turned = [mesh.rotated("z", 45) for mesh in body]
    groups: Groups = [(glaze_of(sampler), turned)]
    if bands:
        groups.append((glaze_of(sampler), bands))
    return with_stems(sampler, groups, upper * 0.8, height)


def bottle_vase(sampler: Sampler) -> Model:
    """A bottle: a round, onion-shaped or conical body under a long thin neck."""
    height, r = sampler.size(0.22, 0.5), sampler.size(0.06, 0.13)
    neck, share = r * sampler.uniform(0.16, 0.3), sampler.uniform(0.3, 0.55)
    belly = height * share
    kind = sampler.integer(0, 2)
    if kind == 0:
        angle = np.linspace(-70, 70, 7)
        profile = [
            (r * float(np.cos(np.radians(a))), belly * (0.5 + 0.53 * float(np.sin(np.radians(a)))))
            for a in angle
        ]
    elif kind == 1:
        profile = [
            (r * 0.8, 0.0),
            (r, belly * 0.15),
            (r * 0.8, belly * 0.5),
            (r * 0.4, belly * 0.85),
        ]
    else:
        profile = [(r * 0.55, 0.0), (r * 0.75, belly * 0.5), (r, belly * 0.85), (r * 0.6, belly)]
    profile += [
        (neck, belly * 1.18),
        (neck, height * 0.95),
        (neck * sampler.uniform(1.1, 2.2), height),
    ]
    first = profile[0][1]
    lifted = [(radius, z - first) for radius, z in profile]
    return with_stems(sampler, [(glaze_of(sampler), [hollow(lifted)])], neck, lifted[-1][1])


def faceted_vase(sampler: Sampler) -> Model:
    """A faceted vase: few flat sides, twisted from ring to ring or cut like a crystal."""
    height, r = sampler.size(0.18, 0.4), sampler.size(0.07, 0.13)
    sides, levels = sampler.integer(5, 9), sampler.integer(3, 5)
    twist = sampler.choice((0.0, 0.5, 1.0)) * np.pi / sides
    radii = [sampler.uniform(0.55, 1.0) * r for _ in range(levels)]
    angle = np.linspace(0, 2 * np.pi, sides, endpoint=False)
    rings = np.zeros((levels + 2, sides, 3))
    sizes = [*radii, radii[-1] * 0.8, radii[-1] * 0.7]
    heights = [*np.linspace(0, height, levels).tolist(), height, height - 0.035]
    for index, (size, z) in enumerate(zip(sizes, heights, strict=True)):
        turned = angle + twist * min(index, levels - 1)
        rings[index, :, 0], rings[index, :, 1] = size * np.cos(turned), size * np.sin(turned)
        rings[index, :, 2] = z
    return with_stems(sampler, [(glaze_of(sampler), [skin(rings)])], radii[-1] * 0.7, height)


def bulb_vase(sampler: Sampler) -> Model:
    """A ball, pebble, gourd or pot-bellied vase with a short collar, ribbed or smooth."""
    r = sampler.size(0.08, 0.16)
    tall = r * sampler.uniform(1.2, 2.2)
    mouth = r * sampler.uniform(0.25, 0.5)
    edge = float(np.degrees(np.arccos(mouth / r)))
    angle = np.radians(np.linspace(-60, edge, 8))
    profile = [(r * float(np.cos(a)), tall / 2 * (float(np.sin(a)) + 0.866)) for a in angle]
    top = profile[-1][1] + sampler.uniform(0.005, 0.05)
    profile.append((mouth * sampler.uniform(0.9, 1.5), top))
    body = hollow(profile, 24)
    if sampler.chance(0.4):
        count = sampler.choice((6, 8, 12))
        turn = np.arctan2(body.vertices[:, 1], body.vertices[:, 0])
        rib = 1 - 0.1 * np.abs(np.sin(turn * count / 2))
        factor = np.stack([rib, rib, np.ones_like(rib)], axis=1)
        body = Mesh(body.vertices * factor, body.faces, body.uv)
    return with_stems(sampler, [(glaze_of(sampler), [body])], mouth, top)


def ring_vase(sampler: Sampler) -> Model:
    """A modern vase: an upright ring with a neck, or two joined tubes in a U."""
    r = sampler.size(0.08, 0.14)
    thick = r * sampler.uniform(0.28, 0.4)
    glaze = glaze_of(sampler)
    if sampler.chance(0.6):
        ring = torus(r, thick, segments=24).rotated("x", 90).translated(0, 0, r + thick)
        top = 2 * (r + thick) + sampler.uniform(0.01, 0.06)
        neck = hollow(
            [(thick * 0.6, 0), (thick * 0.55, (top - 2 * r) * 0.6), (thick * 0.75, top - 2 * r)]
        )
        foot = lathe([(thick * 1.3, 0), (thick * 1.1, thick * 0.5)], segments=16)
        return with_stems(
            sampler, [(glaze, [ring, neck.translated(0, 0, 2 * r), foot])], thick * 0.5, top
        )
    arc = np.radians(np.linspace(180, 360, 11))
    top = r + thick + r * sampler.uniform(0.8, 1.8)
    bend = [(r * float(np.cos(a)), 0.0, r + thick + r * float(np.sin(a))) for a in arc]
    pipe = tube([(-r, 0, top - 0.03), *bend, (r, 0, top - 0.03)], thick, 12)
    collars = [
        hollow([(thick, 0), (thick * 1.05, 0.04)], 12).translated(x, 0, top - 0.04) for x in (-r, r)
    ]
    foot = lathe([(thick * 1.5, 0), (thick * 1.4, thick * 0.4)], segments=16)
    return settled("vase", (glaze, [pipe, *collars, foot]))


def flat_vase(sampler: Sampler) -> Model:
    """A flat vase: an oval, fan or pillow, wide and shallow, its mouth a slot."""
    width, height = sampler.size(0.16, 0.32), sampler.size(0.18, 0.36)
    deep, kind = width * sampler.uniform(0.28, 0.45), sampler.integer(0, 2)
    shares = {0: (0.55, 0.9, 1.0, 0.85, 0.4, 0.4), 1: (0.4, 0.5, 0.62, 0.76, 0.9, 1.0)}
    chosen = shares.get(kind, (0.9, 1.0, 0.97, 0.97, 1.0, 0.9))
    rings = []
    levels = [*np.linspace(0, height, 6).tolist(), height, height - 0.03]
    for share, z in zip((*chosen, chosen[-1] * 0.86, chosen[-1] * 0.84), levels, strict=True):
        w, d = width * share, deep * (0.5 + 0.5 * share)
        flat = rounded_outline(w, d, d * 0.45)
        rings.append(np.column_stack([flat, np.full(len(flat), z)]))
    groups: Groups = [(glaze_of(sampler), [skin(np.array(rings))])]
    return with_stems(sampler, groups, min(deep, width * chosen[-1]) * 0.35, height)


DESIGNS: dict[str, tuple[ModelFactory, ...]] = {
    "vase": (
        amphora,
        straight_vase,
        bottle_vase,
        faceted_vase,
        bulb_vase,
        ring_vase,
        flat_vase,
    )
}
