"""Kitchen base cabinets: framed, handleless, drawers, farmhouse, steel; and open ones."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import Mesh, box, box_between, lathe, rod, rounded_box
from onemap_simulator.generation.model import Model, assemble
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.appliance_parts import round_rect, rubber, slab
from onemap_tools.train.variety.designs.kitchen_cabinet_parts import (
    CATEGORY,
    DEPTH_M,
    FRONT_Y,
    TOP_M,
    closed_carcass,
    doors_between,
    front_leaf,
    front_pull,
    top_surface,
    worktop,
)
from onemap_tools.train.variety.designs.open_kitchen_cabinets import ajar, open_shelved


def shaker(sampler: Sampler) -> Model:
    """Framed doors under a drawer or two, with knobs, cups or bars."""
    width, low = sampler.size(0.4, 0.82), sampler.uniform(0.08, 0.15)
    thick = sampler.uniform(0.02, 0.045)
    top, style, kind = TOP_M - thick, sampler.integer(1, 4), sampler.integer(0, 2)
    body, foot = closed_carcass(sampler, width, low, top)
    cut = top - sampler.uniform(0.13, 0.2)
    leaves, pulls = doors_between(sampler, width, (low, cut), style, kind)
    count = 2 if width > 0.62 and sampler.chance(0.6) else 1
    for index in range(count):
        wide = width / count
        x, y = (index - (count - 1) / 2) * wide, FRONT_Y + 0.018
        leaves += front_leaf(wide - 0.008, top - cut - 0.01, (x, y, cut + 0.003), style % 3)
        at = (x, y - 0.026, (cut + top) / 2)
        pulls += front_pull(sampler, kind, at, False, wide * 0.4)
    paint = sampler.wood()
    return assemble(
        CATEGORY,
        (paint, body + leaves),
        (sampler.wood(), worktop(sampler, width, thick)),
        (sampler.metal(), pulls),
        (paint if sampler.chance(0.5) else rubber(sampler), foot),
        support_surfaces=top_surface(width),
    )


def handleless(sampler: Sampler) -> Model:
    """Flat fronts with grip channels of metal, under a thin slab or one that falls to the floor."""
    width, low = sampler.size(0.42, 0.84), sampler.uniform(0.06, 0.12)
    thick = sampler.uniform(0.012, 0.07)
    top = TOP_M - thick
    body, foot = closed_carcass(sampler, width, low, top)
    slab_top = [box((width, DEPTH_M + 0.02, thick), (0, 0, TOP_M - thick))]
    inner = width
    if sampler.chance(0.4):
        slab_top += [
            box((0.03, DEPTH_M + 0.02, top), (s * (width / 2 - 0.015), 0, 0)) for s in (-1, 1)
        ]
        inner = width - 0.06
    rows = sampler.integer(1, 3)
    fronts, channels = [], []
    tall = (top - low) / rows
    columns = 2 if inner > 0.62 and rows == 1 else 1
    for row in range(rows):
        z = low + row * tall
        channels.append(box((inner - 0.004, 0.02, 0.032), (0, FRONT_Y + 0.03, z + tall - 0.034)))
        for index in range(columns):
            x = (index - (columns - 1) / 2) * inner / columns
            size = (inner / columns - 0.006, 0.02, tall - 0.04)
            fronts.append(box(size, (x, FRONT_Y + 0.01, z)))
    front = sampler.wood() if sampler.chance(0.5) else sampler.plastic()
    return assemble(
        CATEGORY,
        (sampler.wood(), body),
        (front, fronts),
        (sampler.metal(), channels),
        (sampler.material("marble", 0.8, sampler.colour()), slab_top),
        (rubber(sampler), foot),
        support_surfaces=top_surface(width),
    )


def drawers(sampler: Sampler) -> Model:
    """A bank of three to five drawers, shallow above deep, one at times pulled out."""
    width, low = sampler.size(0.4, 0.8), sampler.uniform(0.07, 0.14)
    thick = sampler.uniform(0.025, 0.045)
    top, style, kind = TOP_M - thick, sampler.integer(0, 3), sampler.integer(0, 2)
    body, foot = closed_carcass(sampler, width, low, top)
    count = sampler.integer(3, 5)
    shares = np.linspace(1.0, sampler.uniform(0.4, 1.0), count)
    edges = low + (top - low) * np.concatenate([[0], np.cumsum(shares) / shares.sum()])
    leaves, pulls, boxes = [], [], []
    out = sampler.integer(0, count - 1) if sampler.chance(0.4) else -1
    for row in range(count):
        z, tall = float(edges[row]), float(edges[row + 1] - edges[row])
        shift = -sampler.uniform(0.03, 0.05) if row == out else 0.0
        y = FRONT_Y + 0.018 + shift
        leaves += front_leaf(width - 0.01, tall - 0.01, (0, y, z + 0.005), style)
        pulls += front_pull(sampler, kind, (0, y - 0.026, z + tall * 0.62), False, width * 0.45)
        if shift:
            lower, upper = (
                (-width / 2 + 0.02, y, z + 0.02),
                (width / 2 - 0.02, 0.0, z + tall - 0.03),
            )
            boxes.append(box_between(lower, upper))
    groups = [(sampler.wood(), boxes)] if boxes else []
    return assemble(
        CATEGORY,
        (sampler.wood(), body),
        (sampler.wood(), leaves),
        (sampler.metal(), pulls),
        (sampler.wood(), worktop(sampler, width, thick)),
        (rubber(sampler), foot),
        *groups,
        support_surfaces=top_surface(width),
    )


def farmhouse(sampler: Sampler) -> Model:
    """Corner posts that end as legs, plank or raised doors, a thick board on top, a towel rail."""
    width, low = sampler.size(0.5, 0.85), sampler.uniform(0.12, 0.24)
    thick = sampler.uniform(0.035, 0.06)
    top, post = TOP_M - thick, sampler.uniform(0.04, 0.065)
    body = [box((width - post, DEPTH_M - post, top - low - 0.01), (0, 0.0, low))]
    posts: list[Mesh] = []
    for x in (-1, 1):
        for y in (-1, 1):
            at = (x * (width - post) / 2, y * (DEPTH_M - post) / 2)
            posts.append(box((post, post, top - low + 0.02), (*at, low - 0.02)))
            turn = [
                (post * 0.3, 0),
                (post * 0.5, low * 0.3),
                (post * 0.34, low * 0.55),
                (post * 0.5, low - 0.015),
            ]
            posts.append(lathe(turn, (*at, 0), 10))
    inner = width - 2 * post
    cut = top - (sampler.uniform(0.14, 0.2) if sampler.chance(0.6) else 0.02)
    style, kind = sampler.integer(1, 3), sampler.integer(0, 2)
    leaves, pulls = doors_between(sampler, inner, (low + 0.03, cut), style, kind)
    if top - cut > 0.1:
        leaves += front_leaf(inner - 0.01, top - cut - 0.03, (0, FRONT_Y + 0.018, cut + 0.01), 1)
        pulls += front_pull(
            sampler, kind, (0, FRONT_Y - 0.008, (cut + top) / 2), False, inner * 0.3
        )
    leaves = [m.translated(0, 0.012) for m in leaves]
    pulls = [m.translated(0, 0.012) for m in pulls]
    if sampler.chance(0.5):
        side, z = width / 2 + 0.045, top - 0.1
        pulls.append(rod((side, -0.22, z), (side, 0.22, z), 0.009))
        pulls += [rod((width / 2 - 0.02, y, z), (side, y, z), 0.008, 6) for y in (-0.2, 0.2)]
    return assemble(
        CATEGORY,
        (sampler.wood(), body + leaves),
        (sampler.wood(), posts),
        (sampler.metal(), pulls),
        (sampler.wood(), worktop(sampler, width, thick)),
        support_surfaces=top_surface(width),
    )


def steel(sampler: Sampler) -> Model:
    """A 1950s cabinet of pressed steel: round-cornered fronts, long pulls, a ribbed metal edge."""
    width, low = sampler.size(0.45, 0.84), sampler.uniform(0.09, 0.13)
    thick = sampler.uniform(0.03, 0.045)
    top = TOP_M - thick
    body, foot = closed_carcass(sampler, width, low, top)
    columns = 2 if width > 0.6 else 1
    wide, cut = width / columns, top - sampler.uniform(0.14, 0.2)
    fronts, pulls = [], []
    for index in range(columns):
        x = (index - (columns - 1) / 2) * wide
        stack = [(low + 0.01, cut), (cut, top - 0.005)]
        if sampler.chance(0.3):
            third = low + (cut - low) * 0.5
            stack = [(low + 0.01, third), (third, cut), (cut, top - 0.005)]
        for bottom, upper in stack:
            tall, corner = upper - bottom - 0.012, 0.03
            for inset, deep in ((0.0, 0.0), (0.012, -0.008)):
                shape = round_rect(wide - 0.016 - 2 * inset, tall - 2 * inset, corner, corner)
                fronts.append(slab(shape, 0.02, (x, FRONT_Y + 0.035 + deep, bottom + inset)))
            at = (x, FRONT_Y + 0.008, upper - min(0.06, tall * 0.4))
            pulls += front_pull(sampler, sampler.choice([1, 2]), at, False, wide * 0.3)
    board = [rounded_box((width, DEPTH_M + 0.02, thick), (0, 0, TOP_M - thick), 0.012)]
    trim = [
        box((width - 0.002, 0.008, 0.006), (0, FRONT_Y - 0.011, TOP_M - thick * s))
        for s in (0.75, 0.5)
    ]
    return assemble(
        CATEGORY,
        (sampler.enamel(), body + fronts),
        (sampler.metal(), pulls + trim),
        (sampler.plastic(), board),
        (rubber(sampler), foot),
        support_surfaces=top_surface(width),
    )


DESIGNS: dict[str, tuple[ModelFactory, ...]] = {
    CATEGORY: (shaker, handleless, drawers, open_shelved, farmhouse, steel, ajar)
}
