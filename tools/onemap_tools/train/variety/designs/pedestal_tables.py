"""Tables on pedestals, columns and metal frames."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import (
    Mesh,
    box,
    cone,
    cylinder,
    lathe,
    rod,
    torus,
    tube,
)
from onemap_simulator.generation.model import Model, assemble, support_surface
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.woodwork import (
    SIDES,
    board,
    claw,
    corners,
    frame,
    lean,
    oval,
    racetrack,
    slab,
    turned,
)


def pedestal(sampler: Sampler) -> Model:
    """A round or square-ish top on one turned column with claws, a cross or a plate."""
    radius, height = sampler.size(0.4, 0.65), sampler.size(0.71, 0.77)
    thick, kind = sampler.uniform(0.02, 0.05), sampler.integer(0, 2)
    below = height - thick
    power = sampler.choice([2.0, 2.0, 3.0, 8.0])
    top = [slab(oval(radius * 2, radius * 2, power), thick, below, sampler.choice([0.0, 0.02]))]
    if sampler.chance(0.5):
        top.append(slab(oval(radius * 1.7, radius * 1.7, power), 0.06, below - 0.058))
    foot: list[Mesh] = []
    stout, start = sampler.uniform(0.04, 0.11), 0.04
    if kind == 0:
        count = sampler.integer(3, 5)
        for index in range(count):
            foot += claw(
                radius * 0.75, sampler.uniform(0.22, 0.26), 0.028, index * 360 / count + 45
            )
        start = 0.1
    elif kind == 1:
        bar = (radius * 1.4, 0.08, 0.06)
        foot = [box(bar), box((bar[0], bar[1], 0.055)).rotated("z", 90)]
        foot += [box((0.09, 0.1, 0.09), (s * bar[0] / 2, 0, 0)) for s in SIDES]
        foot += [box((0.1, 0.09, 0.09), (0, s * bar[0] / 2, 0)) for s in SIDES]
    else:
        foot = [slab(oval(radius * 1.1, radius * 1.1, power), 0.03, 0.0)]
    plain = sampler.chance(0.4)
    shaft = cylinder(stout * 0.7, below - start) if plain else turned(sampler, stout, below - start)
    column = [
        shaft.translated(0, 0, start),
        cone((stout, radius * 0.45), 0.07, (0, 0, below - 0.072)),
    ]
    surface = support_surface(radius * 1.35, radius * 1.35, height)
    return assemble(
        "table", (board(sampler), top), (frame(sampler), foot + column), support_surfaces=(surface,)
    )


def tulip(sampler: Sampler) -> Model:
    """A thin bevelled round or oval top on one trumpet-shaped foot."""
    depth, height = sampler.size(0.8, 1.2), sampler.size(0.71, 0.75)
    width = depth * (sampler.uniform(1.25, 1.7) if sampler.chance(0.4) else 1.0)
    thick, waist = sampler.uniform(0.02, 0.04), sampler.uniform(0.025, 0.06)
    foot, head = depth * sampler.uniform(0.25, 0.34), depth * sampler.uniform(0.1, 0.26)
    narrow, below = sampler.uniform(0.35, 0.65), height - thick
    profile = [(foot, 0.0), (foot, 0.012)]
    for share in np.linspace(0.08, 1.0, 12).tolist():
        low, high = (
            max(0.0, 1 - share / narrow) ** 3,
            max(0.0, (share - narrow) / (1 - narrow)) ** 3,
        )
        profile.append((waist + (foot - waist) * low + (head - waist) * high, share * below))
    stem = lathe(profile, segments=20).scaled(min(width / depth, 1.3), 1.0, 1.0)
    top = slab(oval(width, depth, count=32), thick, below, sampler.uniform(0.01, 0.05))
    surface = support_surface(width * 0.68, depth * 0.68, height)
    return assemble(
        "table", (board(sampler), [top]), (sampler.enamel(), [stem]), support_surfaces=(surface,)
    )


def two_columns(sampler: Sampler) -> Model:
    """A long oval, boat-shaped or straight top on two barrels, columns or thick slabs."""
    width, depth, height = sampler.size(1.4, 2.1), sampler.size(0.8, 1.05), sampler.size(0.72, 0.77)
    thick, kind = sampler.uniform(0.03, 0.06), sampler.integer(0, 2)
    below, at = height - thick, width * sampler.uniform(0.2, 0.28)
    outline = sampler.choice(
        [oval(width, depth, 2.3, 32), oval(width, depth, 4.0, 32), racetrack(width, depth, 0.3)]
    )
    top = [slab(outline, thick, below, sampler.choice([0.0, 0.02, 0.04]))]
    posts: list[Mesh] = []
    wide = depth * sampler.uniform(0.22, 0.32)
    for s in SIDES:
        if kind == 0:
            waist = wide * sampler.choice([0.6, 1.0])
            profile = [(wide, 0.0), (waist, below * 0.45), (waist, below * 0.55), (wide, below)]
            posts.append(lathe(profile, (s * at, 0, 0), 18))
        elif kind == 1:
            posts.append(turned(sampler, 0.075, below - 0.06).translated(s * at, 0, 0.06))
            posts += [
                m.translated(s * at, 0)
                for a in (-55, 55, 125, 235)
                for m in claw(wide, 0.2, 0.026, a)
            ]
        else:
            posts.append(
                slab(racetrack(0.12, depth * 0.66, 0.06), below, 0.0).translated(s * at, 0)
            )
    if sampler.chance(0.5):
        posts.append(box((2 * at, 0.04, 0.08), (0, 0, below * 0.28)))
    surface = support_surface(width * 0.72, depth * 0.7, height)
    return assemble(
        "table", (board(sampler), top), (board(sampler), posts), support_surfaces=(surface,)
    )


def glass_on_metal(sampler: Sampler) -> Model:
    """A thin glass sheet on a metal frame: box frame, sled loops or crossing tubes."""
    width, depth, height = sampler.size(1.0, 1.7), sampler.size(0.7, 0.95), sampler.size(0.71, 0.76)
    thick, radius, kind = (
        sampler.uniform(0.01, 0.018),
        sampler.uniform(0.014, 0.026),
        sampler.integer(0, 2),
    )
    under = height - thick - 0.006
    top = slab(racetrack(width, depth, sampler.choice([0.01, 0.08, 0.3])), thick, height - thick)
    x, y = width / 2 - sampler.uniform(0.06, 0.25), depth / 2 - 0.07
    metal: list[Mesh] = []
    if kind == 0:
        metal = [box((radius * 2, radius * 2, under), (*at, 0)) for at in corners(2 * x, 2 * y)]
        for z in (under - 2 * radius, *([0.06] if sampler.chance(0.4) else [])):
            metal += [box((2 * x, radius * 1.8, radius * 1.8), (0, s * y, z)) for s in SIDES]
            metal += [box((radius * 1.8, 2 * y, radius * 1.8), (s * x, 0, z)) for s in SIDES]
    elif kind == 1:
        loop = racetrack(2 * y, under, 0.1)
        for s in SIDES:
            path = np.column_stack([np.full(len(loop), s * x), loop[:, 0], loop[:, 1] + under / 2])
            path[:, 2] = radius + (under - 2 * radius) * path[:, 2] / under
            metal.append(tube(path, radius, 8, closed=True))
        metal.append(rod((-x, 0, under - radius), (x, 0, under - radius), radius))
    else:
        x = min(x, 0.5)
        for i, (cx, cy) in enumerate(corners(2 * x, 2 * y)):
            metal.append(
                lean(cylinder(radius, under), -cx * 1.5, -cy * (1.5 + 0.02 * i)).translated(cx, cy)
            )
        metal.append(torus(0.06, radius * 0.8, (0, 0, under * 0.66)))
    pads = [cylinder(0.03, 0.008, (px, py, under - 0.001)) for px, py in corners(2 * x, 2 * y)]
    surface = support_surface(width, depth, height)
    return assemble(
        "table",
        (board(sampler), [top]),
        (sampler.metal(), metal),
        (sampler.dark(), pads),
        support_surfaces=(surface,),
    )


DESIGNS: dict[str, tuple[ModelFactory, ...]] = {
    "table": (
        pedestal,
        tulip,
        two_columns,
        glass_on_metal,
    )
}
