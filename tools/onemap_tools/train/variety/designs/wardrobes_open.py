"""Wardrobes that show what is in them: open doors, glass doors, cloth covers."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import Mesh, box, rod, rounded_box, tube
from onemap_simulator.generation.model import Material, Model, assemble
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.joinery import (
    LEAF_M,
    case,
    feet,
    folded,
    garments,
    grip,
    panelled,
    settled,
    shifted,
)

NAME = "wardrobe"
Group = tuple[Material, list[Mesh]]


def inside_of(sampler: Sampler, width: float, depth: float, height: float) -> list[Group]:
    """A rail with clothes, and in wide ones a column of shelves; base at z = 0."""
    boards: list[Mesh] = []
    piles: list[Mesh] = []
    wardrobe_w, x = width, 0.0
    hat = height - sampler.uniform(0.22, 0.35)
    boards.append(box((width, depth, 0.018), (0, 0, hat)))
    if width > 0.75:
        part = width * sampler.uniform(0.3, 0.5)
        side = sampler.choice([-1, 1])
        wardrobe_w, x = width - part - 0.02, -side * (part + 0.02) / 2
        at = side * (width - part) / 2
        boards.append(box((0.018, depth, hat), (at - side * part / 2, 0, 0)))
        levels = sampler.integer(3, 6)
        for level in range(levels):
            z = level * hat / levels
            if level:
                boards.append(box((part - 0.02, depth, 0.018), (at, 0, z)))
            if sampler.chance(0.75):
                pile = folded(sampler, part * 0.75, depth * 0.75, hat / levels - 0.05)
                piles += shifted(pile, at, 0, z + 0.019)
    rail_z = hat - 0.07
    rail = rod((x - wardrobe_w / 2, 0, rail_z), (x + wardrobe_w / 2, 0, rail_z), 0.013)
    clothes = garments(sampler, wardrobe_w * sampler.uniform(0.6, 0.97), depth * 0.85, rail_z - 0.1)
    clothes = shifted(clothes, x, 0, rail_z)
    cloths: list[list[Mesh]] = [[], [], []]
    for mesh in clothes + piles:
        sampler.choice(cloths).append(mesh)
    return [
        (sampler.wood(), boards),
        (sampler.metal(), [rail]),
        *((sampler.fabric(), cloth) for cloth in cloths),
    ]


def open_doors(sampler: Sampler) -> Model:
    """A wardrobe with one or both doors ajar, its rail and clothes in view."""
    width, depth = sampler.size(0.75, 1.3), sampler.size(0.5, 0.6)
    height, foot = sampler.size(1.75, 2.2), sampler.uniform(0.04, 0.14)
    body = case((width, depth, height - foot), 0.022, foot)
    if sampler.chance(0.4):
        body.append(box((width + 0.06, depth + 0.04, 0.04), (0, -0.01, height)))
    wide, tall = width / 2 - 0.004, height - foot - 0.01
    rows, held = sampler.integer(0, 3), grip(sampler, 0.1, 0.3)
    leaf = panelled(wide, tall, max(rows, 1), sampler.uniform(0.05, 0.09))
    if not rows:
        leaf = [box((wide, LEAF_M, tall), (0, -LEAF_M / 2, 0))], []
    frames: list[Mesh] = []
    panels: list[Mesh] = []
    handles: list[Mesh] = []
    lazy = sampler.choice([-1, 1, 0])
    for side in (-1, 1):
        turn = side * (0.0 if side == lazy else sampler.uniform(35, 115))
        hinge = (side * width / 2, -depth / 2, foot + 0.005)
        pulls = held.at(-side * (wide / 2 - 0.03), -LEAF_M, tall * 0.45)
        swung = [
            [m.rotated("z", turn).translated(*hinge) for m in shifted(group, -side * wide / 2, 0)]
            for group in (*leaf, pulls)
        ]
        frames += swung[0]
        panels += swung[1]
        handles += swung[2]
    inside = inside_of(sampler, width - 0.05, depth - 0.05, height - foot - 0.05)
    inside = [(m, shifted(meshes, 0, -0.01, foot + 0.022)) for m, meshes in inside]
    wood = sampler.wood()
    face = wood if sampler.chance(0.5) else sampler.wood()
    model_feet = feet(sampler, width, depth, foot + 0.005)
    return settled(
        assemble(
            NAME,
            (wood, body + model_feet),
            (face, frames),
            (face if rows and sampler.chance(0.5) else sampler.wood(), panels),
            (sampler.metal(), handles),
            *inside,
        )
    )


def glass_front(sampler: Sampler) -> Model:
    """Framed doors with bars and no filling but glass: clothes and shelves seen through."""
    doors = sampler.integer(2, 4)
    each, depth, height = sampler.size(0.4, 0.55), sampler.size(0.5, 0.62), sampler.size(1.85, 2.3)
    plinth, rail = sampler.uniform(0.04, 0.1), sampler.uniform(0.022, 0.07)
    width = doors * each + 0.03
    body = shifted(case((width, depth - LEAF_M, height - plinth), 0.02, plinth), 0, LEAF_M / 2)
    body.append(box((width - 0.04, depth - 0.1, plinth), (0, 0.02, 0)))
    rows, held = sampler.integer(1, 5), grip(sampler, 0.15, 0.4)
    solid_row = sampler.chance(0.4)
    wide, tall, low = each - 0.006, height - plinth - 0.01, plinth + 0.005
    frames: list[Mesh] = []
    solid: list[Mesh] = []
    handles: list[Mesh] = []
    closed = sampler.integer(0, doors - 1) if sampler.chance(0.4) else -1
    for index in range(doors):
        x, side = (index - (doors - 1) / 2) * each, 1 if index % 2 else -1
        frame, panels = panelled(wide, tall, rows, rail)
        frames += shifted(frame, x, LEAF_M - depth / 2, low)
        if index == closed:
            solid += shifted(panels, x, LEAF_M - depth / 2, low)
        elif solid_row and rows > 1:
            solid += shifted(panels[:1], x, LEAF_M - depth / 2, low)
        handles += held.at(x - side * (wide / 2 - rail / 2), -depth / 2, low + tall * 0.5)
    inside = inside_of(sampler, width - 0.045, depth - 0.08, height - plinth - 0.05)
    inside = [(m, shifted(meshes, 0, 0.015, plinth + 0.02)) for m, meshes in inside]
    return assemble(
        NAME,
        (sampler.wood(), body),
        (sampler.metal() if rail < 0.04 else sampler.wood(), frames),
        (sampler.pale(), solid),
        (sampler.metal(), handles),
        *inside,
    )


def cloth_cover(sampler: Sampler) -> Model:
    """A camping wardrobe: cloth over thin tubes, its front rolled up or zipped."""
    width, depth = sampler.size(0.7, 1.3), sampler.size(0.42, 0.52)
    height, t = sampler.size(1.5, 1.8), 0.006
    half, y = width / 2, depth / 2
    tubes = [
        rod(
            (sx * (half - 0.02), sy * (y - 0.02), 0),
            (sx * (half - 0.02), sy * (y - 0.02), height),
            0.01,
        )
        for sx in (-1, 1)
        for sy in (-1, 1)
    ]
    low = 0.06
    cover = [box((t, depth, height - low), (s * (half - t), 0, low)) for s in (-1, 1)]
    cover.append(box((width - 2 * t, t, height - low), (0, y - t, low)))
    cover.append(rounded_box((width + 0.02, depth + 0.02, 0.07), (0, 0, height - 0.05), 0.03))
    floor = box((width - 0.03, depth - 0.02, 0.02), (0, 0, low))
    seams: list[Mesh] = []
    lanes = sampler.integer(1, 2)
    for lane in range(lanes):
        wide = width / lanes
        x = (lane - (lanes - 1) / 2) * wide
        if sampler.chance(0.5):
            cover.append(box((wide - 0.004, t, height - low - 0.06), (x, 0.004 - y, low)))
            curve = np.linspace(0, 1, 7)
            path = [
                (x + s * (wide / 2 - 0.08), -y, low + 0.1 + float(k) * (height - 0.35))
                for s in (-1, 1)
                for k in (curve if s < 0 else curve[::-1])
            ]
            seams.append(tube(path, 0.006))
        else:
            roll = rounded_box((wide - 0.04, 0.09, 0.09), (x, 0.01 - y, height - 0.17), 0.04)
            cover.append(roll)
            seams += [
                box((0.025, 0.1, 0.12), (x + s * wide * 0.25, 0.008 - y, height - 0.185))
                for s in (-1, 1)
            ]
    inside = inside_of(sampler, width - 0.06, depth - 0.08, height - low - 0.05)
    inside = [(m, shifted(meshes, 0, 0.01, low + 0.02)) for m, meshes in inside]
    return assemble(
        NAME,
        (sampler.metal(), [*tubes]),
        (sampler.fabric(), [*cover, floor]),
        (sampler.plastic(), seams),
        *inside,
    )


OPEN_WARDROBES: tuple[ModelFactory, ...] = (open_doors, glass_front, cloth_cover)
