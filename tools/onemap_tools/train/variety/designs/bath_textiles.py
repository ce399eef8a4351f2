"""Towels as they hang, lie folded or are bunched on a hook; the wall is at +y."""

from __future__ import annotations

import numpy as np

from onemap_shared.geometry import F64
from onemap_simulator.generation.mesh import (
    Mesh,
    box,
    cylinder,
    ellipsoid,
    from_faces,
    rod,
    rounded_box,
    torus,
    tube,
)
from onemap_simulator.generation.model import Material, Model
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.sanitary import ring, skin, stand


def _sheet(profile: F64, width: float, wave: F64, thick: float) -> Mesh:
    """A cloth: a (N, 2) path in y and z swept over x; ``wave`` (M,) moves it along y."""
    xs = np.linspace(-width / 2, width / 2, len(wave))
    along = np.gradient(profile, axis=0)
    normal = np.stack([along[:, 1], -along[:, 0]], axis=1)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-9)
    outline = np.concatenate([profile + normal * thick / 2, (profile - normal * thick / 2)[::-1]])
    low = profile[:, 1].min()
    fall = 1 - (outline[:, 1] - low) / max(profile[:, 1].max() - low, 1e-6)
    rings = []
    for x, shift in zip(xs, wave, strict=True):
        y = outline[:, 0] + shift * (0.15 + 0.85 * fall)
        rings.append(np.stack([np.full(len(y), x), y, outline[:, 1]], axis=1))
    return skin(rings, capped=False)


def _over(y: float, z: float, drops: tuple[float, float], radius: float) -> F64:
    """A path up the front of a bar at (y, z), over it and down behind it."""
    arc = [(y - radius * np.cos(a), z + radius * np.sin(a)) for a in np.linspace(0, np.pi, 6)]
    front = [(y - radius - 0.008, z - drops[0] * s) for s in (1.0, 0.66, 0.33)]
    back = [(y + radius, z - drops[1] * s) for s in (0.5, 1.0)]
    return np.array([*front, *arc, *back])


def _wave(sampler: Sampler, size: float) -> F64:
    count = 13
    at = np.linspace(0, 1, count) * np.pi * sampler.uniform(2, 6) + sampler.uniform(0, 6)
    return np.asarray(-size * (1 + np.sin(at)) / 2)


def over_rail(sampler: Sampler) -> Model:
    """One or two towels over a wall rail of one or two bars, unequal in front and behind."""
    rail_w, drop = sampler.size(0.45, 0.8), sampler.size(0.4, 0.8)
    bars, towels = sampler.integer(1, 2), sampler.integer(1, 2)
    metal: list[Mesh] = []
    ends = rail_w / 2 + 0.03
    for i in range(bars):
        y, z = -0.06 - 0.06 * i, -0.0 - 0.07 * i
        metal.append(rod((-ends, y, z), (ends, y, z), 0.009))
    for x in (-ends, ends):
        metal += [
            rod(
                (x, 0, -0.03 * (bars - 1)),
                (x, -0.06 - 0.06 * (bars - 1), -0.07 * (bars - 1)),
                0.009,
            )
        ]
        metal += [
            rod((x, 0, 0), (x, -0.06, 0), 0.009),
            box((0.045, 0.012, 0.045), (x, 0.0, -0.022)),
        ]
    y, z = -0.06 * bars, -0.07 * (bars - 1)
    each = rail_w / towels
    groups: list[tuple[Material, list[Mesh]]] = []
    for i in range(towels):
        wide = each * sampler.uniform(0.7, 0.96)
        long = drop * sampler.uniform(0.75, 1.0)
        path = _over(y, z, (long, long * sampler.uniform(0.35, 0.95)), 0.016)
        cloth = _sheet(path, wide, _wave(sampler, sampler.uniform(0.005, 0.03)), 0.012)
        x = (i - (towels - 1) / 2) * each
        groups.append((sampler.fabric(), [cloth.translated(x, 0)]))
        if sampler.chance(0.4):
            small = _over(y, z, (long * 0.5, long * 0.3), 0.026)
            hand = _sheet(small, wide * 0.6, _wave(sampler, 0.004) - 0.03, 0.01)
            groups.append((sampler.fabric(), [hand.translated(x, 0)]))
    return stand("towel", (sampler.metal(), metal), *groups)


