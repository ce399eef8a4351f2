"""Dishwashers: with a control strip, behind a kitchen panel, small free-standing."""

from __future__ import annotations

from onemap_simulator.generation.mesh import Mesh, box, cylinder, rounded_box, torus
from onemap_simulator.generation.model import Model, SupportSurface, assemble
from onemap_simulator.generation.sampler import Sampler
from onemap_tools.train.variety.designs.appliance_parts import disc, feet, grip, rubber, slats
from onemap_tools.train.variety.designs.dishwasher_parts import (
    CATEGORY,
    DEPTH_M,
    FRONT_Y,
    TOP_M,
    controls,
    top_surface,
    worktop,
)


def striped(sampler: Sampler) -> Model:
    """Free-standing: a control strip above a plain or pressed door, a handle, a toe kick."""
    width = sampler.choice([sampler.size(0.44, 0.47), sampler.size(0.56, 0.61)])
    y, low = FRONT_Y, sampler.uniform(0.08, 0.14)
    band = sampler.uniform(0.07, 0.14)
    top = TOP_M - 0.05
    casing = [box((width, DEPTH_M - 0.05, top - 0.03), (0, 0.025, 0.03))]
    door = [rounded_box((width - 0.006, 0.04, top - band - low - 0.01), (0, y + 0.02, low), 0.01)]
    strip = [rounded_box((width - 0.006, 0.045, band - 0.006), (0, y + 0.018, top - band), 0.006)]
    buttons, dark = controls(sampler, width, y - 0.005, top - band / 2)
    z = top - band
    hands: list[Mesh] = []
    kind = sampler.integer(0, 2)
    if kind == 0:
        hands = grip(sampler, width * sampler.uniform(0.4, 0.85), (0, y, z - 0.06), False)
    elif kind == 1:
        dark.append(box((width * 0.36, 0.012, 0.045), (0, y - 0.002, z - 0.055)))
        hands.append(box((width * 0.37, 0.02, 0.014), (0, y - 0.004, z - 0.018)))
    else:
        hands.append(rounded_box((width * 0.5, 0.035, 0.03), (0, y - 0.006, z - 0.02), 0.012))
    if sampler.chance(0.35):
        inner = (width * 0.84, 0.02, (z - low) * 0.6)
        door.append(rounded_box(inner, (0, y + 0.004, low + (z - low) * 0.12), 0.009))
    kick = [box((width - 0.01, 0.02, low - 0.03), (0, y + 0.05, 0.015))]
    if sampler.chance(0.5):
        kick += slats(width * 0.8, low - 0.05, (0, y + 0.038, 0.025), 3)
    kick += feet(width, DEPTH_M - 0.1, 0.035)
    return assemble(
        CATEGORY,
        (sampler.enamel(), casing + door),
        (sampler.enamel(), strip),
        (sampler.pale(), buttons),
        (sampler.dark(), dark),
        (sampler.metal(), hands),
        (rubber(sampler), kick),
        (sampler.wood(), worktop(sampler, width)),
        support_surfaces=top_surface(width),
    )


