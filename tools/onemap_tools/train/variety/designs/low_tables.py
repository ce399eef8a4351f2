"""Coffee tables with a body: drums, blocks, trunks, drawers, shelves."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import (
    Mesh,
    box,
    cone,
    cylinder,
    lathe,
    rod,
    rounded_box,
    torus,
    tube,
)
from onemap_simulator.generation.model import Model, assemble, support_surface
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.fronts import drawer, pulls
from onemap_tools.train.variety.designs.woodwork import (
    SIDES,
    board,
    centred,
    corners,
    frame,
    oval,
    racetrack,
    slab,
)


def drum(sampler: Sampler) -> Model:
    """A round drum: plain, waisted, ribbed all around or a cage of bars."""
    radius, height = sampler.size(0.3, 0.5), sampler.size(0.3, 0.46)
    thick, kind = sampler.uniform(0.015, 0.04), sampler.integer(0, 2)
    below = height - thick
    top = [cylinder(radius, thick, (0, 0, below), 24)]
    body: list[Mesh] = []
    trim: list[Mesh] = []
    if kind == 0:
        waist = radius * sampler.uniform(0.6, 1.08)
        profile = [(radius * 0.96, 0.0)]
        profile += [
            (radius * 0.96 + (waist - radius) * float(np.sin(np.pi * t)), below * float(t))
            for t in np.linspace(0.1, 0.9, 7)
        ]
        body = [lathe([*profile, (radius * 0.96, below)], segments=24)]
        trim = [torus(radius * 0.97, 0.01, (0, 0, z)) for z in (0.02, below - 0.02)]
    else:
        count = sampler.integer(20, 36) if kind == 1 else sampler.integer(8, 18)
        thin = np.pi * radius / count * (0.85 if kind == 1 else 0.3)
        if kind == 1:
            body = [cylinder(radius * 0.9, below, segments=24)]
        else:
            trim = [torus(radius * 0.95, 0.012, (0, 0, z)) for z in (0.012, below - 0.012)]
        for angle in np.linspace(0, 2 * np.pi, count, endpoint=False).tolist():
            at = (radius * 0.93 * float(np.cos(angle)), radius * 0.93 * float(np.sin(angle)), 0.0)
            body.append(cylinder(max(float(thin), 0.006), below, at, 6))
    surface = support_surface(radius * 1.35, radius * 1.35, height)
    return assemble(
        "coffee table",
        (board(sampler), top),
        (frame(sampler), body),
        (sampler.metal(), trim),
        support_surfaces=(surface,),
    )


def cubes(sampler: Sampler) -> Model:
    """A massive low slab on a set-back plinth, two blocks, or a board bent down at both ends."""
    kind, soft = sampler.integer(0, 2), sampler.choice([0.003, 0.015, 0.04])
    width, depth, height = sampler.size(0.8, 1.2), sampler.size(0.5, 0.8), sampler.size(0.26, 0.42)
    first: list[Mesh] = []
    second: list[Mesh] = []
    if kind == 0:
        plinth, thick = sampler.uniform(0.03, 0.12), sampler.uniform(0.05, 0.1)
        first = [rounded_box((width, depth, thick), (0, 0, height - thick), soft)]
        rest = height - thick - plinth
        if sampler.chance(0.5):
            first.append(rounded_box((width - 0.02, depth - 0.02, rest), (0, 0, plinth), soft))
            second = [box((width - 0.16, depth - 0.16, plinth + 0.01))]
        else:
            second = [box((width * 0.7, depth * 0.7, height - thick + 0.005))]
    elif kind == 1:
        side = width * sampler.uniform(0.45, 0.6)
        drop = sampler.uniform(0.06, 0.14)
        first = [rounded_box((side, depth, height), (-width / 2 + side / 2, 0, 0), soft)]
        size = (width - side * 0.9, depth * 0.85, height - drop)
        second = [rounded_box(size, (width / 2 - size[0] / 2 + side * 0.11, 0.0, 0), soft)]
    else:
        thick = sampler.uniform(0.03, 0.08)
        first = [box((width, depth, thick), (0, 0, height - thick))]
        first += [
            box((thick, depth, height - thick), (s * (width - thick) / 2, 0, 0)) for s in SIDES
        ]
        if sampler.chance(0.6):
            second = [box((width - 2 * thick, depth - 0.05, 0.022), (0, 0, height * 0.3))]
    surface = support_surface(width, depth, height)
    if kind == 1:
        surface = surface._replace(x_max=-width / 2 + side - 0.04)
    return centred(
        assemble(
            "coffee table",
            (board(sampler), first),
            (board(sampler), second),
            support_surfaces=(surface,),
        )
    )


def trunk(sampler: Sampler) -> Model:
    """A travelling trunk used as a table: straps, corner irons, a lock, side handles."""
    width, depth, height = (
        sampler.size(0.75, 1.1),
        sampler.size(0.45, 0.6),
        sampler.size(0.36, 0.46),
    )
    foot, lid = sampler.choice([0.0, 0.03, 0.08]), sampler.uniform(0.07, 0.12)
    chest = [box((width, depth, height - foot - lid - 0.006), (0, 0, foot))]
    chest.append(box((width + 0.012, depth + 0.012, lid), (0, 0, height - lid)))
    chest.append(box((width - 0.03, depth - 0.03, 0.03), (0, 0, height - lid - 0.015)))
    if foot:
        chest += [cylinder(0.03, foot, (*at, 0)) for at in corners(width, depth, 0.06)]
    straps: list[Mesh] = []
    for index in range(sampler.integer(2, 3)):
        x = [-0.3, 0.3, 0.0][index] * width
        for y in (-depth / 2 - 0.006, depth / 2 + 0.006):
            straps.append(box((0.045, 0.012, height - foot - 0.01), (x, y, foot + 0.004)))
    irons: list[Mesh] = []
    for x, y in corners(width + 0.016, depth + 0.016, 0.02):
        for z in (foot - min(foot, 0.002), height - 0.052):
            irons.append(box((0.052, 0.052, 0.05), (x, y, z)))
    irons.append(box((0.07, 0.02, 0.1), (0, -depth / 2 - 0.012, height - lid - 0.06)))
    grip = np.linspace(0, np.pi, 8)
    for s in SIDES:
        path = np.column_stack(
            [s * (width / 2 + 0.04 * np.sin(grip)), np.cos(grip) * 0.07, np.full(8, height * 0.5)]
        )
        irons.append(tube(path, 0.009))
    surface = support_surface(width, depth, height)
    return assemble(
        "coffee table",
        (sampler.wood(), chest),
        (sampler.material("leather", 0.3, sampler.colour()), straps),
        (sampler.metal(), irons),
        support_surfaces=(surface,),
    )


def with_drawers(sampler: Sampler) -> Model:
    """A low table with drawers or open pigeonholes under the top, on legs or a plinth."""
    width, depth, height = (
        sampler.size(0.85, 1.2),
        sampler.size(0.5, 0.65),
        sampler.size(0.38, 0.48),
    )
    leg, thick = sampler.choice([0.04, 0.12, 0.2]), sampler.uniform(0.018, 0.04)
    count, front, inner = sampler.integer(1, 3), -depth / 2 + 0.04, height - leg - thick
    wood = [rounded_box((width, depth, thick), (0, 0, height - thick), 0.008)]
    wide, deep = width - 0.06, depth - 0.08
    wood.append(box((wide, deep, 0.018), (0, 0, leg)))
    each = wide / (count + 1)
    holes = sampler.integer(0, count)
    wood += [
        box(
            (0.018, deep - 0.002, inner),
            (-wide / 2 + 0.009 + i * (wide - 0.018) / (count + 1), 0, leg),
        )
        for i in range(count + 2)
    ]
    fronts: list[Mesh] = []
    knobs: list[Mesh] = []
    kind = sampler.choice(["knob", "cup", "bar", "ring", "strap"])
    for index in range(count + 1):
        if index == holes:
            continue
        x = (index - count / 2) * (wide - 0.018) / (count + 1)
        size = (each - 0.026, inner - 0.026)
        fronts += drawer(size, (x, front, leg + 0.022))
        fronts.append(box((size[0] - 0.01, deep - 0.03, size[1] - 0.01), (x, 0, leg + 0.024)))
        knobs += pulls(kind, (x, front - 0.02, leg + 0.02 + size[1] / 2), size[0], size[1])
    legs = [cone((0.018, 0.028), leg, (*at, 0)) for at in corners(wide, deep, 0.04)]
    surface = support_surface(width, depth, height)
    return assemble(
        "coffee table",
        (sampler.wood(), wood),
        (sampler.wood(), fronts),
        (sampler.metal(), knobs),
        (frame(sampler), legs),
        support_surfaces=(surface,),
    )


def glass_with_shelf(sampler: Sampler) -> Model:
    """A glass sheet over a lower shelf, held by corner posts or bent side loops."""
    width, depth, height = (
        sampler.size(0.8, 1.25),
        sampler.size(0.45, 0.7),
        sampler.size(0.38, 0.48),
    )
    thick, low = sampler.uniform(0.01, 0.016), sampler.uniform(0.08, 0.18)
    under = height - thick
    power = sampler.choice([2.0, 6.0, 20.0])
    top = [slab(oval(width, depth, power, 32), thick, under)]
    reach = 0.68 if power < 3 else 0.94
    wide, deep = width * reach, depth * reach
    lower = [slab(racetrack(wide - 0.04, deep - 0.04, 0.03), 0.016, low)]
    metal: list[Mesh] = []
    radius = sampler.uniform(0.012, 0.022)
    for x, y in corners(wide, deep, radius + 0.01):
        metal.append(cylinder(radius, under - 0.001, (x, y, 0)))
        metal.append(cylinder(radius * 1.5, 0.012, (x, y, under - 0.013)))
        metal.append(cylinder(radius * 1.4, 0.022, (x, y, low - 0.003)))
    for s in SIDES:
        y = s * (deep / 2 - radius - 0.01)
        metal.append(
            rod((-wide / 2 + 0.03, y, low - 0.006), (wide / 2 - 0.03, y, low - 0.006), 0.008)
        )
    surface = support_surface(width * reach, depth * reach, height)
    return assemble(
        "coffee table",
        (sampler.pale(), top),
        (board(sampler), lower),
        (sampler.metal(), metal),
        support_surfaces=(surface,),
    )


DESIGNS: dict[str, tuple[ModelFactory, ...]] = {
    "coffee table": (
        drum,
        cubes,
        trunk,
        with_drawers,
        glass_with_shelf,
    )
}
