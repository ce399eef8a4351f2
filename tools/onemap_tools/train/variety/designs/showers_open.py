"""Showers without a door: a walk-in screen, a curtain, a bare column."""

from __future__ import annotations

import numpy as np

from onemap_shared.geometry import F64
from onemap_simulator.generation.mesh import Mesh, box, cylinder, rod, rounded_box, tube
from onemap_simulator.generation.model import Model
from onemap_simulator.generation.sampler import Sampler
from onemap_tools.train.variety.designs.sanitary import Group, shower_set, skin, stand
from onemap_tools.train.variety.designs.shower_parts import (
    clad_walls,
    clear_glass,
    flat_tray,
    floor_drain,
    glass_pane,
    wall_tiles,
)


def walk_in(sampler: Sampler) -> Model:
    """A low wide tray with one fixed sheet of glass, held by a bar to the wall."""
    width, deep, tray_h = sampler.size(1.0, 1.5), sampler.size(0.8, 1.0), sampler.size(0.03, 0.07)
    top = sampler.size(1.9, 2.1)
    share = sampler.uniform(0.45, 0.8)
    x, y = width / 2, deep / 2
    metal: list[Mesh] = []
    if sampler.chance(0.5):
        panes = [glass_pane((-x + 0.02, -y + 0.02), (-x + width * share, -y + 0.02), tray_h, top)]
        end = (-x + width * share - 0.02, -y + 0.02)
        metal.append(box((0.03, 0.03, top - tray_h), (-x + 0.02, -y + 0.02, tray_h)))
    else:
        panes = [glass_pane((x - 0.02, -y + 0.02), (x - 0.02, y), tray_h, top)]
        end = (x - 0.02, -y + 0.06)
        metal.append(box((0.03, 0.03, top - tray_h), (x - 0.02, y - 0.015, tray_h)))
    metal.append(rod((*end, top - 0.01), (end[0] * 0.6, y, top - 0.01), 0.011))
    if sampler.chance(0.4):
        lines = [box((0.012, 0.016, top - tray_h), (p[0], p[1], tray_h)) for p in (end,)]
        metal += lines
    pipes = shower_set(sampler, (-x * 0.2, y, 1.05), sampler.uniform(1.85, 2.05))
    grate = box((width * 0.5, 0.06, 0.008), (0, y - 0.12, tray_h * 0.4 + 0.002))
    bench = [
        box((0.35, 0.3, 0.04), (-x + 0.2, y - 0.17, 0.42)),
        box((0.3, 0.26, 0.4), (-x + 0.2, y - 0.17, 0.02)),
    ]
    return stand(
        "shower",
        (sampler.ceramic(), [flat_tray((width, deep), tray_h)]),
        (wall_tiles(sampler), clad_walls(sampler, (width, deep), top + 0.05)),
        (clear_glass(sampler), panes),
        (sampler.metal(), [*metal, *pipes, grate]),
        (sampler.wood(), bench if sampler.chance(0.3) else []),
    )


def _curtain(sampler: Sampler, path: F64, low: float, top: float) -> Mesh:
    """A sheet in folds along a path (N, 2) of the floor, with a thickness of a centimetre."""
    count = 60
    s = np.linspace(0, len(path) - 1, count)
    base = np.stack([np.interp(s, np.arange(len(path)), path[:, i]) for i in (0, 1)], axis=1)
    along = np.gradient(base, axis=0)
    normal = np.stack([-along[:, 1], along[:, 0]], axis=1)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-9)
    wave = sampler.uniform(0.02, 0.035) * np.sin(s / s[-1] * np.pi * sampler.integer(12, 24))
    middle = base + normal * wave[:, None]
    outline = np.concatenate([middle + normal * 0.005, (middle - normal * 0.005)[::-1]])
    rings = [np.concatenate([outline, np.full((2 * count, 1), z)], axis=1) for z in (low, top)]
    return skin(rings, capped=False)