def integrated(sampler: Sampler) -> Model:
    """Behind a kitchen front: wooden panel, toe kick, controls in the door's upper edge."""
    width, y, low = sampler.size(0.56, 0.61), FRONT_Y, sampler.uniform(0.09, 0.15)
    top = TOP_M - 0.05
    casing = [box((width, DEPTH_M - 0.07, top - low), (0, 0.035, low))]
    band = sampler.uniform(0.05, 0.11) if sampler.chance(0.65) else 0.022
    z = top - band
    panel = [box((width - 0.008, 0.022, z - low - 0.01), (0, y + 0.012, low + 0.004))]
    if sampler.chance(0.5):
        rail, tall = 0.06, z - low - 0.01
        panel += [
            box((width - 0.008, 0.02, rail), (0, y, low + 0.004 + h)) for h in (0, tall - rail)
        ]
        panel += [
            box(
                (rail, 0.02, tall - 2 * rail),
                (x * (width - 0.008 - rail) / 2, y, low + 0.004 + rail),
            )
            for x in (-1, 1)
        ]
    strip = [box((width - 0.008, 0.05, band - 0.008), (0, y + 0.03, z))]
    buttons, dark = (
        controls(sampler, width, y + 0.005, z + band / 2 - 0.004) if band > 0.04 else ([], [])
    )
    hands = grip(sampler, width * sampler.uniform(0.25, 0.8), (0, y - 0.008, z - 0.06), False)
    dark.append(box((width - 0.01, 0.02, top - low), (0, y + 0.05, low)))
    kick = [box((width, DEPTH_M - 0.12, low), (0, 0.05, 0))]
    if sampler.chance(0.4):
        dark.append(box((0.03, 0.004, 0.012), (width * 0.35, y + 0.109, low * 0.5)))
    return assemble(
        CATEGORY,
        (sampler.wood(), panel),
        (sampler.enamel(), casing),
        (sampler.metal(), strip),
        (sampler.pale(), buttons),
        (sampler.dark(), dark),
        (sampler.metal(), hands),
        (sampler.wood(), kick),
        (sampler.wood(), worktop(sampler, width)),
        support_surfaces=top_surface(width),
    )


def compact(sampler: Sampler) -> Model:
    """Old and portable: a slim body on castors, a big dial, a latch in the strip."""
    width, depth = sampler.size(0.44, 0.6), sampler.size(0.54, 0.62)
    height, low, y = sampler.size(0.84, 0.92), 0.07, -depth / 2
    casing = [rounded_box((width, depth - 0.05, height - low - 0.03), (0, 0.025, low), 0.02)]
    band = sampler.uniform(0.12, 0.18)
    z = height - 0.045 - band
    split = low + 0.16 if sampler.chance(0.6) else low + 0.01
    door = [rounded_box((width - 0.01, 0.05, z - split - 0.008), (0, y + 0.03, split), 0.02)]
    if split > low + 0.1:
        door.append(rounded_box((width - 0.01, 0.04, 0.14), (0, y + 0.035, low + 0.006), 0.012))
    strip = [rounded_box((width - 0.01, 0.06, band), (0, y + 0.03, z), 0.012)]
    bright = [disc(0.042, 0.03, (width * 0.24, y + 0.002, z + band / 2), 16)]
    bright.append(box((0.012, 0.04, 0.07), (width * 0.24, y - 0.014, z + band / 2 - 0.035)))
    bright += [
        box((0.03, 0.018, 0.04), (-width * 0.38 + i * 0.042, y - 0.004, z + band * 0.3))
        for i in range(sampler.integer(3, 5))
    ]
    bright.append(rounded_box((0.16, 0.03, 0.035), (0, y - 0.006, z + 0.012), 0.012))
    top = [rounded_box((width + 0.01, depth, 0.032), (0, 0, height - 0.032), 0.012)]
    wheels = [
        torus(0.02, 0.012, segments=12)
        .rotated("y", 90)
        .translated(x * (width / 2 - 0.06), deep, 0.032)
        for x in (-1, 1)
        for deep in (y + 0.1, depth / 2 - 0.06)
    ]
    wheels += [
        cylinder(0.01, 0.045, (x * (width / 2 - 0.06), deep, 0.03), 8)
        for x in (-1, 1)
        for deep in (y + 0.1, depth / 2 - 0.06)
    ]
    return assemble(
        CATEGORY,
        (sampler.enamel(), casing + door),
        (sampler.enamel(), strip),
        (sampler.metal(), bright),
        (sampler.wood(), top),
        (sampler.dark(), wheels),
        support_surfaces=(
            SupportSurface(-width / 2, y + 0.08, width / 2, depth / 2 - 0.04, height),
        ),
    )
