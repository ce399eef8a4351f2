"""Bookcases, shelves, wardrobes, dressers, nightstands; boxes, baskets, trash cans, suitcases."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import (
    Mesh,
    Model,
    assemble,
    box,
    box_between,
    corners,
    cylinder,
    ellipsoid,
    knob,
    lathe,
    rod,
    rounded_box,
    spread,
    top,
    tube,
)
from onemap_simulator.generation.style import Sampler

BOARD_M = 0.025


def carcass(width: float, depth: float, height: float, shelves: int) -> list[Mesh]:
    """An open cupboard: sides, back, base, lid and boards at equal distances."""
    side, board = (BOARD_M, depth, height), (width - 2 * BOARD_M, depth, BOARD_M)
    return [
        *(box(side, (s * (width - BOARD_M) / 2, 0, 0)) for s in (-1, 1)),
        box((width, 0.012, height), (0, depth / 2 - 0.006, 0)),
        *(box(board, (0, 0, z)) for z in np.linspace(0.0, height - BOARD_M, shelves + 1)),
    ]


def _books(draw: Sampler, width: float, depth: float, height: float) -> list[Mesh]:
    """A row of upright books from x = 0 to at most ``width``."""
    meshes, x = [], 0.0
    while x < width - 0.05:
        thick, tall = draw.uniform(0.025, 0.06), height * draw.uniform(0.65, 0.95)
        if x + thick > width:
            break
        deep = depth * draw.uniform(0.7, 0.95)
        meshes.append(box_between((x, -deep / 2, 0.0), (x + thick - 0.003, deep / 2, tall)))
        x += thick
    return meshes


def bookcase(draw: Sampler) -> Model:
    """Tall open shelves, most of them filled with rows of book spines."""
    width, depth = draw.sizes((0.7, 1.1), (0.27, 0.34))
    shelves = draw.integer(4, 6)
    height = shelves * draw.size(0.31, 0.36)
    covers: list[list[Mesh]] = [[] for _ in range(5)]
    tall = (height / shelves - BOARD_M) * 0.92
    inner = width - 2 * BOARD_M - 0.01
    for shelf in range(shelves):
        z = shelf * (height - BOARD_M) / shelves + BOARD_M
        for book in _books(draw, inner * draw.uniform(0.6, 1.0), depth - 0.05, tall):
            draw.choice(covers).append(book.translated(-inner / 2, -0.01, z))
    materials = [draw.plastic() for _ in covers]
    boards = (draw.wood(), carcass(width, depth, height, shelves))
    return assemble("bookcase", boards, *zip(materials, covers, strict=True))


def shelf(draw: Sampler) -> Model:
    """Boards on the wall on brackets, or a low open rack, for small objects."""
    width, depth = draw.sizes((0.7, 1.1), (0.24, 0.3))
    wood, metal = draw.wood(), draw.metal()
    if draw.chance(0.5):
        levels = [0.0, draw.size(0.38, 0.45)][: draw.integer(1, 2)]
        low = draw.size(1.0, 1.15)
        size = (0.025, depth * 0.9, 0.08)
        boards = [box((width, depth, 0.035), (0, 0, z)) for z in levels]
        holders = [box(size, (s * width * 0.36, 0.01, z - 0.08)) for z in levels for s in (-1, 1)]
        boards, holders = ([m.translated(0, 0, low) for m in each] for each in (boards, holders))
        tops = [top(width, depth, z + 0.035, 0.02) for z in levels]
        tops = [each._replace(z=each.z + low) for each in tops]
    else:
        height, count = draw.size(0.9, 1.3), draw.integer(2, 3)
        levels = np.linspace(0.08, height - 0.03, count + 1).tolist()
        boards = [box((width, depth + 0.05, 0.03), (0, 0, z)) for z in levels]
        places = corners(width / 2 - 0.015, depth / 2 + 0.01)
        holders = [box((0.03, 0.03, height + 0.02), (x, y, 0)) for x, y in places]
        tops = [top(width - 0.08, depth, z + 0.03, 0.02) for z in levels]
    return assemble("shelf", (wood, boards), (metal, holders), tops=tops)


def wardrobe(draw: Sampler) -> Model:
    """A tall closed cupboard with doors, which may stand on a drawer."""
    doors = draw.integer(2, 3)
    width = doors * draw.size(0.42, 0.52)
    depth, height, foot = draw.sizes((0.52, 0.6), (1.85, 2.15), (0.04, 0.1))
    wood, metal = draw.wood(), draw.metal()
    front = wood if draw.chance(0.5) else draw.wood()
    body = [
        box((width, depth - 0.03, height - foot), (0, 0.015, foot)),
        box((width + 0.03, depth + 0.02, 0.04), (0, 0, height)),
        box((width - 0.06, depth - 0.1, foot)),
    ]
    drawer_h = draw.size(0.22, 0.3) if draw.chance(0.4) else 0.0
    y, each, low = -depth / 2 + 0.012, width / doors, foot + drawer_h
    leaf_h = height - low - 0.03
    leaves, handles = [], []
    for index, x in enumerate(spread(doors, each)):
        leaves.append(rounded_box((each - 0.015, 0.03, leaf_h), (x, y, low + 0.015), 0.008))
        if draw.chance(0.5):
            leaves.append(box((each - 0.14, 0.02, leaf_h - 0.16), (x, y - 0.012, low + 0.1)))
        side = 1 if index % 2 == 0 else -1
        at = (x + side * (each / 2 - 0.05), y - 0.035, low + leaf_h * 0.45)
        handles.append(box((0.02, 0.03, draw.uniform(0.12, 0.25)), at))
    if drawer_h:
        size = (width - 0.02, 0.03, drawer_h - 0.02)
        leaves.append(rounded_box(size, (0, y, foot + 0.01), 0.008))
        at = (width / 4, y - 0.03, foot + drawer_h / 2)
        handles += [box((0.14, 0.03, 0.02), (s * at[0], *at[1:])) for s in (-1, 1)]
    return assemble("wardrobe", (wood, body), (front, leaves), (metal, handles))


def dresser(draw: Sampler) -> Model:
    """A chest of drawers in one to three columns."""
    columns = draw.integer(1, 3)
    width = columns * draw.size(0.42, 0.55) + (0.25 if columns == 1 else 0.0)
    return _drawers(draw, "dresser", [width, *draw.sizes((0.42, 0.5), (0.72, 1.0))], columns)


def nightstand(draw: Sampler) -> Model:
    """A small chest beside a bed, with drawers or an open compartment."""
    return _drawers(draw, "nightstand", draw.sizes((0.38, 0.5), (0.34, 0.42), (0.45, 0.6)), 1)


def _drawers(draw: Sampler, category: str, size: list[float], columns: int) -> Model:
    width, depth, height = size
    rows = draw.integer(3, 4) if category == "dresser" else draw.integer(1, 2)
    wood, metal = draw.wood(), draw.metal()
    front = wood if draw.chance(0.5) else draw.wood()
    leg = draw.size(0.08, 0.2) if draw.chance(0.5) else 0.03
    hollow = category == "nightstand" and rows == 1
    low = leg + (height - leg) * 0.5 if hollow else leg
    body = [
        box((width + 0.03, depth + 0.02, 0.03), (0, 0, height - 0.03)),
        box((width, depth - 0.03, height - low - 0.03), (0, 0.015, low)),
    ]
    if hollow:
        body += [m.translated(0, 0, leg) for m in carcass(width, depth - 0.03, low - leg + 0.01, 1)]
    feet = corners(width / 2 - 0.03, depth / 2 - 0.05)
    body += [box((0.045, 0.045, leg), (x, y, 0)) for x, y in feet]
    fronts, pulls = [], []
    each_w, each_h = width / columns, (height - low - 0.04) / rows
    round_pulls = draw.chance(0.5)
    for x in spread(columns, each_w):
        for z in (low + row * each_h for row in range(rows)):
            at = (x, -depth / 2 + 0.012, z + 0.01)
            fronts.append(rounded_box((each_w - 0.025, 0.03, each_h - 0.02), at, 0.008))
            pulls += _pulls(round_pulls, each_w, (x, -depth / 2, z + each_h / 2))
    groups = (wood, body), (front, fronts), (metal, pulls)
    return assemble(category, *groups, tops=[top(width, depth, height)])


def _pulls(round_pulls: bool, width: float, at: tuple[float, float, float]) -> list[Mesh]:
    x, y, z = at
    if not round_pulls:
        return [box((min(0.16, width * 0.4), 0.03, 0.02), (x, y - 0.015, z))]
    offsets = (-width / 4, width / 4) if width > 0.5 else (0.0,)
    return [knob(0.02, 0.035, (x + offset, y, z), 8) for offset in offsets]


def cardboard_box(draw: Sampler) -> Model:
    """A carton, closed with tape or open with four flaps."""
    width, depth, height = draw.sizes((0.32, 0.5), (0.26, 0.38), (0.22, 0.36))
    tan = draw.uniform(0.75, 1.1)
    brown = (0.72 * tan, 0.55 * tan, 0.36 * tan)
    card = draw.material("noise", 0.3, brown) if draw.chance(0.6) else draw.plastic()
    if draw.chance(0.5):
        paper = [
            box((width + 0.004, 0.05, 0.006), (0, 0, height)),
            box((width + 0.006, 0.05, height * 0.3), (0, 0, height * 0.7)),
            box((0.14, 0.005, 0.1), (width * 0.15, -depth / 2, height * 0.4)),
        ]
        return assemble("box", (card, [box((width, depth, height))]), (draw.pale(), paper))
    t = 0.008
    walls = [
        box((width, depth, t)),
        *(box((width, t, height), (0, s * (depth - t) / 2, 0)) for s in (-1, 1)),
        *(box((t, depth, height), (s * (width - t) / 2, 0, 0)) for s in (-1, 1)),
    ]
    for s in (-1, 1):
        flap = box((width, depth * 0.45, t), (0, s * depth * 0.225, 0))
        walls.append(flap.rotated("x", -s * 25).translated(0, s * depth / 2, height))
        flap = box((width * 0.3, depth, t), (s * width * 0.15, 0, 0))
        walls.append(flap.rotated("y", s * 35).translated(s * width / 2, 0, height))
    return assemble("box", (card, walls))


def basket(draw: Sampler) -> Model:
    """A woven basket, round or oval, with two handles or a rim, at times with cloth in it."""
    radius, height = draw.sizes((0.18, 0.25), (0.24, 0.34))
    hue = draw.uniform(0.6, 1.1)
    straw = (0.78 * hue, 0.6 * hue, 0.36 * hue) if draw.chance(0.6) else draw.colour()
    weave = draw.material("checks" if draw.chance(0.5) else "weave", 0.12, straw)
    low, rows = radius * draw.uniform(0.7, 0.95), 8
    profile = []
    for row in range(rows + 1):  # bulging courses of wicker
        share = row / rows
        r = low + (radius - low) * share
        profile += [(r, height * share), (r + 0.012, height * (share + 0.4 / rows))]
    profile = [*profile[:-1], (radius - 0.02, height), (low - 0.02, 0.03), (0.0, 0.03)]
    oval, turns = draw.uniform(0.75, 1.0), np.linspace(0, np.pi, 7)
    body = [lathe(profile, segments=18).scaled(1.0, oval, 1.0)]
    for x in (-radius * 0.97, radius * 0.97):
        body.append(tube([(x, 0.07 * np.cos(a), height + 0.06 * np.sin(a)) for a in turns], 0.014))
    groups = [(weave, body)]
    if draw.chance(0.5):
        cloth = ellipsoid((radius * 0.85, radius * oval * 0.85, 0.08), (0, 0, height - 0.02), 10)
        groups.append((draw.fabric(), [cloth]))
    return assemble("basket", *groups)


def trash_can(draw: Sampler) -> Model:
    """A bin: a tapered bucket with a dark inside, or a pedal bin with a domed lid."""
    radius, height = draw.sizes((0.13, 0.18), (0.32, 0.48))
    skin, dark = draw.metal() if draw.chance(0.5) else draw.plastic(), draw.dark()
    if draw.chance(0.5):
        bucket = ((0.8, 0), (1, height), (1.05, height), (0.95, height - 0.02), (0.75, 0.05))
        rim = ((1.07, height - 0.07), (1.08, height + 0.012), (0.92, height + 0.005))
        body = lathe([(radius * r, z) for r, z in bucket])
        bag = lathe([(radius * r, z) for r, z in (*rim, (0, height - 0.12))])
        inside = dark if draw.chance(0.6) else draw.pale()
        return assemble("trash can", (skin, [body]), (inside, [bag]))
    body = cylinder(radius, height, (0, 0, 0.02), 18)
    lid = ellipsoid((radius * 1.03, radius * 1.03, 0.09), (0, 0, height + 0.02), 16)
    trim = [
        cylinder(radius * 1.03, 0.03, (0, 0, height - 0.01), 18),
        cylinder(radius * 1.02, 0.03),
        box((0.09, 0.07, 0.02), (0, -radius - 0.02, 0.015)),  # the pedal
    ]
    return assemble("trash can", (skin, [body, lid]), (dark, trim))


def suitcase(draw: Sampler) -> Model:
    """An upright trolley case: ribbed shell, wheels, a side grip and a pulled-out handle."""
    width, depth, height = draw.sizes((0.38, 0.48), (0.22, 0.28), (0.55, 0.7))
    shell = draw.plastic() if draw.chance(0.6) else draw.fabric()
    dark, metal = draw.dark(), draw.metal()
    rib, z = (0.025, depth + 0.02, height * 0.86), 0.05 + height * 0.07
    ribs = np.linspace(-width * 0.32, width * 0.32, draw.integer(3, 6))
    body = [rounded_box((width, depth, height), (0, 0, 0.05), 0.05)]
    body += [rounded_box(rib, (x, 0, z), 0.012) for x in ribs]
    wheels = corners(width * 0.36, depth * 0.33)
    upper, pull = height + 0.05, draw.size(0.12, 0.35)
    end = upper + pull
    grip = [(-0.08, -0.03, upper - 0.01), (-0.06, -0.03, upper + 0.035)]
    grip += [(-x, y, z) for x, y, z in reversed(grip)]
    trim = [
        box((width + 0.006, 0.02, height * 0.9), (0, 0, 0.05 + height * 0.05)),
        *(knob(0.03, 0.03, (x - 0.015, y, 0.03), axis="y") for x, y in wheels),
        rounded_box((0.24, 0.035, 0.035), (0, 0.04, end - 0.015), 0.015),
        tube(grip, 0.012),
    ]
    bars = [rod((x, 0.04, upper - 0.02), (x, 0.04, end), 0.01) for x in (-0.09, 0.09)]
    return assemble("suitcase", (shell, body), (metal, bars), (dark, trim))