def curtained(sampler: Sampler) -> Model:
    """A tray with a curtain in folds on a rail around it, drawn or pushed aside."""
    width, deep, tray_h = sampler.size(0.8, 1.1), sampler.size(0.78, 0.95), sampler.size(0.06, 0.22)
    top = sampler.size(1.9, 2.05)
    x, y = width / 2 - 0.03, deep / 2 - 0.03
    corner = np.array([(x * 0.75, -y), (x * 0.93, -y * 0.93), (x, -y * 0.75)])
    if sampler.chance(0.5):
        rail = np.concatenate([[(-x, -y), (0, -y)], corner, [(x, 0.0), (x, y + 0.03)]])
    else:
        rail = np.array([(-x, -y), (-x / 2, -y), (0, -y), (x / 2, -y), (x, -y)])
    path = [(float(p[0]), float(p[1]), top + 0.03) for p in rail]
    drawn = sampler.uniform(0.35, 1.0)
    spans = np.linspace(0, (len(rail) - 1) * drawn, 12)
    part = np.stack([np.interp(spans, np.arange(len(rail)), rail[:, i]) for i in (0, 1)], axis=1)
    low = tray_h + sampler.uniform(-0.02, 0.1)
    cloth = _curtain(sampler, part, low, top)
    rings = [
        rod(
            (float(p[0]), float(p[1]), top - 0.02),
            (float(p[0]), float(p[1]), top + 0.045),
            0.006,
            5,
        )
        for p in part[1:-1]
    ]
    walls = clad_walls(sampler, (width, deep), top + 0.1)
    metal = [tube(path, 0.013), *rings]
    if len(walls) == 1:
        metal.append(
            tube(
                [(-x, -y, top + 0.03), (-x, -y + 0.05, top + 0.03), (-x, y + 0.03, top + 0.03)],
                0.013,
            )
        )
    pipes = shower_set(sampler, (-width * 0.1, deep / 2, 1.0), sampler.uniform(1.8, 1.95))
    return stand(
        "shower",
        (sampler.ceramic(), [flat_tray((width, deep), tray_h)]),
        (wall_tiles(sampler), walls),
        (sampler.fabric(), [cloth]),
        (sampler.metal(), [*metal, *pipes]),
    )


def column(sampler: Sampler) -> Model:
    """A shower panel with jets, a shelf and a hand shower over an open tray."""
    width, deep, tray_h = (
        sampler.size(0.75, 1.0),
        sampler.size(0.75, 0.95),
        sampler.size(0.03, 0.12),
    )
    top, y = sampler.size(1.85, 2.1), deep / 2
    slim = sampler.uniform(0.14, 0.24)
    panel = [rounded_box((slim, 0.05, top - 0.75), (0, y - 0.027, 0.7), 0.015)]
    neck = sampler.uniform(0.3, 0.42)
    panel.append(rounded_box((slim * 0.9, neck, 0.03), (0, y - neck / 2, top - 0.09), 0.012))
    jets: list[Mesh] = []
    for i in range(sampler.integer(2, 4)):
        for sx in (-1, 1):
            disc = cylinder(0.022, 0.012, segments=10).rotated("x", 90)
            jets.append(disc.translated(sx * slim * 0.27, y - 0.05, 1.25 + i * 0.14))
    for i in range(sampler.integer(1, 3)):
        knob = cylinder(0.03, 0.04, segments=12).rotated("x", 90)
        jets.append(knob.translated(0, y - 0.05, 0.95 + i * 0.1))
    rose = cylinder(0.1, 0.02, (0, y - neck + 0.08, top - 0.11), 16)
    hand = [(slim / 2 + 0.03, y - 0.08, 1.15), (slim / 2 + 0.03, y - 0.13, 1.38)]
    jets += [
        rod(hand[0], hand[1], 0.015),
        cylinder(0.045, 0.025, (hand[1][0], y - 0.14, 1.37), 12),
        rose,
    ]
    jets.append(box((slim / 2 + 0.05, 0.03, 0.03), (slim / 4, y - 0.065, 1.22)))
    jets.append(
        tube(
            [(0, y - 0.05, 0.8), (0.1, y - 0.13, 0.55), (slim / 2 + 0.06, y - 0.1, 0.7), hand[0]],
            0.008,
        )
    )
    groups: list[Group] = []
    if sampler.chance(0.5):
        x = width / 2 - 0.02
        groups.append((clear_glass(sampler), [glass_pane((x, -y * 0.2), (x, y), tray_h, 1.9)]))
    return stand(
        "shower",
        (sampler.ceramic(), [flat_tray((width, deep), tray_h)]),
        (wall_tiles(sampler), clad_walls(sampler, (width, deep), top + 0.08)),
        (sampler.metal() if sampler.chance(0.5) else sampler.dark(), panel),
        (sampler.metal(), [*jets, floor_drain((0, 0, tray_h * 0.4 + 0.002))]),
        *groups,
    )
