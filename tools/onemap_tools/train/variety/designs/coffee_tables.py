"""Coffee tables on legs, built in ways of their own."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import (
    Mesh,
    box,
    cone,
    cylinder,
    ellipsoid,
    prism,
    rod,
    torus,
)
from onemap_simulator.generation.model import Model, assemble, support_surface
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.woodwork import (
    SIDES,
    board,
    centred,
    corners,
    frame,
    lean,
    oval,
    racetrack,
    slab,
    stretch,
)


def nesting(sampler: Sampler) -> Model:
    """Two or three small tables of falling height that slide under each other."""
    count, round_top = sampler.integer(2, 3), sampler.chance(0.5)
    size, height = sampler.size(0.45, 0.65), sampler.size(0.42, 0.5)
    step, pull = sampler.uniform(0.06, 0.09), sampler.uniform(0.25, 0.5)
    tops: list[Mesh] = []
    legs: list[Mesh] = []
    post, solid = sampler.uniform(0.008, 0.016), sampler.chance(0.3)
    for index in range(count):
        shrink = 1 - 0.16 * index
        wide, deep = size * shrink, size * shrink * (1.0 if round_top else 0.8)
        high, x, y = height - step * index, index * size * pull, -index * size * pull * 0.35
        outline = oval(wide, deep) if round_top else racetrack(wide, deep, 0.02)
        tops.append(slab(outline, 0.022, high - 0.022).translated(x, y))
        if solid:
            legs += [
                box((0.02, deep * 0.7, high - 0.022), (x + s * wide * 0.36, y, 0)) for s in SIDES
            ]
            continue
        reach = 0.66 if round_top else 0.94
        for px, py in corners(wide * reach, deep * reach, post):
            legs.append(cylinder(post, high - 0.022, (x + px, y + py, 0), 8))
        for s in SIDES:
            at_y = y + s * (deep * reach / 2 - post)
            ends = (wide * reach / 2 - post, at_y, 0.02)
            legs.append(rod((x - ends[0], at_y, 0.02), (x + ends[0], at_y, 0.02), post * 0.8))
    surface = support_surface(size * 0.68, size * (0.68 if round_top else 0.8), height)
    return centred(
        assemble(
            "coffee table",
            (board(sampler), tops),
            (frame(sampler), legs),
            support_surfaces=(surface,),
        )
    )


def hairpin(sampler: Sampler) -> Model:
    """A plank, oval or raw-edged top on bent wire legs of two or three rods."""
    width, depth, height = (
        sampler.size(0.75, 1.25),
        sampler.size(0.42, 0.65),
        sampler.size(0.36, 0.46),
    )
    thick, wires = sampler.uniform(0.02, 0.05), sampler.integer(2, 3)
    power = sampler.choice([2.2, 4.0, 30.0])
    below = height - thick
    top = slab(oval(width, depth, power, 32), thick, below, sampler.choice([0.0, 0.015]))
    reach = 0.68 if power < 3 else 0.86
    wire: list[Mesh] = []
    for x, y in corners(width * reach, depth * reach, 0.03):
        sx, sy = float(np.sign(x)), float(np.sign(y))
        spread = [(0.06, 0.0), (0.0, 0.06), (0.05, 0.05)][:wires]
        foot = (x + sx * 0.02, y + sy * 0.02)
        for dx, dy in spread:
            start = cylinder(0.006, below, segments=6)
            wire.append(lean(start, -sx * dx * 1.3, -sy * dy * 1.3).translated(*foot))
        wire.append(ellipsoid((0.014, 0.014, 0.012), (*foot, 0.012), 8))
        wire.append(box((0.1, 0.1, 0.006), (x - sx * 0.02, y - sy * 0.02, below - 0.006)))
    surface = support_surface(width * reach, depth * reach, height)
    return assemble(
        "coffee table",
        (sampler.wood(), [top]),
        (sampler.metal(), wire),
        support_surfaces=(surface,),
    )


def three_legs(sampler: Sampler) -> Model:
    """A round top, flat, dished or with a raised rim, on three stout or splayed legs."""
    radius, height = sampler.size(0.3, 0.5), sampler.size(0.34, 0.48)
    thick, kind = sampler.uniform(0.02, 0.06), sampler.integer(0, 2)
    below = height - thick
    top = [cylinder(radius, thick, (0, 0, below), 26)]
    if sampler.chance(0.4):
        top.append(torus(radius - 0.008, 0.014, (0, 0, height), 26))
    legs: list[Mesh] = []
    for degrees in (90, 210, 330):
        angle = np.radians(degrees)
        c, s = float(np.cos(angle)), float(np.sin(angle))
        at = radius * (0.75 if kind == 0 else 0.95)
        if kind == 0:
            stout = sampler.uniform(0.05, 0.05 + radius * 0.18)
            legs.append(cylinder(min(stout, 0.1), below, (c * radius * 0.66, s * radius * 0.66, 0)))
        elif kind == 1:
            shaft = lean(cone((0.013, 0.026), below), -c * at * 0.35, -s * at * 0.35)
            legs.append(shaft.translated(c * at, s * at))
        else:
            plank = box((radius * 0.75, 0.03, below), (radius * 0.42, 0, 0))
            legs.append(plank.rotated("z", degrees))
    if kind == 1 and sampler.chance(0.5):
        legs.append(torus(radius * 0.78, 0.009, (0, 0, below * 0.45), 18))
    surface = support_surface(radius * 1.3, radius * 1.3, height)
    return centred(
        assemble(
            "coffee table",
            (board(sampler), top),
            (frame(sampler), legs),
            support_surfaces=(surface,),
        )
    )


def kidney(sampler: Sampler) -> Model:
    """A kidney, pebble or boomerang top of the 1950s on thin splayed legs."""
    width, depth, height = sampler.size(0.8, 1.2), sampler.size(0.5, 0.7), sampler.size(0.36, 0.46)
    thick, bite = sampler.uniform(0.018, 0.035), sampler.uniform(0.15, 0.45)
    lobe, phase = sampler.uniform(-0.12, 0.12), sampler.uniform(0, 6.28)
    angle = np.linspace(0, 2 * np.pi, 36, endpoint=False)
    dent = np.exp(-(((angle - 1.5 * np.pi) / 0.6) ** 2))
    reach = 1 - bite * dent + lobe * np.cos(3 * angle + phase)
    outline = np.stack(
        [np.cos(angle) * reach * width / 2, np.sin(angle) * reach * depth / 2], axis=1
    )
    below = height - thick
    tops = [prism(outline, thick, (0, 0, below))]
    lower = []
    if sampler.chance(0.3):
        lower = [prism(outline * 0.6, 0.016, (0, 0, below * 0.4))]
    legs: list[Mesh] = []
    count = sampler.integer(3, 4)
    for place in np.linspace(0.5, 0.5 + 2 * np.pi, count, endpoint=False).tolist():
        radial = 0.62 * float(np.interp(place % (2 * np.pi), angle, reach))
        x, y = float(np.cos(place)) * radial * width / 2, float(np.sin(place)) * radial * depth / 2
        shaft = lean(cone((0.01, 0.02), below), -0.16 * x, -0.16 * y)
        legs.append(shaft.translated(x * 1.1, y * 1.1))
    surface = support_surface(width * 0.5, depth * 0.45, height)
    return centred(
        assemble(
            "coffee table",
            (board(sampler), tops),
            (board(sampler), lower),
            (frame(sampler), legs),
            support_surfaces=(surface,),
        )
    )


def butler_tray(sampler: Sampler) -> Model:
    """A tray with raised edges and grips on a crossing folding stand."""
    width, depth, height = (
        sampler.size(0.6, 0.9),
        sampler.size(0.42, 0.58),
        sampler.size(0.42, 0.52),
    )
    rim, thick = sampler.uniform(0.03, 0.07), 0.014
    floor = height - 0.02
    tray = [box((width, depth, thick), (0, 0, floor))]
    tray += [box((width + 0.02, 0.014, rim), (0, s * depth / 2, floor - 0.004)) for s in SIDES]
    tray += [box((0.014, depth, rim), (s * width / 2, 0, floor - 0.002)) for s in SIDES]
    grip = [
        box((0.02, 0.12, 0.02), (s * (width / 2 + 0.012), 0, floor + rim - 0.024)) for s in SIDES
    ]
    stand: list[Mesh] = []
    y = depth / 2 - 0.05
    for s in SIDES:
        for e in SIDES:
            section = (0.028 + 0.003 * e, 0.02 + 0.003 * e)
            start, end = (
                (e * width * 0.4, s * y, 0.0),
                (-e * width * 0.38, s * (y - 0.026 * (e > 0))),
            )
            stand.append(stretch(section, start, end, floor))
    for e in SIDES:
        stand.append(rod((e * width * 0.36, -y, 0.05), (e * width * 0.36, y, 0.05), 0.009))
        stand.append(
            rod((e * width * 0.37, -y, floor - 0.02), (e * width * 0.37, y, floor - 0.02), 0.011)
        )
    surface = support_surface(width, depth, floor + thick)
    return assemble(
        "coffee table",
        (board(sampler), tray),
        (sampler.metal(), grip),
        (frame(sampler), stand),
        support_surfaces=(surface,),
    )


DESIGNS: dict[str, tuple[ModelFactory, ...]] = {
    "coffee table": (
        nesting,
        hairpin,
        three_legs,
        kidney,
        butler_tray,
    )
}
