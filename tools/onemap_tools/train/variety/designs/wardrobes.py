"""Wardrobes: cupboards for clothes in other constructions than the plain one with two doors."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from onemap_simulator.generation.mesh import Mesh, box
from onemap_simulator.generation.model import Model, assemble
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.joinery import (
    LEAF_M,
    case,
    grip,
    panelled,
    settled,
    shifted,
)
from onemap_tools.train.variety.designs.wardrobes_compound import COMPOUND_WARDROBES
from onemap_tools.train.variety.designs.wardrobes_open import OPEN_WARDROBES, inside_of
from onemap_tools.train.variety.designs.wardrobes_shaped import SHAPED_WARDROBES

NAME = "wardrobe"
GAP_M = 0.006


def sliding(sampler: Sampler) -> Model:
    """Two or three wide leaves that slide on two tracks, of bands or with a mirror strip."""
    leaves_n = sampler.integer(2, 3)
    width, depth = leaves_n * sampler.size(0.65, 0.95), sampler.size(0.58, 0.68)
    height, rim = sampler.size(1.95, 2.35), sampler.uniform(0.02, 0.05)
    body = case((width, depth, height), rim)
    body += [box((width - 2 * rim, 0.06, 0.04), (0, 0.05 - depth / 2, rim))]
    inner, low, tall = width - 2 * rim, rim + 0.045, height - 2 * rim - 0.05
    leaf_w = inner / leaves_n + 0.03
    frames: list[Mesh] = []
    plain: list[Mesh] = []
    accent: list[Mesh] = []
    pattern, shift = sampler.choice([(0, 1), (0, 0, 1), (0,), (1, 0, 0, 0)]), sampler.integer(0, 1)
    bands, upright = sampler.integer(1, 5), sampler.chance(0.3)
    for index in range(leaves_n):
        x = -inner / 2 + leaf_w / 2 + index * (inner - leaf_w) / (leaves_n - 1)
        if index == 0 and sampler.chance(0.35):
            x += leaf_w * sampler.uniform(0.1, 0.7)
        y = -depth / 2 + (0.035 if index % 2 else 0.075)
        edge = sampler.choice([0.02, 0.035])
        frames += [box((edge, 0.034, tall), (x + s * (leaf_w - edge) / 2, y, low)) for s in (-1, 1)]
        wide = leaf_w - 2 * edge
        for band in range(bands):
            size = (wide, 0.018, tall / bands - 0.008)
            at = (x, y, low + band * tall / bands + 0.004)
            if upright:
                size, at = (wide / bands - 0.004, 0.018, tall), (x, y, low)
                at = (x + (band - (bands - 1) / 2) * wide / bands, y, low)
            chosen = accent if pattern[(band + index * shift) % len(pattern)] else plain
            chosen.append(box(size, at))
        frames += [box((wide, 0.03, 0.03), (x, y, low + z)) for z in (0.0, tall - 0.03)]
    inside = inside_of(sampler, inner, depth - 0.18, height - 2 * rim - 0.05)
    inside = [(m, shifted(meshes, 0, 0.06, rim)) for m, meshes in inside]
    wood = sampler.wood()
    second = sampler.pale() if sampler.chance(0.5) else sampler.wood()
    first = wood if sampler.chance(0.4) else sampler.wood()
    return assemble(
        NAME,
        (wood, body),
        (sampler.metal(), frames),
        (first, plain),
        (second, accent),
        *inside,
    )


def louvred(sampler: Sampler) -> Model:
    """Doors of slanting slats in frames, some of them folding."""
    doors = sampler.integer(2, 4)
    each, depth = sampler.size(0.36, 0.5), sampler.size(0.48, 0.6)
    height, plinth = sampler.size(1.7, 2.2), sampler.uniform(0.03, 0.1)
    width = doors * each + 0.05
    wood, metal = sampler.wood(), sampler.metal()
    body = case((width, depth - LEAF_M, height - plinth), 0.025, plinth)
    body = shifted(body, 0, LEAF_M / 2)
    base = [box((width - 0.04, depth - 0.08, plinth), (0, 0.02, 0))]
    if sampler.chance(0.5):
        base.append(box((width + 0.05, depth + 0.03, 0.03), (0, 0, height)))
    held, tall, wide = grip(sampler), height - plinth - 0.03, each - GAP_M
    frame, slats = _louvres(wide, tall, sampler.integer(1, 2), sampler.uniform(0.05, 0.08))
    fold = sampler.uniform(25, 60) if sampler.chance(0.3) and doors % 2 == 0 else 0.0
    doors_frame: list[Mesh] = []
    doors_slats: list[Mesh] = []
    handles: list[Mesh] = []
    for index in range(doors):
        x, side = (index - (doors - 1) / 2) * each, 1 if index % 2 else -1
        turn, at = 0.0, (x, LEAF_M - depth / 2, plinth + 0.015)
        if index < 2 and fold:  # the first pair, folded outwards
            shift = wide / 2 * np.cos(np.radians(fold))
            start = -doors * each / 2
            turn = side * fold
            at = (
                start + shift * (3 if index else 1),
                LEAF_M - depth / 2 - wide / 2 * float(np.sin(np.radians(fold))),
                at[2],
            )
        doors_frame += [m.rotated("z", turn).translated(*at) for m in frame]
        doors_slats += [m.rotated("z", turn).translated(*at) for m in slats]
        mine = held.at(-side * (wide / 2 - 0.035), -LEAF_M, tall * 0.48)
        handles += [m.rotated("z", turn).translated(*at) for m in mine]
    leaf = wood if sampler.chance(0.5) else sampler.wood()
    slat = leaf if sampler.chance(0.6) else sampler.wood()
    inside = inside_of(sampler, width - 0.06, depth - 0.1, height - plinth - 0.05) if fold else []
    return settled(
        assemble(
            NAME,
            (wood, [*body, *base]),
            (leaf, doors_frame),
            (slat, doors_slats),
            (metal, handles),
            *((m, shifted(meshes, 0, 0.02, plinth + 0.025)) for m, meshes in inside),
        )
    )


def _louvres(width: float, height: float, rows: int, rail: float) -> tuple[list[Mesh], list[Mesh]]:
    """The frame and the slats of one louvred leaf."""
    frame, panels = panelled(width, height, rows, rail)
    pitch = max(0.045, height / 38)
    slats = []
    for row in range(rows):
        cell = (height - rail) / rows
        for z in np.arange(row * cell + rail + 0.01, (row + 1) * cell - 0.03, pitch):
            slat = box((width - 2 * rail, 0.006, pitch * 1.05)).rotated("x", 25)
            slats.append(slat.translated(0, -0.012, float(z)))
    return frame, slats + panels


def flat_pack(sampler: Sampler) -> Model:
    """Plain smooth leaves of unlike widths without handles, only gaps between them."""
    doors = sampler.integer(1, 4)
    widths = [sampler.choice([0.4, 0.5, 0.6]) * sampler.uniform(0.85, 1.05) for _ in range(doors)]
    board, depth, height = 0.018, sampler.size(0.5, 0.62), sampler.size(1.7, 2.36)
    width, plinth = sum(widths) + 2 * board, sampler.choice([0.0, 0.06, 0.1])
    inset = sampler.chance(0.3)
    body = case((width, depth - LEAF_M, height - plinth), board, plinth)
    body = shifted(body, 0, LEAF_M / 2)
    body += [box((width - 0.04, 0.018, plinth), (0, 0.06 - depth / 2, 0))] if plinth else []
    body += [
        box((board, depth - 0.1, plinth), (s * (width / 2 - board), 0.03, 0))
        for s in (-1, 1)
        if plinth
    ]
    plain: list[Mesh] = []
    other: list[Mesh] = []
    x, split = -sum(widths) / 2, sampler.choice([0.0, 0.0, 0.3, 0.62])
    front = -depth / 2 + LEAF_M / 2 + (0.018 if inset else 0.0)
    low, tall = plinth + 0.004, height - plinth - 0.008
    grooves = sampler.chance(0.3)
    for index, wide in enumerate(widths):
        chosen = other if sampler.chance(0.3) else plain
        cuts = [0.0, split, 1.0] if split and index % 2 == 0 else [0.0, 1.0]
        for start, end in pairwise(cuts):
            size = (wide - 0.005, LEAF_M - 0.004, (end - start) * tall - 0.005)
            chosen.append(box(size, (x + wide / 2, front, low + start * tall)))
        if grooves:
            strips = int(wide / 0.05)
            plain += [
                box(
                    (0.03, 0.008, tall - 0.05),
                    (x + (k + 0.5) * wide / strips, front - 0.012, low + 0.02),
                )
                for k in range(strips)
            ]
        x += wide
    wood = sampler.wood()
    leaf = wood if sampler.chance(0.5) else sampler.plastic()
    return assemble(NAME, (wood, body), (leaf, plain), (sampler.wood(), other))


DESIGNS: dict[str, tuple[ModelFactory, ...]] = {
    NAME: (sliding, louvred, flat_pack, *OPEN_WARDROBES, *COMPOUND_WARDROBES, *SHAPED_WARDROBES)
}