def _folded(
    sampler: Sampler, size: tuple[float, float, float], at: tuple[float, float, float]
) -> list[Mesh]:
    """A folded towel: two or three layers with a round fold in front."""
    layers = sampler.integer(2, 3)
    each = size[2] / layers
    x, y, z = at
    parts = [
        rounded_box(
            (size[0] - 0.004 * i, size[1] - 0.006 * i, each * 1.05),
            (x, y, z + i * each),
            each * 0.49,
        )
        for i in range(layers)
    ]
    fold = rod(
        (x - size[0] / 2 + 0.008, y - size[1] / 2 + size[2] * 0.3, z + size[2] / 2),
        (x + size[0] / 2 - 0.008, y - size[1] / 2 + size[2] * 0.3, z + size[2] / 2),
        size[2] * 0.5,
        10,
    )
    return [*parts, fold]


def folded_stack(sampler: Sampler) -> Model:
    """A pile of folded or rolled towels, on a slim wall rack or by itself."""
    width, depth = sampler.size(0.28, 0.45), sampler.size(0.2, 0.3)
    same = sampler.fabric()
    groups: list[tuple[Material, list[Mesh]]] = []
    z = 0.0
    if sampler.chance(0.65):
        for _ in range(sampler.integer(2, 6)):
            tall = sampler.uniform(0.04, 0.07)
            size = (width * sampler.uniform(0.88, 1.0), depth * sampler.uniform(0.9, 1.0), tall)
            meshes = _folded(sampler, size, (sampler.uniform(-0.012, 0.012), 0, z))
            groups.append((same if sampler.chance(0.5) else sampler.fabric(), meshes))
            z += tall
    else:
        radius, base = sampler.uniform(0.045, 0.07), sampler.integer(3, 4)
        for row in range(sampler.integer(1, 3)):
            for i in range(base - row):
                x = (i - (base - row - 1) / 2) * radius * 2
                roll = (
                    cylinder(radius, depth, segments=14)
                    .rotated("x", 90)
                    .translated(x, depth / 2, radius + z)
                )
                core = (
                    torus(radius * 0.55, radius * 0.08, segments=12)
                    .rotated("x", 90)
                    .translated(x, -depth / 2, radius + z)
                )
                groups.append((same if sampler.chance(0.6) else sampler.fabric(), [roll, core]))
            z += radius * 1.75
    return stand("towel", *groups, _shelf(sampler, width + 0.1, depth + 0.04))


def _shelf(sampler: Sampler, width: float, depth: float) -> tuple[Material, list[Mesh]]:
    """What a pile lies on at the wall: a rack of bars or a board on brackets."""
    x, y = width / 2, depth / 2
    if sampler.chance(0.6):
        bars = [rod((-x, s, -0.009), (x, s, -0.009), 0.009) for s in np.linspace(-y, y, 5).tolist()]
        bars += [rod((s, -y, -0.009), (s, y + 0.01, -0.009), 0.009) for s in (-x, x)]
        return sampler.metal(), bars
    board = [box((width, depth, 0.02), (0, 0, -0.02))]
    board += [box((0.02, depth * 0.8, 0.02), (s * x * 0.7, depth * 0.1, -0.038)) for s in (-1, 1)]
    board += [box((0.02, 0.02, 0.1), (s * x * 0.7, y - 0.01, -0.118)) for s in (-1, 1)]
    return sampler.wood(), board


def on_ring(sampler: Sampler) -> Model:
    """A hand towel drawn through a ring, gathered at the top and wide below."""
    radius, drop = sampler.size(0.07, 0.11), sampler.size(0.3, 0.5)
    square = sampler.chance(0.3)
    loop = ring((2 * radius, 2 * radius), 0.0, 12.0 if square else 2.0)
    hoop = tube(loop, 0.007, 6, closed=True).rotated("x", 80).translated(0, -0.06, 0)
    metal = [
        hoop,
        rod((0, 0, radius), (0, -0.06, radius), 0.011),
        cylinder(0.03, 0.012, segments=12).rotated("x", 90).translated(0, 0.004, radius),
    ]
    wide = sampler.uniform(0.25, 0.4)
    path = _over(-0.05, -radius, (drop, drop * sampler.uniform(0.5, 0.95)), 0.02)
    cloth = _sheet(path, wide, _wave(sampler, 0.035), 0.012)
    v = cloth.vertices.copy()
    fall = np.clip((-radius + 0.02 - v[:, 2]) / drop, 0, 1)
    v[:, 0] *= (1.7 * radius / wide) + (1 - 1.7 * radius / wide) * np.sqrt(fall)
    cloth = from_faces(v, cloth.faces)
    groups = [(sampler.fabric(), [cloth])]
    return stand("towel", *groups, (sampler.metal(), metal))


