"""Cups with a handle: mugs, tea and espresso cups, travel and enamel mugs."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import (
    ORIGIN,
    Mesh,
    Vec,
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

Profile = list[tuple[float, float]]
Path = list[tuple[float, float, float]]


def vessel(outer: Profile, wall: float, floor: float, at: Vec = ORIGIN, sides: int = 18) -> Mesh:
    """An open vessel: the outside from the foot up, then an inside ``wall`` within it."""
    inner = [(max(r - wall, 0.004), z) for r, z in reversed(outer) if z > floor]
    return lathe([*outer, *inner, (0.0, floor)], at, sides)


def _ear(radius: float, low: float, high: float, reach: float, thick: float) -> Mesh:
    """A round handle in the x z plane, its ends within a wall at ``radius``."""
    angle = np.linspace(-np.pi / 2, np.pi / 2, 8)
    middle, half = (low + high) / 2, (high - low) / 2
    x = radius - 0.3 * thick + reach * np.cos(angle)
    return tube(np.stack([x, 0 * x, middle + half * np.sin(angle)], axis=1), thick, 8)


def _square_ear(radius: float, low: float, high: float, reach: float) -> list[Mesh]:
    """An angular handle of three flat bars."""
    thick = 0.014
    out = radius + reach
    bars = [
        box((reach + 0.012, 0.02, thick), ((radius + out) / 2 - 0.006, 0, z))
        for z in (low, high - thick)
    ]
    return [*bars, box((thick, 0.02, high - low), (out, 0, low))]


def drink(sampler: Sampler, radius: float, z: float) -> tuple[Material, list[Mesh]]:
    """The surface of coffee, tea or milk at height z."""
    colour = sampler.choice([(0.2, 0.11, 0.06), (0.6, 0.35, 0.12), (0.85, 0.8, 0.7)])
    return sampler.material("plain", 0.5, colour), [cylinder(radius, 0.004, (0, 0, z), 16)]


def mug(sampler: Sampler) -> Model:
    """A mug: straight, barrel, conical or waisted, with a round, square or no-frills handle."""
    h, r = sampler.size(0.1, 0.14), sampler.size(0.045, 0.062)
    shares = sampler.choice(
        [(1, 1, 1, 1), (0.8, 1.05, 1.08, 0.9), (0.7, 0.8, 0.9, 1), (0.95, 0.78, 0.8, 1.05)]
    )
    levels = (0.0, 0.35, 0.65, 1.0)
    outer = [(r * s, h * k) for s, k in zip(shares, levels, strict=True)]
    outer.insert(0, (outer[0][0] * 0.9, 0.0))
    outer[1] = (outer[1][0], 0.006)
    body = vessel(outer, 0.006, 0.012)
    at = r * min(shares[1], shares[2])
    if sampler.chance(0.35):
        ear = _square_ear(at - 0.002, h * 0.25, h * 0.8, h * 0.3)
    else:
        ear = [_ear(at, h * 0.2, h * 0.82, h * sampler.uniform(0.25, 0.42), 0.008)]
    glaze = sampler.ceramic() if sampler.chance(0.5) else sampler.plastic()
    groups = [(glaze, [body])]
    groups.append((glaze if sampler.chance(0.7) else sampler.plastic(), ear))
    if sampler.chance(0.35):
        edge = torus(r * shares[3] - 0.003, 0.005, (0, 0, h), 18)
        groups.append((sampler.plastic(), [edge]))
    if sampler.chance(0.6):
        inner = float(np.interp(h * 0.78, [k * h for k in levels], [r * s for s in shares]))
        groups.append(drink(sampler, inner - 0.007, h * 0.78))
    return assemble("cup", *groups)


def tea_cup(sampler: Sampler) -> Model:
    """A wide tea cup with a thin ear on a saucer, at times with a spoon on it."""
    h, r = sampler.size(0.06, 0.085), sampler.size(0.05, 0.065)
    foot, lift = r * sampler.uniform(0.4, 0.6), 0.012
    round_side = sampler.uniform(0.75, 0.92)
    outer = [(foot, 0.0), (foot * 0.9, h * 0.1), (r * round_side, h * 0.45), (r, h)]
    cup = [vessel(outer, 0.004, h * 0.14, (0, 0, lift), 20)]
    cup.append(_ear(r * round_side, h * 0.35, h * 0.9, h * 0.42, 0.005).translated(0, 0, lift))
    s = r * sampler.uniform(1.5, 1.9)
    lip = sampler.uniform(0.016, 0.028)
    saucer = lathe(
        [
            (s * 0.5, 0),
            (s * 0.55, 0.004),
            (s, lip),
            (s, lip + 0.004),
            (s * 0.55, 0.011),
            (0, 0.011),
        ],
        segments=20,
    )
    glaze = sampler.ceramic() if sampler.chance(0.6) else sampler.plastic()
    groups = [(glaze, cup), (glaze if sampler.chance(0.7) else sampler.plastic(), [saucer])]
    if sampler.chance(0.7):
        inner = r * (0.33 * round_side + 0.67) - 0.005
        groups.append(drink(sampler, inner, lift + h * 0.82))
    if sampler.chance(0.5):
        y = -s * 0.72
        spoon = [rod((-s * 0.5, y, lip + 0.004), (s * 0.55, y, lip + 0.008), 0.003, 6)]
        spoon.append(ellipsoid((0.018, 0.012, 0.004), (-s * 0.5, y, lip + 0.005), 8))
        groups.append((sampler.metal(), spoon))
    return assemble("cup", *groups)


def espresso_cup(sampler: Sampler) -> Model:
    """A small thick espresso cup on a deep or a square saucer."""
    h, r = sampler.size(0.055, 0.07), sampler.size(0.034, 0.042)
    lift = 0.008
    outer = [(r * 0.6, 0.0), (r * 0.92, h * 0.3), (r, h * 0.7), (r * 1.02, h)]
    cup = [vessel(outer, 0.006, 0.014, (0, 0, lift), 16)]
    if sampler.chance(0.6):
        cup.append(_ear(r * 0.95, h * 0.3, h * 0.85, h * 0.35, 0.0055).translated(0, 0, lift))
    else:
        grip = rounded_box((0.03, 0.012, 0.01), (r + 0.01, 0, lift + h * 0.6), 0.004)
        cup.append(grip)
    s = r * sampler.uniform(1.6, 1.9)
    if sampler.chance(0.5):
        plate = rounded_box((s * 1.9, s * 1.7, 0.012), ORIGIN, 0.005)
    else:
        plate = lathe([(s * 0.7, 0), (s, 0.014), (s * 0.97, 0.018), (s * 0.6, 0.009), (0, 0.009)])
    glaze = sampler.ceramic() if sampler.chance(0.5) else sampler.plastic()
    plate_glaze = glaze if sampler.chance(0.5) else sampler.wood()
    return assemble(
        "cup", (glaze, cup), (plate_glaze, [plate]), drink(sampler, r * 0.84, lift + h * 0.8)
    )


def travel_mug(sampler: Sampler) -> Model:
    """A travel mug: a tall tapered body with a grip band, a lid with a mouthpiece, or a handle."""
    h, r = sampler.size(0.15, 0.2), sampler.size(0.038, 0.046)
    low = r * sampler.uniform(0.72, 1.0)
    body = lathe([(low, 0), (low * 1.02, 0.01), (r, h * 0.85)], segments=18)
    at = [low + (r - low) * k + 0.003 for k in (0.4, 0.72)]
    band = lathe([(at[0], h * 0.34), (at[1], h * 0.64)], segments=18)
    lid = [lathe([(r * 1.06, h * 0.84), (r * 1.06, h * 0.92), (r * 0.9, h * 0.97)], segments=18)]
    lid.append(rounded_box((r * 0.7, r * 0.5, 0.014), (0, -r * 0.5, h * 0.96), 0.005))
    if sampler.chance(0.4):
        lid.append(rounded_box((0.012, r * 1.2, 0.012), (0, 0, h * 0.97), 0.004))
    black = [band]
    if sampler.chance(0.5):
        black.append(_ear(r * 0.97, h * 0.3, h * 0.8, h * 0.2, 0.008))
    skin = sampler.metal() if sampler.chance(0.6) else sampler.plastic()
    return assemble("cup", (skin, [body]), (sampler.dark(), black), (sampler.plastic(), lid))


def enamel_cup(sampler: Sampler) -> Model:
    """A sheet metal camping cup with a rolled rim and a broad handle."""
    h, r = sampler.size(0.075, 0.1), sampler.size(0.045, 0.055)
    outer = [(r * 0.9, 0), (r * 0.96, 0.006), (r, h)]
    ear = [_ear(r - 0.002, h * 0.2, h * 0.88, h * 0.36, 0.006).scaled(1.0, 1.8, 1.0)]
    rim = torus(r, 0.004, (0, 0, h), 20)
    cup = vessel(outer, 0.003, 0.006, ORIGIN, 20)
    groups = [(sampler.enamel(), [cup, *ear]), (sampler.metal(), [rim])]
    if sampler.chance(0.5):
        groups.append(drink(sampler, r * 0.92, h * 0.75))
    return assemble("cup", *groups)
