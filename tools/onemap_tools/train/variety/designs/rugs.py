"""Rugs: round, oval, runner, hide, fringed, patchwork, shaggy."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from onemap_shared.geometry import F64
from onemap_simulator.generation.mesh import Mesh, box, cone, cylinder, prism, tube
from onemap_simulator.generation.model import Material, Model, assemble
from onemap_simulator.generation.sampler import Sampler


def _ring(rx: float, ry: float, power: float, count: int = 32) -> F64:
    """A superellipse (count, 2): power 1 an ellipse, less is squarer."""
    a = np.linspace(0, 2 * np.pi, count, endpoint=False)
    x = np.sign(np.cos(a)) * np.abs(np.cos(a)) ** power
    y = np.sign(np.sin(a)) * np.abs(np.sin(a)) ** power
    return np.stack([rx * x, ry * y], axis=1)


def round_rug(sampler: Sampler) -> Model:
    """A round rug of rings, with a scalloped or plain edge or tassels all round."""
    r = sampler.size(0.5, 0.95)
    edge = sampler.integer(0, 2)
    a = np.linspace(0, 2 * np.pi, 48, endpoint=False)
    wave = r * (1 + (0.035 * np.abs(np.sin(8 * a)) if edge == 1 else 0.0 * a))
    groups = [
        (sampler.fabric(), [prism(np.stack([wave * np.cos(a), wave * np.sin(a)], axis=1), 0.01)])
    ]
    shares = np.linspace(0.88, 0.25, sampler.integer(1, 4))
    for k, share in enumerate(shares):
        groups.append(
            (sampler.fabric(), [cylinder(r * float(share), 0.013 + 0.003 * k, segments=32)])
        )
    if edge == 2:
        tassels = [
            cone((0.014, 0.006), 0.06, segments=5)
            .rotated("y", 90)
            .translated(r - 0.01, 0, 0.014)
            .rotated("z", float(t))
            for t in np.linspace(0, 360, 40, endpoint=False)
        ]
        groups.append((sampler.fabric(), tassels))
    return assemble("rug", *groups)


def oval_rug(sampler: Sampler) -> Model:
    """A braided oval rug: cords of two colours laid round and round."""
    rx, ry = sampler.size(0.55, 1.0), sampler.size(0.38, 0.6)
    cords: list[list[Mesh]] = [[], []]
    thick = sampler.uniform(0.012, 0.02)
    base = prism(_ring(rx - thick, ry - thick, 1.0), thick * 0.8)
    count, stripe = sampler.integer(5, 9), sampler.integer(1, 2)
    for k in range(count):
        flat = _ring(rx - thick, ry - thick, 1.0) * (1 - k / (count + 0.5))
        line = np.concatenate([flat, np.full((len(flat), 1), thick * 0.866)], axis=1)
        cords[k // stripe % 2].append(tube(line, thick, 6, closed=True))
    return assemble(
        "rug",
        (sampler.fabric(), [base]),
        (sampler.fabric(), cords[0]),
        (sampler.fabric(), cords[1]),
    )


def runner(sampler: Sampler) -> Model:
    """A long narrow runner: edge bands, cross stripes or diamonds, short fringes."""
    w, d = sampler.size(1.4, 2.2), sampler.size(0.5, 0.75)
    groups = [(sampler.fabric(), [box((w, d, 0.009))])]
    band = [box((w - 0.04, d * 0.08, 0.0115), (0, s * d * 0.4, 0)) for s in (-1, 1)]
    groups.append((sampler.fabric(), band))
    count = sampler.integer(3, 8)
    if sampler.chance(0.5):
        stripes = [
            box((w * 0.04, d * 0.66, 0.0115), (x * w, 0, 0))
            for x in np.linspace(-0.42, 0.42, count)
        ]
    else:
        half = min(w / count * 0.42, d * 0.3)
        stripes = [
            prism(_ring(half, d * 0.28, 1.0, 4), 0.0115, (x * w, 0, 0))
            for x in np.linspace(-0.4, 0.4, count)
        ]
    groups.append((sampler.fabric(), stripes))
    if sampler.chance(0.6):
        groups.append((sampler.pale(), _fringe(w, d, sampler.uniform(0.03, 0.07))))
    return assemble("rug", *groups)


def _fringe(w: float, d: float, length: float) -> list[Mesh]:
    """Threads at both short ends."""
    count = int(d / 0.03)
    return [
        box((length, 0.012, 0.005), (s * (w / 2 + length / 2 - 0.002), float(y), 0))
        for s in (-1, 1)
        for y in np.linspace(-d / 2 + 0.012, d / 2 - 0.012, count)
    ]


def hide(sampler: Sampler) -> Model:
    """A sheepskin or cow hide: an irregular outline with four leg lobes and a neck."""
    rx, ry = sampler.size(0.5, 0.95), sampler.size(0.4, 0.7)
    count = 64
    a = np.linspace(0, 2 * np.pi, count, endpoint=False)
    lobes = sampler.uniform(0.08, 0.28) * np.cos(4 * (a - np.pi / 4)) + sampler.uniform(
        0.0, 0.08
    ) * np.cos(a)
    rough = sum(
        sampler.uniform(-0.02, 0.02) * np.sin(k * a + sampler.uniform(0, 6)) for k in range(5, 12)
    )
    out = 1 + lobes + rough
    flat = np.stack([rx * out * np.cos(a), ry * out * np.sin(a)], axis=1)
    flat -= (flat.min(axis=0) + flat.max(axis=0)) / 2
    thick = sampler.uniform(0.01, 0.035)
    middle = flat.mean(axis=0)
    fur = [prism(flat, thick * 0.5), prism(middle + (flat - middle) * 0.93, thick)]
    groups = [(sampler.material("noise", 0.2, sampler.colour()), fur)]
    if sampler.chance(0.5):
        spots: list[Mesh] = []
        for _ in range(sampler.integer(3, 6)):
            at = (sampler.uniform(-0.45, 0.45) * rx, sampler.uniform(-0.4, 0.4) * ry, 0.0)
            blob = _ring(rx * sampler.uniform(0.1, 0.25), ry * sampler.uniform(0.1, 0.25), 1.0, 14)
            spots.append(prism(blob, thick + 0.0025 + 0.0005 * len(spots), at))
        groups.append((sampler.fabric(), spots))
    return assemble("rug", *groups)


def fringed_rug(sampler: Sampler) -> Model:
    """An oriental rug: nested borders, a medallion with corner pieces, fringes at its ends."""
    w, d = sampler.size(1.1, 2.0), sampler.size(0.8, 1.3)
    edge = sampler.uniform(0.08, 0.16)
    field: list[tuple[Material, list[Mesh]]] = [(sampler.fabric(), [box((w, d, 0.009))])]
    inset = [(w - edge, d - edge), (w - 2 * edge, d - 2 * edge), (w - 2.6 * edge, d - 2.6 * edge)]
    for k, (u, v) in enumerate(inset[: sampler.integer(2, 3)]):
        field.append((sampler.fabric(), [box((u, v, 0.0115 + 0.0025 * k))]))
    power = sampler.choice([1.0, 1.6, 2.0])
    medal = prism(_ring(w * 0.24, d * 0.26, power, 32), 0.02)
    inner = prism(_ring(w * 0.13, d * 0.14, power, 32), 0.0225)
    field += [(sampler.fabric(), [medal]), (sampler.fabric(), [inner])]
    field.append((sampler.pale(), _fringe(w, d, sampler.uniform(0.04, 0.09))))
    return assemble("rug", *field)


def patchwork_rug(sampler: Sampler) -> Model:
    """A patchwork of carpet pieces in three cloths, each a little raised, with seams between."""
    w, d = sampler.size(1.0, 1.9), sampler.size(0.8, 1.3)
    columns, rows = sampler.integer(3, 6), sampler.integer(2, 4)
    pieces: list[list[Mesh]] = [[], [], []]
    shift = sampler.chance(0.5)
    for j in range(rows):
        cuts = np.linspace(-w / 2, w / 2, columns + 1 + (j % 2 if shift else 0))
        y, deep = -d / 2 + d * (j + 0.5) / rows, d / rows - 0.012
        for left, right in pairwise(cuts):
            middle = (float(left + right) / 2, y, 0.0)
            tall = 0.011 + sampler.uniform(0.0, 0.006)
            pieces[sampler.integer(0, 2)].append(
                box((float(right - left) - 0.012, deep, tall), middle)
            )
    back = sampler.dark() if sampler.chance(0.5) else sampler.fabric()
    return assemble("rug", (back, [box((w, d, 0.008))]), *((sampler.fabric(), p) for p in pieces))


def shaggy_rug(sampler: Sampler) -> Model:
    """A deep-pile rug with rounded corners: tufts over all of it and beyond its edge."""
    rx, ry = sampler.size(0.5, 0.85), sampler.size(0.4, 0.65)
    pile, power = sampler.uniform(0.025, 0.045), sampler.choice([0.35, 0.5, 1.0])
    base = [prism(_ring(rx, ry, power, 40), pile * 0.5)]
    tufts = []
    for _ in range(190):
        x, y = sampler.uniform(-1, 1), sampler.uniform(-1, 1)
        if abs(x) ** (2 / power) + abs(y) ** (2 / power) > 0.97:
            continue
        tuft = cone((0.05, 0.012), pile * sampler.uniform(0.7, 1.1), segments=5)
        tuft = tuft.rotated("y", sampler.uniform(-12, 12)).translated(x * rx, y * ry, pile * 0.5)
        tufts.append(tuft)
    wool = sampler.material("noise", 0.12, sampler.colour())
    return assemble("rug", (wool, [*base, *tufts]))
