"""Bottles for use: sports, spray, detergent and vacuum flasks."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import (
    box,
    cone,
    cylinder,
    lathe,
    rounded_box,
    tube,
)
from onemap_simulator.generation.model import Model, assemble
from onemap_simulator.generation.sampler import Sampler
from onemap_tools.train.variety.designs.bottles import label_around


def sports_bottle(sampler: Sampler) -> Model:
    """A sports bottle with a finger waist, a wide collar and a pull spout or a carrying loop."""
    h, r = sampler.size(0.19, 0.27), sampler.size(0.034, 0.044)
    waist = sampler.uniform(0.72, 0.95)
    at = h * sampler.uniform(0.4, 0.55)
    body = [(r * 0.9, 0), (r, 0.01), (r, at - 0.03), (r * waist, at), (r, at + 0.03)]
    body += [(r, h * 0.74), (r * 0.9, h * 0.78)]
    lid = [lathe([(r * 1.04, h * 0.77), (r * 1.04, h * 0.85), (r * 0.5, h * 0.9)], segments=18)]
    spout = []
    if sampler.chance(0.6):
        spout.append(cone((r * 0.35, r * 0.28), h * 0.07, (0, 0, h * 0.89), 12))
        spout.append(cylinder(r * 0.38, h * 0.035, (0, 0, h * 0.955), 12))
    else:
        angle = np.linspace(0, np.pi, 8)
        loop = np.stack([r * 0.75 * np.cos(angle), 0 * angle, h * 0.86 + h * 0.13 * np.sin(angle)])
        spout.append(tube(loop.T, 0.006))
    band = [label_around(r, h * 0.08, at - 0.04)] if sampler.chance(0.5) else []
    skin = sampler.metal() if sampler.chance(0.4) else sampler.plastic()
    return assemble(
        "bottle",
        (skin, [lathe(body, segments=18)]),
        (sampler.plastic(), lid),
        (sampler.dark(), [*spout, *band]),
    )


def spray_bottle(sampler: Sampler) -> Model:
    """A cleaner's trigger spray: a flat or round flask, a collar, a nozzle head and a trigger."""
    h, r = sampler.size(0.15, 0.2), sampler.size(0.036, 0.045)
    flat = sampler.uniform(0.6, 1.0)
    waist = sampler.uniform(0.7, 1.0)
    body = [
        (r * 0.95, 0),
        (r, 0.012),
        (r * waist, h * 0.45),
        (r * 0.95, h * 0.66),
        (r * 0.4, h * 0.95),
        (r * 0.36, h),
    ]
    flask = lathe(body, segments=18).scaled(1.0, flat, 1.0)
    collar = cylinder(r * 0.46, 0.022, (0, 0, h - 0.006), 12)
    top = h + 0.012
    head = [
        box((r * 1.9, 0.022, 0.024), (-r * 0.25, 0, top + 0.018)),
        cylinder(0.011, 0.02, (0, 0, top), 10),
        rounded_box((r * 1.0, 0.026, 0.016), (r * 0.25, 0, top + 0.035), 0.006),
    ]
    tip = [cylinder(0.009, 0.014, segments=8).rotated("y", -90).translated(-r * 1.2, 0, top + 0.03)]
    lever = [(-r * 0.75, 0, top + 0.02), (-r * 0.8, 0, top - 0.01), (-r * 1.0, 0, top - 0.045)]
    label = lathe(
        [(r * 1.01, h * 0.1), (r * waist * 1.02, h * 0.45), (r * 0.97, h * 0.6)], segments=18
    ).scaled(1.0, flat, 1.0)
    return assemble(
        "bottle",
        (sampler.plastic(), [flask]),
        (sampler.fabric(), [label]),
        (sampler.plastic(), [collar, *head]),
        (sampler.dark(), [*tip, tube(lever, 0.006)]),
    )


def detergent_bottle(sampler: Sampler) -> Model:
    """A flat detergent flask with rounded shoulders, a moulded grip and a big measuring cap."""
    w, h = sampler.size(0.11, 0.16), sampler.size(0.18, 0.25)
    d = w * sampler.uniform(0.5, 0.7)
    flask = [rounded_box((w, d, h * 0.72), (0, 0, 0), d * 0.35)]
    flask.append(
        lathe(
            [(w * 0.42, h * 0.68), (w * 0.28, h * 0.82), (w * 0.16, h * 0.86)], segments=16
        ).scaled(1.0, d / w * 1.1, 1.0)
    )
    cap = [cylinder(w * sampler.uniform(0.17, 0.22), h * 0.16, (0, 0, h * 0.85), 16)]
    if sampler.chance(0.6):
        x = w * 0.48
        grip = [
            (x - 0.02, 0, h * 0.18),
            (x + 0.035, 0, h * 0.24),
            (x + 0.04, 0, h * 0.5),
            (w * 0.2, 0, h * 0.8),
        ]
        flask.append(tube(grip, 0.013, 8))
    label = box((w * 0.7, d + 0.004, h * 0.4), (-w * 0.05, 0, h * 0.14))
    return assemble(
        "bottle", (sampler.plastic(), flask), (sampler.plastic(), cap), (sampler.fabric(), [label])
    )


def thermos(sampler: Sampler) -> Model:
    """A vacuum flask: a straight steel body, a cup as its lid, a ring and often a handle."""
    h, r = sampler.size(0.25, 0.34), sampler.size(0.04, 0.055)
    body = lathe([(r * 0.97, 0), (r, 0.008), (r, h * 0.7), (r * 0.8, h * 0.76)], segments=18)
    trim = [
        cylinder(r * 1.03, h * 0.04, (0, 0, 0.001), 18),
        cylinder(r * 0.84, h * 0.03, (0, 0, h * 0.75), 18),
    ]
    lid = [lathe([(r * 0.86, h * 0.77), (r * 0.72, h * 0.96), (r * 0.6, h)], segments=18)]
    if sampler.chance(0.6):
        x = r - 0.004
        grip = [
            (x, 0, h * 0.25),
            (x + 0.035, 0, h * 0.29),
            (x + 0.035, 0, h * 0.58),
            (x, 0, h * 0.63),
        ]
        trim.append(tube(grip, 0.009, 6))
    if sampler.chance(0.4):
        trim.append(label_around(r, h * 0.15, h * 0.5))
    skin = sampler.metal() if sampler.chance(0.5) else sampler.fabric()
    return assemble(
        "bottle",
        (skin, [body]),
        (sampler.dark(), trim),
        (sampler.metal() if sampler.chance(0.5) else sampler.plastic(), lid),
    )
