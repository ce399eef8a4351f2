"""Microwaves with the door open, or framed in a kitchen unit."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import Mesh, box, lathe, rounded_box
from onemap_simulator.generation.model import Model, assemble, support_surface
from onemap_simulator.generation.sampler import Sampler
from onemap_tools.train.variety.designs.appliance_parts import (
    centred,
    disc,
    feet,
    grip,
    rubber,
    shell,
    turned,
)
from onemap_tools.train.variety.designs.microwave_parts import CATEGORY, door_window, sizes


def open_microwave(sampler: Sampler) -> Model:
    """The door stands open: a cavity with a turntable and a bowl, cup or plate on it."""
    width, depth, height = sizes(sampler)
    y, low, pad = -depth / 2, 0.014, width * sampler.uniform(0.2, 0.27)
    x0, x1 = -width / 2, width / 2 - pad
    casing = shell((x0, y + 0.004, low), (x1, depth / 2, low + height), 0.025)
    casing.append(box((pad, depth, height), (width / 2 - pad / 2, 0, low)))
    middle, wide = (x0 + x1) / 2, x1 - x0
    radius = min(wide, depth) * 0.36
    plate = [
        lathe(
            [(0.03, 0), (radius, 0.006), (radius, 0.014), (0.01, 0.01)], (middle, 0, low + 0.03), 20
        )
    ]
    dish: list[Mesh] = []
    where = (middle, -0.01, low + 0.045)
    kind = sampler.integer(0, 2)
    if kind == 0:
        dish.append(lathe([(0.03, 0), (0.065, 0.05), (0.058, 0.05), (0.02, 0.012)], where, 14))
    elif kind == 1:
        dish.append(lathe([(0.036, 0), (0.04, 0.09), (0.034, 0.09), (0.03, 0.02)], where, 12))
    side = width / 2 - pad / 2
    keys = [
        box((pad * 0.22, 0.006, 0.018), (side + dx * pad * 0.3, y - 0.001, low + 0.05 + row * 0.03))
        for dx in (-1, 0, 1)
        for row in range(4)
    ]
    if sampler.chance(0.4):
        keys = [
            disc(pad * 0.28, 0.024, (side, y + 0.002, low + height * z), 14) for z in (0.3, 0.65)
        ]
    dark = [box((pad * 0.75, 0.006, 0.03), (side, y - 0.001, low + height - 0.055))]
    door = [rounded_box((wide - 0.004, 0.03, height), (middle, y - 0.014, low), 0.008)]
    window = [box((wide * 0.7, 0.038, height * 0.6), (middle, y - 0.014, low + height * 0.2))]
    hand = grip(sampler, height * 0.6, (x1 - 0.03, y - 0.029, low + height / 2), True)
    angle, pivot = -sampler.uniform(35, 120), (x0, y)
    door, window, hand = (turned(part, angle, pivot) for part in (door, window, hand))
    dark += feet(width, depth, low + 0.004, 0.014)
    return centred(
        assemble(
            CATEGORY,
            (sampler.enamel(), casing),
            (sampler.enamel(), door),
            (sampler.dark(), window),
            (sampler.pale(), plate),
            (sampler.metal(), keys + hand),
            (rubber(sampler), dark),
            *([(sampler.ceramic(), dish)] if dish else []),
        )
    )


def framed_microwave(sampler: Sampler) -> Model:
    """In a trim frame with air slots above and below, its controls in a column or a row."""
    width, depth, height = sampler.size(0.52, 0.6), sampler.size(0.3, 0.4), sampler.size(0.34, 0.39)
    y, rim = -depth / 2, sampler.uniform(0.03, 0.05)
    body = [box((width - 0.03, depth - 0.02, height - 0.01), (0, 0.01, 0.005))]
    frame = [box((width, 0.02, rim), (0, y + 0.012, z)) for z in (0, height - rim)]
    frame += [
        box((rim * 0.7, 0.02, height - 2 * rim), (x * (width - rim * 0.7) / 2, y + 0.012, rim))
        for x in (-1, 1)
    ]
    slots = [
        box((0.03, 0.006, 0.006), (x * width, y + 0.001, z))
        for x in np.linspace(-0.42, 0.42, 11)
        for z in (rim * 0.35, height - rim * 0.65)
    ]
    tall, wide = height - 2 * rim - 0.006, width - rim * 1.4 - 0.006
    pad = wide * 0.2
    door = [
        rounded_box((wide - pad - 0.004, 0.024, tall), (-pad / 2, y + 0.006, rim + 0.003), 0.006)
    ]
    panel = [rounded_box((pad, 0.022, tall), (wide / 2 - pad / 2, y + 0.006, rim + 0.003), 0.005)]
    glass = door_window(
        sampler, (wide - pad) * 0.72, tall * 0.62, (-pad / 2 - 0.01, y - 0.003, rim + tall * 0.2)
    )
    glass.append(box((pad * 0.7, 0.008, 0.03), (wide / 2 - pad / 2, y - 0.006, rim + tall - 0.05)))
    keys = [disc(0.022, 0.02, (wide / 2 - pad / 2, y - 0.003, rim + tall * 0.45), 14)]
    keys += [
        box((pad * 0.55, 0.008, 0.016), (wide / 2 - pad / 2, y - 0.006, rim + 0.03 + 0.026 * i))
        for i in (0, 1)
    ]
    at = (wide / 2 - pad - 0.026, y - 0.005, rim + tall / 2)
    hand = grip(sampler, tall * 0.7, at, True)
    return assemble(
        CATEGORY,
        (sampler.enamel(), body),
        (sampler.metal(), frame),
        (sampler.enamel(), door),
        (sampler.dark(), panel),
        (sampler.dark(), glass),
        (sampler.metal(), keys + hand),
        (sampler.dark(), slots),
        support_surfaces=(support_surface(width - 0.03, depth, height - 0.005),),
    )
