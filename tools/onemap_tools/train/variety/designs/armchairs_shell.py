"""Armchairs in a shell: a moulded egg, bent plywood, a bowl of cane."""

from __future__ import annotations

import numpy as np

from onemap_shared.geometry import F64
from onemap_simulator.generation.mesh import ellipsoid, rod, rounded_box, torus, tube
from onemap_simulator.generation.model import Model, assemble
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.feet import swivel_star
from onemap_tools.train.variety.designs.upholstery import (
    bent,
    other,
    puff,
    seat_area,
    settled,
    shell,
    wall,
)


def _egg(width: float, depth: float, heights: tuple[float, float, float], spread: float) -> F64:
    """Points of a scooped shell, open to the front: heights of floor, arms and head."""
    floor, arm, head = heights
    u, v = np.meshgrid(np.linspace(-1, 1, 25), np.linspace(0, 1, 9), indexing="ij")
    angle = np.pi / 2 + u * spread
    rim = arm + (head - arm) * (0.5 + 0.5 * np.cos(np.pi * np.clip(1.35 * u, -1, 1))) ** 0.8
    reach = np.sin(np.pi / 2 * np.clip(v * 1.6 + 0.02, 0, 1)) ** 0.8
    z = floor + (rim - floor) * np.clip(v * 1.15 - 0.15, 0, 1) ** 1.3
    x = width / 2 * reach * np.cos(angle)
    y = depth / 2 * reach * np.sin(angle) + 0.22 * np.clip(z - arm, 0, None)
    return np.stack([x, y, z], axis=-1)


def egg_chair(sampler: Sampler) -> Model:
    """A moulded shell that wraps round the sitter, on a swivel foot or on four thin legs."""
    width, depth = sampler.size(0.74, 0.9), sampler.size(0.68, 0.82)
    floor, head = sampler.size(0.28, 0.34), sampler.choice((0.78, 0.95, 1.1))
    arm, spread = sampler.size(0.52, 0.62), sampler.uniform(2.0, 2.5)
    grid = _egg(width, depth, (floor, arm, head), spread)
    hull, thick = shell(grid, -sampler.size(0.025, 0.05)), sampler.size(0.1, 0.14)
    cover = sampler.upholstery()
    base = ellipsoid((width * 0.36, depth * 0.36, 0.09), (0, 0, floor + 0.03), 18)
    soft = [puff((width * 0.82, depth * 0.84, thick), (0, -0.05, floor + 0.03), 2.6, 4)]
    if sampler.chance(0.5):
        rest = puff((width * 0.5, 0.1, 0.3), (0, 0, 0), 4, 3).rotated("x", -12)
        soft.append(rest.translated(0, depth * 0.36, floor + thick + 0.04))
    if sampler.chance(0.7):
        frame, foot = sampler.metal(), swivel_star(sampler, width * 0.38, floor)
    else:
        frame = sampler.metal() if sampler.chance(0.5) else sampler.wood()
        foot = [
            rod((sx * width * 0.38, sy * depth * 0.38, 0), (sx * 0.16, sy * 0.15, floor), 0.014)
            for sx in (-1, 1)
            for sy in (-1, 1)
        ]
    outside = cover if sampler.chance(0.5) else sampler.plastic()
    return settled(
        assemble(
            "armchair",
            (outside, [hull, base]),
            (other(sampler, cover, 0.8), soft),
            (frame, foot),
            support_surfaces=seat_area(width * 0.6, floor + thick + 0.03),
        )
    )


