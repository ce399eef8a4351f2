"""Microwaves: with keypad, dials, a glass front, retro."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import Mesh, box, cylinder, rounded_box
from onemap_simulator.generation.model import Model, assemble, support_surface
from onemap_simulator.generation.sampler import Sampler
from onemap_tools.train.variety.designs.appliance_parts import (
    disc,
    feet,
    grip,
    round_rect,
    rubber,
    slab,
)
from onemap_tools.train.variety.designs.microwave_parts import (
    CATEGORY,
    door_window,
    side_vents,
    sizes,
)


def keypad(sampler: Sampler) -> Model:
    """A box with a door, a keypad or dial beside it under a small screen, and an opening key."""
    width, depth, height = sizes(sampler)
    y, low = -depth / 2, 0.014
    pad = width * sampler.uniform(0.18, 0.28)
    casing = [rounded_box((width, depth - 0.03, height), (0, 0.015, low), 0.008)]
    door_x = -pad / 2
    door = [rounded_box((width - pad - 0.004, 0.032, height), (door_x, y + 0.016, low), 0.008)]
    inner = (width - pad - 0.07, height * sampler.uniform(0.55, 0.78))
    glass = door_window(sampler, *inner, (door_x - 0.008, y + 0.002, low + (height - inner[1]) / 2))
    side_x = width / 2 - pad / 2
    board = [rounded_box((pad - 0.002, 0.032, height), (side_x, y + 0.017, low), 0.006)]
    glass.append(box((pad * 0.72, 0.006, 0.032), (side_x, y, low + height - 0.06)))
    keys: list[Mesh] = []
    if sampler.chance(0.55):
        for row in range(sampler.integer(3, 5)):
            for dx in (-0.3, 0.0, 0.3):
                z = low + height - 0.095 - row * 0.028
                keys.append(box((pad * 0.24, 0.006, 0.018), (side_x + dx * pad, y, z)))
    else:
        keys.append(disc(pad * 0.3, 0.024, (side_x, y + 0.003, low + height * 0.5), 16))
        keys += [
            box((pad * 0.7, 0.006, 0.014), (side_x, y, low + height * 0.26 - 0.024 * i))
            for i in (0, 1)
        ]
    if sampler.chance(0.5):
        handles = [box((pad * 0.78, 0.012, 0.034), (side_x, y - 0.001, low + 0.012))]
    else:
        at = (width / 2 - pad - 0.022, y, low + height / 2)
        handles = grip(sampler, height * sampler.uniform(0.5, 0.9), at, True)
    dark = feet(width, depth, low + 0.004, 0.014) + side_vents(sampler, width, depth, height)
    return assemble(
        CATEGORY,
        (sampler.enamel(), casing),
        (sampler.enamel(), door),
        (sampler.dark(), glass),
        (sampler.enamel(), board),
        (sampler.pale(), keys),
        (sampler.metal(), handles),
        (rubber(sampler), dark),
        support_surfaces=(support_surface(width, depth, height + low),),
    )


def dials(sampler: Sampler) -> Model:
    """A simple one: two big dials one above the other, a printed scale, a push button."""
    width, depth, height = sizes(sampler)
    y, low = -depth / 2, 0.016
    pad, side = width * sampler.uniform(0.2, 0.28), sampler.choice([1, 1, 1, -1])
    casing = [rounded_box((width, depth, height), (0, 0, low), sampler.uniform(0.008, 0.03))]
    x = side * (width / 2 - pad / 2)
    door_w = width - pad - 0.02
    frame = [rounded_box((door_w, 0.024, height - 0.02), (-side * pad / 2, y, low + 0.01), 0.01)]
    tall = height * sampler.uniform(0.55, 0.75)
    at = (-side * pad / 2, y - 0.01, low + (height - tall) / 2)
    glass = door_window(sampler, door_w * sampler.uniform(0.66, 0.85), tall, at)
    knobs, rims = [], []
    radius = pad * sampler.uniform(0.22, 0.32)
    for z in (0.76, 0.42):
        rims.append(disc(radius * 1.3, 0.004, (x, y + 0.001, low + height * z), 18))
        knobs.append(disc(radius, 0.026, (x, y, low + height * z), 14))
        blade = box((0.01, 0.02, radius * 1.8), (0, 0, -radius * 0.9)).rotated(
            "y", sampler.uniform(0, 90)
        )
        knobs.append(blade.translated(x, y - 0.03, low + height * z))
    knobs.append(rounded_box((pad * 0.75, 0.018, 0.036), (x, y - 0.004, low + 0.022), 0.008))
    dark = feet(width, depth, low + 0.01, 0.014) + side_vents(sampler, width, depth, height)
    return assemble(
        CATEGORY,
        (sampler.enamel(), casing),
        (sampler.enamel(), frame),
        (sampler.dark(), glass),
        (sampler.metal(), knobs),
        (sampler.pale(), rims),
        (rubber(sampler), dark),
        support_surfaces=(support_surface(width, depth, height + low),),
    )


def glass_front(sampler: Sampler) -> Model:
    """A flat black glass front whole width, a control strip below or above, a level handle."""
    width, depth, height = (
        sampler.size(0.46, 0.6),
        sampler.size(0.32, 0.44),
        sampler.size(0.27, 0.38),
    )
    y, low, band = -depth / 2, 0.012, sampler.uniform(0.045, 0.075)
    below = sampler.chance(0.5)
    casing = [box((width, depth - 0.025, height), (0, 0.0125, low))]
    door_z = low + band + 0.003 if below else low
    tall = height - band - 0.003
    glass = [rounded_box((width, 0.028, tall), (0, y + 0.014, door_z), 0.005)]
    strip_z = low if below else low + height - band
    strip = [rounded_box((width, 0.03, band), (0, y + 0.014, strip_z), 0.006)]
    z = strip_z + band / 2
    keys = [disc(0.018, 0.022, (sampler.choice([-1, 1, 0]) * width * 0.36, y, z), 14)]
    keys += [disc(0.007, 0.006, (x * width, y, z), 8) for x in np.linspace(-0.26, -0.1, 4)]
    screen = [box((0.1, 0.006, band * 0.5), (width * 0.12, y - 0.001, z - band * 0.25))]
    pull = (0.0, y, door_z + tall - 0.03)
    handles = grip(sampler, width * sampler.uniform(0.5, 0.92), pull, False)
    inner = round_rect(width * 0.8, tall * 0.56, 0.01, 0.01)
    screen.append(slab(inner, 0.006, (0, y + 0.003, door_z + tall * 0.16)))
    dark = feet(width, depth, low + 0.004, 0.014) + side_vents(sampler, width, depth, height)
    return assemble(
        CATEGORY,
        (sampler.enamel(), casing),
        (sampler.dark(), glass),
        (sampler.enamel(), strip),
        (sampler.metal(), keys),
        (sampler.dark(), screen),
        (sampler.metal(), handles),
        (rubber(sampler), dark),
        support_surfaces=(support_surface(width, depth, height + low),),
    )


def retro_microwave(sampler: Sampler) -> Model:
    """Round corners like an old radio, chrome rim, two knobs, an arched handle, splayed feet."""
    width, depth, height = sizes(sampler)
    y, low = -depth / 2, sampler.uniform(0.015, 0.03)
    corner = sampler.uniform(0.03, 0.09)
    casing = [
        slab(round_rect(width, height, corner * 0.7, corner), depth - 0.03, (0, depth / 2, low))
    ]
    face = round_rect(width - 0.02, height - 0.02, corner * 0.6, corner * 0.9)
    front = [slab(face, 0.02, (0, y + 0.035, low + 0.01))]
    pad = width * 0.25
    opening = round_rect(width - pad - 0.05, height - 0.06, 0.03, 0.03)
    x = -pad / 2
    rim = [slab(opening, 0.014, (x, y + 0.017, low + 0.03))]
    tall = height - 0.11
    glass = [
        slab(round_rect(width - pad - 0.1, tall, 0.025, 0.025), 0.006, (x, y + 0.005, low + 0.055))
    ]
    at = (width / 2 - pad - 0.035, y + 0.004, low + height / 2)
    chrome = grip(sampler, height * 0.55, at, True)
    side = width / 2 - pad / 2 - 0.008
    for z in (0.3, 0.56):
        chrome.append(disc(0.026, 0.03, (side, y + 0.017, low + height * z), 14))
        chrome.append(disc(0.034, 0.006, (side, y + 0.017, low + height * z), 16))
    if sampler.chance(0.6):
        glass.append(disc(0.026, 0.006, (side, y + 0.017, low + height * 0.82), 16))
    else:
        glass.append(box((0.07, 0.01, 0.03), (side, y + 0.013, low + height * 0.77)))
    legs = [
        cylinder(0.016, low + 0.012, (sx * width * 0.36, sy * depth * 0.34, 0), 8)
        for sx in (-1, 1)
        for sy in (-1, 1)
    ]
    flat = width - 2 * corner
    return assemble(
        CATEGORY,
        (sampler.enamel(), casing),
        (sampler.enamel(), front),
        (sampler.metal(), rim),
        (sampler.dark(), glass),
        (sampler.metal(), chrome),
        (rubber(sampler), legs),
        support_surfaces=(support_surface(flat, depth, height + low),),
    )
