"""Kitchen appliances; those of the kitchen row are as deep and high as the cabinets."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.furniture.kitchen import COUNTER_M, DEPTH_M, FRONT_Y
from onemap_simulator.generation.furniture.storage import handle_bar
from onemap_simulator.generation.mesh import (
    Mesh,
    box,
    cylinder,
    lathe,
    rod,
    rounded_box,
    torus,
    tube,
)
from onemap_simulator.generation.model import (
    Material,
    Model,
    SupportSurface,
    assemble,
    support_surface,
)
from onemap_simulator.generation.sampler import Sampler


def oven(sampler: Sampler) -> Model:
    """A cooker: hob with four rings on top, knobs, a door with a dark window and a handle bar."""
    width = sampler.size(0.56, 0.62)
    casing, dark, metal = sampler.enamel(), sampler.dark(), sampler.metal()
    y, top = FRONT_Y, COUNTER_M
    body = [box((width, DEPTH_M - 0.04, top - 0.03), (0, 0.02, 0))]
    door_low, door_high = sampler.size(0.16, 0.24), 0.72
    body.append(
        rounded_box((width - 0.03, 0.05, door_high - door_low), (0, y + 0.025, door_low), 0.01)
    )
    plate = [box((width, DEPTH_M, 0.03), (0, 0, top - 0.03))]
    glass = [
        box((width * 0.68, 0.01, (door_high - door_low) * 0.55), (0, y - 0.004, door_low + 0.09))
    ]
    hob, knobs = [], []
    for x in (-0.14, 0.14):
        for depth in (-0.13, 0.13):
            radius = sampler.uniform(0.07, 0.1)
            hob.append(cylinder(radius, 0.018, (x, depth, top), 16))
            knobs.append(torus(radius * 0.7, 0.008, (x, depth, top + 0.02), 14))
    for x in np.linspace(-width * 0.36, width * 0.36, sampler.integer(4, 6)):
        knob = cylinder(0.022, 0.035, segments=10).rotated("x", 90)
        knobs.append(knob.translated(float(x), y + 0.02, 0.8))
    bar = [handle_bar(sampler, width * 0.8, (0, y - 0.02, door_high - 0.06), False)]
    if sampler.chance(0.4):
        body.append(box((width, 0.03, 0.14), (0, DEPTH_M / 2 - 0.015, top)))
    return assemble(
        "oven",
        (casing, body),
        (dark if sampler.chance(0.6) else sampler.metal(), plate),
        (dark, [*glass, *hob]),
        (metal, [*bar, *knobs]),
    )


def dishwasher(sampler: Sampler, worktop: Material) -> Model:
    """A flush front with a control strip, a long handle and a plinth, under a worktop."""
    width = sampler.size(0.56, 0.61)
    y = FRONT_Y
    casing, dark, metal = sampler.enamel(), sampler.dark(), sampler.metal()
    body = [box((width, DEPTH_M - 0.04, 0.84), (0, 0.02, 0.02))]
    door = [rounded_box((width - 0.015, 0.04, 0.6), (0, y + 0.02, 0.12), 0.008)]
    strip = [box((width - 0.015, 0.04, 0.11), (0, y + 0.02, 0.74))]
    lamps = [box((0.02, 0.01, 0.012), (x, y - 0.003, 0.79)) for x in (0.08, 0.12, 0.16, 0.2)]
    screen = [box((0.1, 0.01, 0.04), (-0.15, y - 0.003, 0.775)), box((width, 0.5, 0.1), (0, 0, 0))]
    bar = [handle_bar(sampler, width * 0.85, (0, y - 0.015, 0.69), False)]
    board = box((width, DEPTH_M + 0.02, 0.04), (0, 0, COUNTER_M - 0.04))
    second = dark if sampler.chance(0.5) else sampler.metal()
    return assemble(
        "dishwasher",
        (casing, [*body, *door]),
        (second, strip),
        (sampler.pale(), lamps),
        (dark, screen),
        (metal, bar),
        (worktop, [board]),
        support_surfaces=(SupportSurface(-width / 2, -0.2, width / 2, 0.26, COUNTER_M),),
    )


def refrigerator(sampler: Sampler) -> Model:
    """A tall box split into two doors, above each other or side by side, with long handles."""
    width, depth, height = (
        sampler.size(0.58, 0.72),
        sampler.size(0.6, 0.68),
        sampler.size(1.6, 1.95),
    )
    casing, metal = sampler.enamel(), sampler.metal()
    y = -depth / 2
    body = [box((width, depth - 0.07, height - 0.05), (0, 0.035, 0.05))]
    leaves, handles = [], []
    if width > 0.66 and sampler.chance(0.5):
        for side in (-1, 1):
            size = (width / 2 - 0.01, 0.07, height - 0.06)
            leaves.append(rounded_box(size, (side * width / 4, y + 0.035, 0.06), 0.015))
            at = (side * 0.05, y - 0.01, height * 0.55)
            handles.append(handle_bar(sampler, height * 0.4, at, True))
    else:
        split = height * sampler.choice([0.35, 0.62, 0.68])
        side = sampler.choice([-1, 1])
        for low, high in ((0.06, split - 0.008), (split + 0.008, height)):
            leaves.append(rounded_box((width, 0.07, high - low), (0, y + 0.035, low), 0.02))
            near = low + 0.26 if high > height - 0.01 else high - 0.26
            handles.append(
                handle_bar(sampler, 0.32, (side * (width / 2 - 0.06), y - 0.01, near), True)
            )
    gasket = box((width - 0.02, depth - 0.1, height - 0.07), (0, 0.02, 0.06))
    feet = box((width - 0.06, depth - 0.12, 0.06), (0, 0, 0))
    return assemble(
        "refrigerator",
        (casing, [*body, *leaves]),
        (metal, handles),
        (sampler.dark(), [gasket, feet]),
    )


def microwave(sampler: Sampler) -> Model:
    """A box with a dark window on the left, a keypad on the right and a handle between."""
    width, depth, height = (
        sampler.size(0.46, 0.54),
        sampler.size(0.32, 0.38),
        sampler.size(0.27, 0.32),
    )
    y, pad = -depth / 2, width * 0.24
    casing, dark = sampler.enamel(), sampler.dark()
    body = [rounded_box((width, depth, height), (0, 0, 0.015), 0.015)]
    window = [box((width - pad - 0.06, 0.012, height - 0.08), (-pad / 2 - 0.005, y, 0.055))]
    keypad = [box((pad - 0.03, 0.012, height - 0.06), (width / 2 - pad / 2, y, 0.045))]
    keys = [
        box((0.018, 0.012, 0.014), (width / 2 - pad / 2 + dx, y - 0.006, 0.07 + row * 0.032))
        for dx in (-0.028, 0.0, 0.028)
        for row in range(4)
    ]
    screen = box((pad * 0.6, 0.012, 0.03), (width / 2 - pad / 2, y - 0.006, height - 0.06))
    bar = handle_bar(sampler, height * 0.75, (width / 2 - pad - 0.012, y, height / 2 + 0.015), True)
    grey = sampler.material("plain", 0.5, sampler.grey(0.2, 0.5))
    return assemble(
        "microwave",
        (casing, body),
        (dark, window),
        (grey, keypad),
        (sampler.pale(), [*keys, screen]),
        (sampler.metal(), [bar]),
        support_surfaces=(support_surface(width, depth, height + 0.015),),
    )


def kettle(sampler: Sampler) -> Model:
    """A kettle: round belly, spout in front, arched handle or a grip behind, a knob on the lid."""
    radius, height = sampler.size(0.095, 0.12), sampler.size(0.19, 0.26)
    skin = sampler.enamel() if sampler.chance(0.6) else sampler.metal()
    dark = sampler.dark()
    waist = sampler.uniform(0.55, 0.85)
    profile = [
        (radius * 0.95, 0.0),
        (radius, height * 0.1),
        (radius * sampler.uniform(0.9, 1.05), height * 0.5),
        (radius * waist, height * 0.85),
        (radius * waist * 0.8, height * 0.92),
        (0.03, height),
    ]
    body = [lathe(profile, segments=16)]
    spout = rod((radius * 0.75, 0, height * 0.45), (radius * 1.65, 0, height * 0.88), 0.024)
    grip: list[Mesh] = [lathe([(0.012, 0), (0.022, 0.02), (0.015, 0.035)], (0, 0, height), 8)]
    if sampler.chance(0.5):
        angle = np.linspace(0, np.pi, 9)
        arch = [(radius * 0.85 * np.cos(a), 0.0, height * 0.8 + 0.13 * np.sin(a)) for a in angle]
        grip.append(tube(arch, 0.013))
    else:
        x = -radius * 0.8
        points = [(x, 0, height * 0.9), (x - 0.09, 0, height * 0.95), (x - 0.1, 0, height * 0.4)]
        grip.append(tube([*points, (x, 0, height * 0.2)], 0.014))
    if sampler.chance(0.5):
        grip.append(cylinder(radius * 1.05, 0.02, (0, 0, -0.0), 16))
    return assemble("kettle", (skin, [*body, spout]), (dark if sampler.chance(0.7) else skin, grip))


def toaster(sampler: Sampler) -> Model:
    """A rounded box with two slots on top, toast in them at times, a lever at one end."""
    width, depth, height = (
        sampler.size(0.28, 0.36),
        sampler.size(0.16, 0.2),
        sampler.size(0.18, 0.22),
    )
    skin, dark = sampler.enamel(), sampler.dark()
    body = [rounded_box((width, depth, height), (0, 0, 0.015), 0.045)]
    slots = [
        box((width * 0.7, 0.03, 0.012), (0, side * depth * 0.2, height + 0.008)) for side in (-1, 1)
    ]
    base = box((width * 0.95, depth * 0.95, 0.03))
    lever = box((0.03, 0.05, 0.022), (width / 2 + 0.01, 0, height * 0.65))
    dial = (
        cylinder(0.022, 0.02, segments=10).rotated("y", 90).translated(width / 2, 0, height * 0.3)
    )
    groups = [(skin, body), (dark, [*slots, base, lever, dial])]
    if sampler.chance(0.6):
        crust = sampler.material("noise", 0.2, (0.78, 0.55, 0.28), (0.5, 0.3, 0.12))
        slices = [
            rounded_box((width * 0.4, 0.022, 0.11), (0, side * depth * 0.2, height - 0.03), 0.01)
            for side in (-1, 1)
        ]
        groups.append((crust, slices))
    return assemble("toaster", *groups)
