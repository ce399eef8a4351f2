"""Baskets: wicker, laundry, rope, wire, hamper and shopping baskets."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from onemap_simulator.generation.mesh import (
    Mesh,
    box,
    cylinder,
    ellipsoid,
    lathe,
    rod,
    rounded_box,
    torus,
    tube,
)
from onemap_simulator.generation.model import Material, Model, assemble
from onemap_simulator.generation.sampler import Sampler


def _straw(sampler: Sampler) -> Material:
    hue = sampler.uniform(0.6, 1.1)
    straw = (0.78 * hue, 0.6 * hue, 0.36 * hue) if sampler.chance(0.5) else sampler.colour()
    return sampler.material(sampler.choice(["weave", "checks", "zigzag"]), 0.12, straw)


def _linen(sampler: Sampler, w: float, d: float, z: float) -> list[tuple[Material, list[Mesh]]]:
    """A heap of folded and crumpled cloth that shows above the rim."""
    soft = [
        ellipsoid((w * 0.3, d * 0.32, 0.06), (x * w * 0.18, y * d * 0.15, z), 10)
        for x, y in ((-1, 0.3), (1, -0.4), (0, 0.8))
    ]
    return [(sampler.fabric(), soft[:2]), (sampler.pale(), soft[2:])]


def _courses(low: float, high: float, height: float, rows: int, bulge: float) -> Mesh:
    """A round open body of coils, one above the other."""
    outer = []
    for row in range(rows):
        r = low + (high - low) * (row + 0.5) / rows
        z, step = height * row / rows, height / rows
        outer += [(r - bulge, z), (r, z + step * 0.3), (r, z + step * 0.7)]
    outer.append((high - bulge, height))
    inner = [(high - 2.2 * bulge, height), (low - 2.2 * bulge, 0.02), (0.0, 0.02)]
    return lathe([*outer, *inner], segments=18)


def handle_basket(sampler: Sampler) -> Model:
    """A picnic or market basket: woven tub, thick plaited rim, one high hoop over it."""
    w, h = sampler.size(0.18, 0.25), sampler.size(0.15, 0.24)
    oval = sampler.uniform(0.6, 1.0)
    low = w * sampler.uniform(0.65, 0.9)
    body = _courses(low, w, h, sampler.integer(4, 7), 0.008).scaled(1.0, oval, 1.0)
    rims = [torus(w - 0.008, 0.014, (0, 0, h), 20).scaled(1.0, oval, 1.0)]
    rise = h * sampler.uniform(0.8, 1.4)
    angle = np.linspace(0, np.pi, 13)
    arch = np.stack(
        [(w - 0.01) * np.cos(angle), 0 * angle, h - 0.03 + rise * np.sin(angle)], axis=1
    )
    rims.append(tube(arch, 0.012))
    groups = [(_straw(sampler), [body]), (sampler.wood(), rims)]
    if sampler.chance(0.4):
        lid = ellipsoid((w * 0.95, w * oval * 0.95, 0.04), (0, 0, h), 16)
        groups.append((sampler.fabric(), [lid]))
    return assemble("basket", *groups)


def laundry_basket(sampler: Sampler) -> Model:
    """A tall round laundry basket with a knobbed lid, or open and full of washing."""
    r, h = sampler.size(0.18, 0.24), sampler.size(0.45, 0.62)
    low, belly = r * sampler.uniform(0.75, 1.0), r * sampler.uniform(1.0, 1.15)
    outer = [(low, 0), ((low + belly) / 2, h * 0.2), (belly, h * 0.55), (r, h)]
    inner = [(r - 0.015, h), (belly - 0.015, h * 0.55), (low - 0.015, 0.02), (0, 0.02)]
    hoops = [torus(x + 0.002, 0.009, (0, 0, z + 0.009), 20) for x, z in (outer[0], (r, h - 0.009))]
    hoops.append(torus(belly + 0.002, 0.007, (0, 0, h * 0.55), 20))
    weave = _straw(sampler)
    groups: list[tuple[Material, list[Mesh]]] = [(weave, [lathe([*outer, *inner], segments=20)])]
    groups.append((sampler.wood(), hoops))
    for side in (-1, 1):
        slot = box((0.03, 0.1, 0.03), (side * (belly * 0.4 + r * 0.6 - 0.004), 0, h * 0.82))
        groups.append((groups[1][0], [slot]))
    if sampler.chance(0.6):
        lid = [(r + 0.012, h + 0.008), (r + 0.012, h + 0.025), (r * 0.5, h + 0.045), (0, h + 0.05)]
        groups.append((weave, [lathe(lid, segments=20)]))
        groups.append((sampler.wood(), [ellipsoid((0.025, 0.025, 0.02), (0, 0, h + 0.06), 10)]))
    else:
        groups += _linen(sampler, r * 1.7, r * 1.7, h - 0.01)
    return assemble("basket", *groups)


def rope_basket(sampler: Sampler) -> Model:
    """A basket coiled of thick rope in two colours, with two rope ears, at times with a throw."""
    r, h = sampler.size(0.16, 0.24), sampler.size(0.22, 0.36)
    rows = sampler.integer(7, 11)
    step = (h - 0.02) / rows
    thick = step * 0.58
    belly = sampler.uniform(0.0, 0.15)
    parts: tuple[list[Mesh], list[Mesh]] = ([], [])
    split = sampler.integer(2, rows - 2)
    for row in range(rows):
        share = (row + 0.5) / rows
        ring = r * (0.88 + belly * float(np.sin(np.pi * share)) + 0.1 * share)
        parts[int(row >= split)].append(torus(ring, thick, (0, 0, step * row + thick * 0.866), 16))
    parts[0].append(cylinder(r * 0.9, 0.012, (0, 0, thick * 0.5), 16))
    angle = np.linspace(0, np.pi, 7)
    for side in (-1, 1):
        y, z = 0.07 * np.cos(angle), h - 0.03 + 0.07 * np.sin(angle)
        parts[1].append(tube(np.stack([0 * y + side * r, y, z], axis=1), 0.011))
    groups = [(sampler.fabric(), parts[0]), (sampler.fabric(), parts[1])]
    if sampler.chance(0.5):
        groups += _linen(sampler, r * 1.6, r * 1.6, h - 0.03)
    return assemble("basket", *groups)


def wire_basket(sampler: Sampler) -> Model:
    """A square wire basket with wooden or wire grips, empty or with linen in it."""
    w, d, h = sampler.size(0.3, 0.45), sampler.size(0.24, 0.34), sampler.size(0.18, 0.3)
    low = sampler.uniform(0.75, 1.0)
    wires: list[Mesh] = []
    for k in np.linspace(0.0, 1.0, sampler.integer(3, 5)):
        s = low + (1 - low) * float(k)
        z = 0.006 + float(k) * (h - 0.006)
        corners = [
            (x * w * s / 2, y * d * s / 2, z) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))
        ]
        thick = 0.006 if k in (0.0, 1.0) else 0.0035
        wires += [
            rod(a, b, thick, 6) for a, b in zip(corners, [*corners[1:], corners[0]], strict=True)
        ]
    for x in np.linspace(-0.5, 0.5, sampler.integer(6, 10)):
        path = [
            (x * w, -d / 2, h),
            (x * w * low, -d * low / 2, 0.006),
            (x * w * low, d * low / 2, 0.006),
            (x * w, d / 2, h),
        ]
        wires += [rod(a, b, 0.003, 4) for a, b in pairwise(path)]
    for y in np.linspace(-0.35, 0.35, sampler.integer(4, 6)):
        path = [
            (-w / 2, y * d, h),
            (-w * low / 2, y * d * low, 0.006),
            (w * low / 2, y * d * low, 0.006),
            (w / 2, y * d, h),
        ]
        wires += [rod(a, b, 0.003, 4) for a, b in pairwise(path)]
    grips = []
    for s in (-1, 1):
        for y in (-0.06, 0.06):
            wires.append(rod((s * w / 2, y, h), (s * (w / 2 + 0.01), y, h + 0.05), 0.004, 6))
        grips.append(
            rod(
                (s * (w / 2 + 0.01), -0.075, h + 0.05), (s * (w / 2 + 0.01), 0.075, h + 0.05), 0.011
            )
        )
    groups = [(sampler.metal(), wires), (sampler.wood(), grips)]
    if sampler.chance(0.5):
        towels = [
            rounded_box((w * 0.8, d * 0.75, 0.055), (0, 0, 0.012 + k * 0.057), 0.025)
            for k in range(sampler.integer(2, 4))
        ]
        groups += [(sampler.fabric(), towels[::2]), (sampler.pale(), towels[1::2])]
    return assemble("basket", *groups)


def hamper(sampler: Sampler) -> Model:
    """A square hamper: woven panels in a frame, a flat lid, closed or ajar, straps or a bag rim."""
    w, d, h = sampler.size(0.34, 0.5), sampler.size(0.28, 0.36), sampler.size(0.3, 0.6)
    weave, frame = _straw(sampler), sampler.wood()
    body = [box((w - 0.02, d - 0.02, h - 0.015), (0, 0, 0.012))]
    posts = [
        box((0.028, 0.028, h), (x * (w / 2 - 0.012), y * (d / 2 - 0.012), 0))
        for x in (-1, 1)
        for y in (-1, 1)
    ]
    posts += [
        box((w - 0.04, 0.012, 0.03), (0, s * (d / 2 - 0.008), z))
        for s in (-1, 1)
        for z in (0.02, h - 0.035)
    ]
    tilt = sampler.choice([0.0, 0.0, sampler.uniform(12, 60)])
    lid = rounded_box((w + 0.02, d + 0.02, 0.035), (0, -d / 2 - 0.01, 0), 0.012)
    lid = lid.rotated("x", -tilt).translated(0, d / 2 + 0.01, h + 0.002)
    groups = [(weave, [*body, lid]), (frame, posts)]
    if tilt > 0.0:
        groups += _linen(sampler, w * 0.85, d * 0.8, h)
    elif sampler.chance(0.6):
        straps = [
            box((0.03, 0.006, h * 0.35), (x * w, -d / 2 - 0.012, h * 0.66)) for x in (-0.25, 0.25)
        ]
        straps += [box((0.03, d + 0.032, 0.005), (x * w, 0, h + 0.037)) for x in (-0.25, 0.25)]
        groups.append((sampler.material("leather", 0.3, sampler.colour()), straps))
    for side in (-1, 1):
        x, z = side * (w / 2 + 0.002), h * 0.72
        ear = [
            (x - side * 0.02, -0.06, z),
            (x + side * 0.03, -0.045, z + 0.012),
            (x + side * 0.03, 0.045, z + 0.012),
            (x - side * 0.02, 0.06, z),
        ]
        groups.append((frame, [tube(ear, 0.009)]))
    return assemble("basket", *groups)


def washing_basket(sampler: Sampler) -> Model:
    """A plastic washing basket: an oblong tub of vertical bars under a broad rim."""
    w, d, h = sampler.size(0.5, 0.62), sampler.size(0.36, 0.44), sampler.size(0.22, 0.3)
    angle = np.linspace(0, 2 * np.pi, 25)[:-1]
    power = sampler.uniform(0.5, 0.9)
    x = np.sign(np.cos(angle)) * np.abs(np.cos(angle)) ** power
    y = np.sign(np.sin(angle)) * np.abs(np.sin(angle)) ** power
    low = sampler.uniform(0.75, 0.9)
    ring = np.stack([x * w / 2, y * d / 2, 0 * x], axis=1)
    skin = [
        tube(ring * (s, s, 1) + (0, 0, z), t, 6, closed=True)
        for s, z, t in ((low, 0.0122, 0.014), ((1 + low) / 2, h / 2, 0.008), (1.0, h, 0.018))
    ]
    skin += [
        rod(tuple(p * (low, low, 1) + (0, 0, 0.012)), tuple(p + (0, 0, h)), 0.009, 4) for p in ring
    ]
    skin.append(rounded_box((w * low * 0.8, d * low * 0.8, 0.012), (0, 0, 0.004), 0.005))
    groups = [(sampler.plastic(), skin)]
    if sampler.chance(0.7):
        groups += _linen(sampler, w * 0.9, d * 0.9, h * 0.85)
        heap = ellipsoid((w * low * 0.42, d * low * 0.42, h * 0.45), (0, 0, h * 0.48), 14)
        groups.append((sampler.fabric(), [heap]))
    return assemble("basket", *groups)