def plywood_lounge(sampler: Sampler) -> Model:
    """A lounge chair of bent plywood shells with leather pads on a low swivel star."""
    width, seat = sampler.size(0.66, 0.8), sampler.size(0.3, 0.36)
    depth, rise = sampler.size(0.52, 0.6), sampler.size(0.26, 0.34)
    tip, lean, shells = sampler.uniform(8, 16), sampler.uniform(24, 34), sampler.integer(1, 3)
    u = np.linspace(-1, 1, 9)
    wood, pads = [], []
    side_view = np.stack([0.05 * u**4 + 0.04 * np.abs(u) ** 3, u * depth / 2], axis=1)
    pan = bent(side_view[:, ::-1], 0.02, width * 0.94).translated(0, -depth / 2, 0)
    wood.append(pan.rotated("x", tip))
    cushion = puff((width * 0.86, depth * 0.96, 0.12), (0, -depth / 2, 0.012), 6, 4)
    pads.append(cushion.rotated("x", tip))
    for k in range(shells):
        tall = rise * (2.2 / shells if shells < 3 else 0.75)
        bow = -0.1 * u**2
        path = np.stack([u * width / 2, bow + 0.03], axis=1)
        z = 0.06 + k * (tall + 0.015)
        back = wall(path, z, z + tall - 0.05 * np.abs(u) ** 4, 0.02, 0.006)
        wood.append(back.rotated("x", -lean))
        pad = puff((width * 0.84, 0.13, tall * 0.96), (0, -0.06, z + 0.01), 5, 3.5)
        pads.append(pad.rotated("x", -lean))
    steel = swivel_star(sampler, 0.3, seat + 0.02)
    steel = [m.translated(0, -depth * 0.5, 0) for m in steel]
    steel += [
        rod((s * 0.1, -0.1, 0.02), (s * 0.1, 0.05 + rise * 0.4, rise), 0.012) for s in (-1, 1)
    ]
    lifted = steel[-2:]
    arms = []
    for side in (-1, 1):
        x = side * (width / 2 + 0.015)
        arms.append(rounded_box((0.08, 0.34, 0.05), (x, -0.2, 0.2), 0.024))
        lifted.append(rod((x, -0.2, -0.01), (x, -0.1, 0.21), 0.012))
        lifted.append(rod((x, -0.2, 0.0), (side * width * 0.3, -0.24, -0.03), 0.012))
    low = [m.translated(0, 0, seat) for m in (*wood, *pads, *arms, *lifted)]
    n, m = len(wood), len(wood) + len(pads) + len(arms)
    return settled(
        assemble(
            "armchair",
            (sampler.wood(), low[:n]),
            (sampler.upholstery(), low[n:m]),
            (sampler.metal(), [*steel[:-2], *low[m:]]),
            support_surfaces=seat_area(width * 0.7, seat + 0.14),
        )
    )


def papasan(sampler: Sampler) -> Model:
    """A papasan: a big round cushion in a tilted bowl of cane on a ring."""
    radius, foot = sampler.size(0.42, 0.54), sampler.size(0.2, 0.3)
    deep, tilt = sampler.size(0.26, 0.36), sampler.uniform(26, 44)
    cane = []
    for share in (1.0, 0.75, 0.45):
        ring = torus(radius * share, 0.014, (0, 0, deep * share**2), 24)
        cane.append(ring)
    for angle in np.linspace(0, 2 * np.pi, sampler.integer(8, 14), endpoint=False):
        x, y = radius * float(np.cos(angle)), radius * float(np.sin(angle))
        cane.append(tube([(x * s, y * s, deep * s**2) for s in (0.1, 0.45, 0.75, 1.0)], 0.011))
    u, v = np.meshgrid(np.linspace(0, 2 * np.pi, 25), np.linspace(0.03, 1, 7), indexing="ij")
    reach = radius * 1.02 * v
    tufts = 0.02 * np.cos(8 * u) * v * (1 - v) * 4
    grid = np.stack([reach * np.cos(u), reach * np.sin(u), deep * v**2 + 0.02 + tufts], axis=-1)
    cushion = shell(grid, -0.09)
    if cushion.vertices[:, 2].max() < deep + 0.06:
        cushion = shell(grid, 0.09)
    puffs = [ellipsoid((radius * 0.3, radius * 0.3, 0.04), (0, 0, 0.11), 14)]
    tipped = [m.rotated("x", tilt) for m in (*cane, cushion, *puffs)]
    low = min(float(m.vertices[:, 2].min()) for m in tipped)
    lift = foot - low - 0.03
    tipped = [m.translated(0, 0, lift) for m in tipped]
    stand = [torus(radius * 0.62, 0.015, (0, 0, 0.015), 22)]
    stand.append(torus(radius * 0.5, 0.015, (0, 0, foot + 0.01), 22))
    for angle in np.linspace(0, 2 * np.pi, 6, endpoint=False):
        c, s = float(np.cos(angle)) * radius, float(np.sin(angle)) * radius
        stand.append(rod((c * 0.62, s * 0.62, 0.01), (c * 0.5, s * 0.5, foot + 0.01), 0.012))
    count = len(cane)
    return settled(
        assemble(
            "armchair",
            (sampler.wood(), [*tipped[:count], *stand]),
            (sampler.fabric(), tipped[count:]),
            support_surfaces=seat_area(radius, foot + 0.15),
        )
    )


DESIGNS: dict[str, tuple[ModelFactory, ...]] = {
    "armchair": (
        egg_chair,
        plywood_lounge,
        papasan,
    ),
}
