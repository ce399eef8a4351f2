"""Kitchen base cabinets that show their inside: open shelves, a door ajar."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import Mesh, Vec, box, lathe, rounded_box
from onemap_simulator.generation.model import Model, Part, assemble
from onemap_simulator.generation.sampler import Sampler
from onemap_tools.train.variety.designs.appliance_parts import provisions, rubber, shell, turned
from onemap_tools.train.variety.designs.kitchen_cabinet_parts import (
    CATEGORY,
    DEPTH_M,
    FRONT_Y,
    TOP_M,
    doors_between,
    front_leaf,
    front_pull,
    top_surface,
    worktop,
)


def _dishes(sampler: Sampler, width: float, room: float, at: Vec) -> list[Mesh]:
    """Stacks of plates and bowls and pots on a shelf."""
    meshes: list[Mesh] = []
    count = max(1, int(width / 0.2))
    for x in (np.arange(count) - (count - 1) / 2) * width / count:
        radius = min(0.11, width / count * 0.45)
        place = (at[0] + float(x), at[1], at[2])
        kind = sampler.integer(0, 2)
        if kind == 0:
            for level in range(sampler.integer(3, 6)):
                z = place[2] + level * 0.014
                rim = [(radius * 0.5, 0), (radius, 0.01), (radius * 0.5, 0.008)]
                meshes.append(lathe(rim, (*place[:2], z), 14))
        elif kind == 1:
            meshes.append(lathe([(radius * 0.9, 0), (radius * 0.9, room * 0.5)], place, 14))
            lid = [(radius * 0.94, 0), (radius * 0.5, 0.02), (0.012, 0.024), (0.012, 0.045)]
            meshes.append(lathe(lid, (*place[:2], place[2] + room * 0.5), 14))
        else:
            meshes.append(lathe([(radius * 0.4, 0), (radius * 0.9, 0.07), (0.01, 0.02)], place, 14))
    return meshes


def open_shelved(sampler: Sampler) -> Model:
    """A base cabinet without doors, or with one beside the shelves: crockery, pots, baskets."""
    width, low = sampler.size(0.45, 0.85), sampler.uniform(0.06, 0.12)
    thick, wall = sampler.uniform(0.025, 0.045), 0.02
    top, half = TOP_M - thick, width / 2 - 0.002
    body = shell((-half, FRONT_Y + 0.01, low), (half, DEPTH_M / 2, top), wall)
    x0 = -half + wall
    leaves: list[Mesh] = []
    pulls: list[Mesh] = []
    if width > 0.62 and sampler.chance(0.6):
        x0 = -half + width * 0.45
        body.append(
            box((wall, DEPTH_M - 0.03, top - low - 2 * wall), (x0 - wall / 2, 0.005, low + wall))
        )
        leaves, pulls = doors_between(sampler, width * 0.45, (low, top), sampler.integer(0, 4), 0)
        leaves = [m.translated(-width * 0.275, -0.009) for m in leaves]
        pulls = [m.translated(-width * 0.275, -0.009) for m in pulls]
    wide, x = half - wall - x0, (half - wall + x0) / 2
    rows = sampler.integer(2, 3)
    room = (top - low - wall) / rows
    things: list[Mesh] = []
    baskets: list[Mesh] = []
    for row in range(rows):
        z = low + wall + row * room
        if row:
            body.append(box((wide, DEPTH_M - 0.08, 0.018), (x, 0.02, z - 0.018)))
        if sampler.chance(0.35):
            size = (wide * 0.9, 0.4, room * 0.6)
            baskets.append(rounded_box(size, (x, 0.0, z + 0.002), 0.02))
        elif sampler.chance(0.6):
            things += _dishes(sampler, wide, room - 0.05, (x, -0.08, z + 0.002))
        else:
            things += provisions(sampler, wide, 0.2, room - 0.04, (x, -0.08, z + 0.002))
    foot = [box((width - 0.004, DEPTH_M - 0.1, low + 0.002), (0, 0.035, 0))]
    groups = [(sampler.ceramic(), things), (sampler.fabric(), baskets), (sampler.metal(), pulls)]
    return assemble(
        CATEGORY,
        (sampler.wood(), body),
        (sampler.wood(), worktop(sampler, width, thick)),
        (sampler.wood(), leaves + foot),
        *[group for group in groups if group[1]],
        support_surfaces=top_surface(width),
    )


def ajar(sampler: Sampler) -> Model:
    """A base cabinet with a door standing open: a shelf inside, pots and packets on it."""
    width, low = sampler.size(0.42, 0.82), sampler.uniform(0.08, 0.14)
    thick, wall = sampler.uniform(0.025, 0.045), 0.018
    top, half = TOP_M - thick, width / 2 - 0.002
    body = shell((-half, FRONT_Y + 0.02, low), (half, DEPTH_M / 2, top), wall)
    middle = (low + top) / 2
    body.append(box((width - 2 * wall, DEPTH_M - 0.12, 0.018), (0, 0.03, middle)))
    things = _dishes(sampler, width - 0.06, middle - low - 0.06, (0, 0.0, low + wall + 0.002))
    things += provisions(sampler, width - 0.08, 0.2, top - middle - 0.07, (0, 0.0, middle + 0.02))
    style, kind = sampler.integer(0, 4), sampler.choice([0, 2])
    count = 2 if width > 0.6 else 1
    wide = width / count
    moving = sampler.choice([0, 1]) if count == 2 else 0
    leaves, pulls = [], []
    for index in range(count):
        hinge = (-1 if index == 0 else 1) if count == 2 else sampler.choice([-1, 1])
        x = (index - (count - 1) / 2) * wide
        y = FRONT_Y + 0.018
        leaf = front_leaf(wide - 0.008, top - low - 0.008, (x, y, low + 0.004), style)
        at = (x - hinge * (wide / 2 - 0.045), y - 0.026, top - 0.14)
        pull = front_pull(sampler, kind, at, True, 0.3)
        if index == moving or sampler.chance(0.3):
            angle, pivot = hinge * sampler.uniform(35, 88), (x + hinge * wide / 2, y)
            leaf, pull = turned(leaf, angle, pivot), turned(pull, angle, pivot)
        leaves += leaf
        pulls += pull
    foot = [box((width - 0.004, DEPTH_M - 0.1, low + 0.002), (0, 0.035, 0))]
    board = worktop(sampler, width, thick)
    model = assemble(
        CATEGORY,
        (sampler.wood(), body),
        (sampler.wood(), leaves),
        (sampler.metal(), pulls),
        (sampler.wood(), board),
        (sampler.ceramic(), things),
        (rubber(sampler), foot),
    )
    x, y = (float(v) for v in -(model.lower + model.upper)[:2] / 2)
    parts = tuple(Part(p.mesh.translated(x, y), p.material) for p in model.parts)
    return Model(CATEGORY, parts, top_surface(width, y))
