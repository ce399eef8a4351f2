"""Curtains: gathered pairs, tied back, sheer, blinds, cafe curtains, on rings; z = 0 is the hem."""

from __future__ import annotations

import numpy as np

from onemap_shared.geometry import F64
from onemap_simulator.generation.mesh import Mesh, box, cylinder, ellipsoid, from_faces, rod, torus
from onemap_simulator.generation.model import Material, Model, assemble
from onemap_simulator.generation.sampler import Sampler


def _cloth(left: F64, right: F64, heights: F64, pleats: int, deep: float) -> Mesh:
    """Pleated cloth between two edges x(z), with a front and a back; heights rise."""
    columns = pleats * 6 + 1
    t = np.linspace(0, 1, columns)
    wave = np.sin(2 * np.pi * pleats * t)
    x = left[:, None] + (right - left)[:, None] * t
    flare = 0.7 + 0.3 * (1 - (heights - heights[0]) / np.ptp(heights))
    y = deep * flare[:, None] * wave
    z = np.repeat(heights[:, None], columns, axis=1)
    front = np.stack([x, y - 0.002, z], axis=-1).reshape(-1, 3)
    back = np.stack([x, y + 0.002, z], axis=-1).reshape(-1, 3)
    rows, faces = len(heights), []
    for i in range(rows - 1):
        for j in range(columns - 1):
            a = i * columns + j
            b, c, d = a + 1, a + columns + 1, a + columns
            n = rows * columns
            faces += [(a, b, c), (a, c, d), (n + a, n + c, n + b), (n + a, n + d, n + c)]
    return from_faces(np.concatenate([front, back]), faces)


def _straight(x0: float, x1: float, height: float, pleats: int, deep: float) -> Mesh:
    z = np.array([0.0, height])
    return _cloth(np.full(2, x0), np.full(2, x1), z, pleats, deep)


def _rail(sampler: Sampler, width: float, z: float) -> tuple[Material, list[Mesh]]:
    """A pole with knobs, or a flat track, or a boxed pelmet."""
    kind, half = sampler.integer(0, 2), width / 2 + 0.06
    if kind == 0:
        bars = [rod((-half, 0, z), (half, 0, z), 0.014)]
        bars += [ellipsoid((0.03, 0.026, 0.026), (s * half, 0, z), 10) for s in (-1, 1)]
        bars += [box((0.02, 0.08, 0.02), (s * (half - 0.05), 0.04, z - 0.01)) for s in (-1, 1)]
        return sampler.metal() if sampler.chance(0.5) else sampler.wood(), bars
    if kind == 1:
        return sampler.pale(), [box((2 * half, 0.05, 0.025), (0, 0, z - 0.012))]
    return sampler.wood(), [box((2 * half, 0.16, sampler.uniform(0.1, 0.2)), (0, 0, z - 0.09))]


def gathered_pair(sampler: Sampler) -> Model:
    """A pair half drawn: two lengths of cloth with a gap between, under a pole or a pelmet."""
    w, h = sampler.size(0.9, 1.5), sampler.size(1.1, 2.2)
    share = sampler.uniform(0.22, 0.42)
    pleats, deep = sampler.integer(3, 6), sampler.uniform(0.03, 0.05)
    cloth = [
        _straight(-w / 2, -w / 2 + w * share, h, pleats, deep),
        _straight(w / 2 - w * share, w / 2, h, pleats, deep),
    ]
    return assemble("curtain", (sampler.fabric(), cloth), _rail(sampler, w, h + 0.015))


def tied_back(sampler: Sampler) -> Model:
    """Curtains tied back to the sides at waist height: narrow at the band, wide above and below."""
    w, h = sampler.size(0.9, 1.4), sampler.size(1.2, 2.2)
    z = np.linspace(0, h, 10)
    band = h * sampler.uniform(0.35, 0.5)
    reach = w * sampler.uniform(0.4, 0.5)
    above = np.clip((z - band) / (h - band), 0, 1) ** 0.7
    below = np.clip((band - z) / band, 0, 1) ** 0.5 * 0.45
    wide = 0.09 + (reach - 0.09) * np.where(z > band, above, below)
    pleats, deep = sampler.integer(3, 5), sampler.uniform(0.025, 0.04)
    sides = (-1, 1) if sampler.chance(0.75) else (1,)
    cloth, ties = [], []
    for s in sides:
        outer, inner = np.full(len(z), s * w / 2), s * (w / 2 - wide)
        left, right = (outer, inner) if s < 0 else (inner, outer)
        cloth.append(_cloth(left, right, z, pleats, deep))
        narrow = float(np.interp(band, z, wide))
        ties.append(
            box((narrow + 0.03, deep * 2 + 0.03, 0.06), (s * (w / 2 - narrow / 2), 0, band - 0.03))
        )
    if len(sides) == 1:
        cloth.append(_straight(-w / 2, -w / 2 + 0.16, h, 2, deep))
    return assemble(
        "curtain", (sampler.fabric(), cloth), (sampler.fabric(), ties), _rail(sampler, w, h + 0.015)
    )