def on_hook(sampler: Sampler) -> Model:
    """A towel that hangs from a peg by one point: bunched folds that widen downwards."""
    drop, wide = sampler.size(0.55, 0.95), sampler.size(0.22, 0.36)
    count, folds = 24, sampler.integer(4, 7)
    angle = np.linspace(0, 2 * np.pi, count, endpoint=False)
    phase, sharp = sampler.uniform(0, 6), sampler.uniform(0.15, 0.4)
    rings = []
    for s in (0.0, 0.15, 0.4, 0.7, 1.0):
        spread = 0.14 + 0.86 * (1 - s) ** 0.7
        ripple = 1 + sharp * np.sin(folds * angle + phase + 2 * s) * (1 - 0.6 * s)
        x = np.cos(angle) * wide / 2 * spread * ripple
        y = np.sin(angle) * wide * 0.28 * spread * ripple - 0.09
        ragged = 0.08 * (1 - s) * np.abs(np.cos(angle + phase)) * drop
        rings.append(np.stack([x + 0.03 * np.sin(3 * s), y, drop * s + ragged], axis=1))
    cloth = [skin(rings), ellipsoid((0.03, 0.035, 0.03), (0.004, -0.09, drop - 0.005), 8)]
    board: list[Mesh] = []
    hooks = [
        tube(
            [
                (0, 0, drop + 0.02),
                (0, -0.06, drop - 0.02),
                (0, -0.11, drop),
                (0, -0.12, drop + 0.04),
            ],
            0.009,
        )
    ]
    if sampler.chance(0.5):
        board = [
            rounded_box((sampler.uniform(0.12, 0.4), 0.02, 0.09), (0, 0.005, drop - 0.02), 0.008)
        ]
    else:
        hooks.append(
            cylinder(0.03, 0.012, segments=12).rotated("x", 90).translated(0, 0.006, drop + 0.02)
        )
    return stand(
        "towel", (sampler.fabric(), cloth), (sampler.metal(), hooks), (sampler.wood(), board)
    )


def on_ladder(sampler: Sampler) -> Model:
    """Towels over the rungs of a slim rack with several bars."""
    width, tall = sampler.size(0.4, 0.6), sampler.size(0.55, 0.9)
    frame = [rod((x, -0.07, 0), (x, -0.05, tall), 0.014) for x in (-width / 2, width / 2)]
    frame += [
        rod((x, 0.0, z), (x, -0.06, z), 0.01)
        for x in (-width / 2, width / 2)
        for z in (0.06, tall - 0.05)
    ]
    count = sampler.integer(3, 5)
    heights = np.linspace(tall * 0.2, tall - 0.04, count).tolist()
    frame += [rod((-width / 2, -0.06, z), (width / 2, -0.06, z), 0.01) for z in heights]
    groups: list[tuple[Material, list[Mesh]]] = []
    for z in (heights[-1], *(h for h in heights[:-1] if sampler.chance(0.35))):
        drop = min(z, tall * sampler.uniform(0.3, 0.75)) - 0.01
        path = _over(-0.06, z, (drop, drop * 0.6), 0.014)
        wide = (width - 0.04) * sampler.uniform(0.6, 1.0)
        cloth = _sheet(path, wide, _wave(sampler, 0.01), 0.01)
        groups.append((sampler.fabric(), [cloth]))
    return stand(
        "towel", *groups, (sampler.wood() if sampler.chance(0.5) else sampler.metal(), frame)
    )


DESIGNS: dict[str, tuple[ModelFactory, ...]] = {
    "towel": (over_rail, folded_stack, on_ring, on_hook, on_ladder)
}
