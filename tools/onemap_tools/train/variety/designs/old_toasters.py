"""Toasters of other times: a rounded one of the 1950s, one with flaps."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import Mesh, box, cylinder, ellipsoid, rounded_box
from onemap_simulator.generation.model import Model, assemble
from onemap_simulator.generation.sampler import Sampler
from onemap_tools.train.variety.designs.appliance_parts import (
    centred,
    extruded,
    feet,
    round_rect,
    rubber,
)
from onemap_tools.train.variety.designs.toaster_parts import CATEGORY, bread_slots, crust, lead


def rounded_toaster(sampler: Sampler) -> Model:
    """A 1950s loaf of metal: a rounded top, dark ends, lever and dial at one end."""
    width, depth, height = (
        sampler.size(0.24, 0.34),
        sampler.size(0.15, 0.2),
        sampler.size(0.17, 0.21),
    )
    low, end = 0.02, sampler.uniform(0.015, 0.03)
    top = sampler.uniform(0.03, depth * 0.4)
    outline = [(x, z + low) for x, z in round_rect(depth, height - low, 0.015, top)]
    body = [extruded(outline, width - 2 * end)]
    inner = [(x * 1.02, (z - low) * 1.01 + low) for x, z in outline]
    ends = [extruded(inner, end, side * (width - end) / 2) for side in (-1, 1)]
    gap = min(depth * 0.2, 0.04)
    at = [(0.0, -gap), (0.0, gap)] if sampler.chance(0.75) else [(0.0, 0.0)]
    slots, bread = bread_slots(sampler, width * 0.68, at, height + 0.004)
    side = width / 2
    lever = rounded_box(
        (0.03, 0.05, 0.018), (side + 0.012, 0, height * sampler.uniform(0.45, 0.8)), 0.006
    )
    track = box((0.006, 0.01, height * 0.5), (side, 0, low + height * 0.25))
    dial = (
        cylinder(0.018, 0.016, segments=12)
        .rotated("y", 90)
        .translated(side - 0.002, 0.0, low + 0.03)
    )
    foot = feet(width, depth, low + 0.006, 0.012)
    return centred(
        assemble(
            CATEGORY,
            (sampler.enamel(), body),
            (sampler.plastic(), [*ends, lever, dial]),
            (sampler.dark(), [*slots, track]),
            (rubber(sampler), [*foot, lead(depth, -width * 0.3)]),
            *([(crust(sampler), bread)] if bread else []),
        )
    )


def flap_toaster(sampler: Sampler) -> Model:
    """An antique with a flap on each side, one at times folded down with its slice of bread."""
    width, height = sampler.size(0.2, 0.28), sampler.size(0.17, 0.22)
    base_d, top_d = sampler.uniform(0.15, 0.19), sampler.uniform(0.06, 0.09)
    base = [rounded_box((width, base_d, 0.035), (0, 0, 0.015), 0.01)]
    half = width / 2 - 0.012
    frame = []
    for side in (-1, 1):
        outline = [
            (-base_d * 0.42, 0.045),
            (base_d * 0.42, 0.045),
            (top_d / 2, height),
            (-top_d / 2, height),
        ]
        frame.append(extruded(outline, 0.012, side * half))
    frame.append(rounded_box((width, top_d, 0.014), (0, 0, height - 0.004), 0.005))
    core = [box((width - 0.05, 0.03, height - 0.06), (0, 0, 0.048))]
    core += [box((width - 0.05, 0.034, 0.004), (0, 0, 0.06 + 0.02 * row)) for row in range(5)]
    flaps: list[Mesh] = []
    bread: list[Mesh] = []
    knobs: list[Mesh] = []
    lean = float(np.degrees(np.arctan2(base_d * 0.42 - top_d / 2, height - 0.045)))
    opened = sampler.choice([-1, 0, 1])
    for side in (-1, 1):
        angle = sampler.uniform(45, 75) if side == opened else -lean
        pieces = [box((width - 0.034, 0.005, height - 0.075), (0, 0, 0))]
        if sampler.chance(0.6):
            pieces += [
                box((width - 0.08, 0.008, 0.008), (0, 0, 0.025 + 0.025 * row)) for row in range(4)
            ]
        knob = [ellipsoid((0.014, 0.012, 0.012), (0, side * 0.012, height - 0.09), 8)]
        toast = [rounded_box((0.1, 0.014, 0.1), (0, -side * 0.012, 0.006), 0.006)]
        for group, parts in (
            (flaps, pieces),
            (knobs, knob),
            (bread, toast if side == opened else []),
        ):
            swung = [m.rotated("x", -side * angle) for m in parts]
            group += [m.translated(0, side * base_d * 0.44, 0.056) for m in swung]
    legs = feet(width + 0.04, base_d + 0.06, 0.018, 0.014)
    return centred(
        assemble(
            CATEGORY,
            (sampler.metal(), base + frame),
            (sampler.metal(), flaps),
            (sampler.dark(), core),
            (sampler.plastic(), [*knobs, *legs]),
            *([(crust(sampler), bread)] if bread else []),
        )
    )