def sheer(sampler: Sampler) -> Model:
    """A single thin sheer drawn right across, fine pleats, a heading tape and a weighted hem."""
    w, h = sampler.size(0.8, 1.5), sampler.size(0.9, 2.2)
    deep = sampler.uniform(0.012, 0.025)
    cloth = [_straight(-w / 2, w / 2, h, sampler.integer(10, 18), deep)]
    bands = [
        box((w, 2 * deep + 0.012, 0.03), (0, 0, h - 0.035)),
        box((w, 2 * deep + 0.01, 0.02), (0, 0, 0.0)),
    ]
    veil = sampler.pale() if sampler.chance(0.7) else sampler.fabric()
    return assemble(
        "curtain", (veil, cloth), (sampler.fabric(), bands), _rail(sampler, w, h + 0.01)
    )


def blind(sampler: Sampler) -> Model:
    """A roller or folded fabric blind: a roll or soft folds, a hem bar, a bead chain."""
    w, h = sampler.size(0.7, 1.3), sampler.size(0.6, 1.4)
    fabric = sampler.fabric()
    hard = [box((w * 1.0, 0.02, 0.022), (0, 0, 0))]
    cloth = []
    if sampler.chance(0.5):
        cloth.append(box((w - 0.02, 0.004, h - 0.01), (0, 0, 0.01)))
        cloth.append(
            cylinder(0.035, w - 0.02, (0, 0, -w / 2 + 0.01), 14)
            .rotated("y", 90)
            .translated(0, 0.025, h)
        )
        hard += [box((0.012, 0.09, 0.1), (s * (w / 2 + 0.002), 0.025, h - 0.05)) for s in (-1, 1)]
    else:
        folds = sampler.integer(3, 6)
        each = h / folds
        for k in range(folds):
            flap = box((w, 0.006, each * 1.04), (0, 0, 0)).rotated("x", sampler.uniform(5, 9))
            cloth.append(flap.translated(0, -0.01, k * each + 0.004))
        hard.append(box((w + 0.02, 0.06, 0.045), (0, 0.005, h - 0.01)))
    chain = [
        rod((w / 2 + 0.014, -0.01 + dy, h * 0.35), (w / 2 + 0.014, -0.01 + dy, h), 0.003, 4)
        for dy in (0.0, 0.03)
    ]
    return assemble(
        "curtain",
        (fabric, cloth),
        (sampler.pale() if sampler.chance(0.5) else sampler.metal(), [*hard, *chain]),
    )


def cafe_curtain(sampler: Sampler) -> Model:
    """A short cafe curtain hung from loops on a thin pole, with a frill or a valance above."""
    w, h = sampler.size(0.7, 1.2), sampler.size(0.45, 0.7)
    pleats, deep = sampler.integer(5, 10), sampler.uniform(0.015, 0.03)
    gap = sampler.uniform(0.0, 0.15) * w
    cloth = [
        _straight(-w / 2, -gap / 2, h, pleats, deep),
        _straight(gap / 2, w / 2, h, pleats, deep),
    ]
    top = h + 0.05
    loops = [
        box((0.04, 0.03, 0.07), (float(x), 0, h - 0.012))
        for x in np.linspace(-w / 2 + 0.03, w / 2 - 0.03, 9)
    ]
    bars = [rod((-w / 2 - 0.05, 0, top - 0.01), (w / 2 + 0.05, 0, top - 0.01), 0.01)]
    bars += [
        ellipsoid((0.018, 0.018, 0.018), (s * (w / 2 + 0.05), 0, top - 0.01), 8) for s in (-1, 1)
    ]
    if sampler.chance(0.5):
        high = h + sampler.uniform(0.3, 0.5)
        frill = _straight(-w / 2, w / 2, sampler.uniform(0.16, 0.26), pleats * 2, deep)
        cloth.append(frill.translated(0, 0, high - 0.2))
        bars.append(rod((-w / 2 - 0.05, 0, high + 0.02), (w / 2 + 0.05, 0, high + 0.02), 0.035))
        bars += [
            rod((s * (w / 2 + 0.04), 0.02, top), (s * (w / 2 + 0.04), 0.02, high), 0.006, 6)
            for s in (-1, 1)
        ]
    fabric = sampler.fabric()
    return assemble(
        "curtain",
        (fabric, cloth),
        (fabric if sampler.chance(0.5) else sampler.fabric(), loops),
        (sampler.metal(), bars),
    )


def ring_curtain(sampler: Sampler) -> Model:
    """One heavy curtain on wooden rings along a pole, drawn to a side or in full, contrast hem."""
    w, h = sampler.size(0.4, 0.9), sampler.size(1.1, 2.2)
    pleats, deep = sampler.integer(4, 8), sampler.uniform(0.035, 0.06)
    split = h * sampler.uniform(0.12, 0.3)
    low = _straight(-w / 2, w / 2, split, pleats, deep)
    high = _straight(-w / 2, w / 2, h - split, pleats, deep).translated(0, 0, split)
    z = h + 0.035
    rings = [
        torus(0.034, 0.007, segments=12).rotated("y", 90).translated(float(x), 0, z - 0.008)
        for x in np.linspace(-w / 2 + 0.02, w / 2 - 0.02, pleats + 1)
    ]
    half = w / 2 + sampler.uniform(0.06, 0.2)
    pole = [rod((-half, 0, z), (half, 0, z), 0.018)]
    pole += [ellipsoid((0.04, 0.034, 0.034), (s * half, 0, z), 10) for s in (-1, 1)]
    return assemble(
        "curtain",
        (sampler.fabric(), [high]),
        (sampler.fabric(), [low]),
        (sampler.wood(), pole),
        (sampler.metal() if sampler.chance(0.5) else sampler.wood(), rings),
    )
