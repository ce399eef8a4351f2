"""Cups without a handle: tumblers, paper cups and stemmed glasses."""

from __future__ import annotations

from onemap_simulator.generation.mesh import (
    ORIGIN,
    cylinder,
    lathe,
    rod,
    torus,
)
from onemap_simulator.generation.model import Model, assemble
from onemap_simulator.generation.sampler import Sampler
from onemap_tools.train.variety.designs.cups import drink, vessel


def tumbler(sampler: Sampler) -> Model:
    """A drinking glass without a handle: tapered or many-sided, with a thick bottom."""
    h, r = sampler.size(0.09, 0.16), sampler.size(0.036, 0.05)
    low = r * sampler.uniform(0.68, 1.0)
    sides = sampler.choice([6, 8, 10, 20])
    bead = sampler.chance(0.4)
    outer = [(low, 0.0)]
    for k in range(1, 6):
        bump = 0.003 * (k % 2) if bead else 0.0
        outer.append((low + (r - low) * k / 5 + bump, h * k / 5))
    groups = [
        (
            sampler.pale() if sampler.chance(0.5) else sampler.plastic(),
            [vessel(outer, 0.004, 0.016, ORIGIN, sides)],
        )
    ]
    if sampler.chance(0.6):
        groups.append(drink(sampler, min(low, r) * 0.86, h * sampler.uniform(0.4, 0.75)))
    if sampler.chance(0.3):
        straw = rod((-low * 0.5, 0, 0.02), (r * 0.8, 0, h * 1.45), 0.003, 6)
        groups.append((sampler.plastic(), [straw]))
    return assemble("cup", *groups)


def paper_cup(sampler: Sampler) -> Model:
    """A paper coffee cup with a sleeve, closed by a raised plastic lid or with a rolled rim."""
    h, r = sampler.size(0.1, 0.17), sampler.size(0.04, 0.052)
    low = r * sampler.uniform(0.66, 0.78)
    outer = [(low, 0.0), (r, h)]
    groups = [
        (
            sampler.pale() if sampler.chance(0.5) else sampler.fabric(),
            [vessel(outer, 0.003, 0.008), torus(r, 0.003, (0, 0, h), 18)],
        )
    ]
    if sampler.chance(0.75):
        bottom, top = h * 0.28, h * 0.72
        wide = [low + (r - low) * z / h + 0.003 for z in (bottom, top)]
        sleeve = lathe([(wide[0], bottom), (wide[1], top)], segments=18)
        groups.append((sampler.material("noise", 0.2, (0.62, 0.45, 0.28)), [sleeve]))
    if sampler.chance(0.75):
        rim = [(r * 1.06, h - 0.004), (r * 1.07, h + 0.007), (r * 0.96, h + 0.009)]
        rise = sampler.uniform(0.012, 0.02)
        lid = lathe(
            [*rim, (r * 0.9, h + rise), (r * 0.8, h + rise), (r * 0.76, h + 0.009), (0, h + 0.009)],
            segments=18,
        )
        groups.append((sampler.dark() if sampler.chance(0.5) else sampler.pale(), [lid]))
    else:
        groups.append(drink(sampler, r * 0.9, h * 0.85))
    return assemble("cup", *groups)


def goblet(sampler: Sampler) -> Model:
    """A stemmed glass: wine, flute, coupe or a knobbed goblet."""
    h = sampler.size(0.15, 0.21)
    wide, share = sampler.choice([(0.042, 0.5), (0.026, 0.62), (0.052, 0.3), (0.046, 0.45)])
    r = wide * sampler.uniform(0.9, 1.15)
    z0 = h * (1 - share)
    foot = sampler.uniform(0.03, 0.038)
    close = sampler.uniform(0.75, 1.0)
    outer = [(foot, 0.0), (foot, 0.004), (0.007, 0.014), (0.005, z0 * 0.45)]
    knob = [(0.012, z0 * 0.55), (0.005, z0 * 0.65)] if sampler.chance(0.4) else []
    cup = [(0.006, z0), (r * 0.8, z0 + 0.2 * (h - z0)), (r, z0 + 0.5 * (h - z0)), (r * close, h)]
    inner = [(r * close - 0.003, h), (r - 0.004, z0 + 0.5 * (h - z0)), (0.0, z0 + 0.01)]
    glass = lathe([*outer, *knob, *cup, *inner], segments=18)
    groups = [(sampler.pale() if sampler.chance(0.6) else sampler.metal(), [glass])]
    if sampler.chance(0.6):
        wine = sampler.material("plain", 0.5, sampler.choice([(0.4, 0.03, 0.1), (0.9, 0.8, 0.4)]))
        level = cylinder(r * 0.9, 0.004, (0, 0, z0 + 0.5 * (h - z0)), 18)
        groups.append((wine, [level]))
    return assemble("cup", *groups)
