"""Front-loading washing machines: alone, under a dryer, with the door open."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import Mesh, box, ellipsoid, lathe, rounded_box
from onemap_simulator.generation.model import Model, assemble, support_surface
from onemap_simulator.generation.sampler import Sampler
from onemap_tools.train.variety.designs.appliance_parts import (
    centred,
    disc,
    feet,
    ring,
    round_rect,
    rubber,
    slab,
    slats,
    turned,
)

CATEGORY = "washing machine"
Place = tuple[float, float, float]


def _porthole(sampler: Sampler, radius: float, at: Place) -> tuple[list[Mesh], list[Mesh]]:
    """A round door, hoop and latch, and its domed or flat glass; ``at`` on the front."""
    x, y, z = at
    side = sampler.choice([-1, 1])
    kind = sampler.integer(0, 2)
    if kind == 0:
        hoop = [ring(radius, sampler.uniform(0.018, 0.03), (x, y - 0.008, z))]
    elif kind == 1:
        profile = [(radius * 1.18, 0), (radius * 1.15, 0.035), (radius * 0.82, 0.05)]
        profile += [(radius * 0.78, 0.02)]
        band = lathe([*profile, (radius * 0.78, 0), (radius * 1.18, 0)], segments=24, capped=False)
        hoop = [band.rotated("x", 90).translated(x, y, z)]
    else:
        hoop = [ring(radius * 1.1, 0.012, (x, y - 0.004, z)), ring(radius * 0.84, 0.016, (x, y, z))]
        hoop.append(disc(radius * 1.1, 0.012, (x, y + 0.004, z), 24))
    dome = sampler.uniform(0.02, 0.07)
    glass = [ellipsoid((radius * 0.8, dome, radius * 0.8), (x, y - 0.006, z), 18)]
    hoop.append(rounded_box((0.03, 0.03, 0.1), (x + side * radius, y - 0.03, z - 0.05), 0.01))
    for h in (-0.045, 0.02):
        hoop.append(box((0.04, 0.022, 0.025), (x - side * radius * 1.12, y - 0.006, z + h)))
    return hoop, glass


def _panel(sampler: Sampler, width: float, y: float, z: float) -> tuple[list[Mesh], list[Mesh]]:
    """Dial, buttons, detergent drawer; and a screen: on a strip with middle height z."""
    parts: list[Mesh] = []
    mirror = sampler.choice([-1, 1])
    long = sampler.uniform(0.14, 0.2)
    parts.append(box((long, 0.018, 0.07), (-mirror * (width / 2 - long / 2 - 0.025), y, z - 0.035)))
    parts.append(
        box((long * 0.4, 0.012, 0.014), (-mirror * (width / 2 - long / 2 - 0.025), y - 0.012, z))
    )
    dial = sampler.uniform(-0.05, 0.08) * mirror
    parts.append(disc(sampler.uniform(0.026, 0.042), 0.03, (dial, y + 0.002, z), 16))
    for index in range(sampler.integer(2, 5)):
        x = mirror * (width / 2 - 0.035 - index * 0.03)
        if abs(x - dial) > 0.06:
            parts.append(disc(0.009, 0.012, (x, y + 0.002, z - 0.025), 8))
    screen = [box((0.09, 0.012, 0.03), (mirror * (width / 2 - 0.085), y, z + 0.004))]
    return parts, screen


def front_loader(sampler: Sampler) -> Model:
    """A front loader: porthole, straight or raked panel, drawer, filter flap, feet."""
    width, depth = sampler.size(0.56, 0.66), sampler.size(0.44, 0.62)
    height, y = sampler.size(0.8, 0.9), -depth / 2
    low, band, top = sampler.uniform(0.015, 0.05), sampler.uniform(0.1, 0.15), 0.03
    casing = [rounded_box((width, depth - 0.02, height - low - top), (0, 0.01, low), 0.012)]
    lid = [rounded_box((width, depth, top), (0, 0, height - top), 0.01)]
    z = height - top - band
    strip = [box((width - 0.004, 0.03, band - 0.008), (0, y + 0.012, z))]
    parts, screen = _panel(sampler, width, y - 0.006, z + band / 2)
    radius = sampler.uniform(0.14, min(0.21, width * 0.36))
    middle = (z - low) * sampler.uniform(0.5, 0.56) + low
    hoop, glass = _porthole(sampler, radius, (0, y + 0.008, middle))
    flap: list[Mesh] = []
    corner = sampler.choice([-1, 1]) * (width / 2 - 0.1)
    if sampler.chance(0.6):
        shape = round_rect(0.12, 0.09, 0.01, 0.045)
        flap.append(slab(shape, 0.012, (corner, y + 0.012, low + 0.03)))
    else:
        flap.append(box((width - 0.01, 0.016, 0.09), (0, y + 0.01, low + 0.01)))
    return assemble(
        CATEGORY,
        (sampler.enamel(), casing + flap),
        (sampler.enamel(), strip),
        (sampler.enamel(), lid),
        (sampler.metal(), hoop),
        (sampler.dark(), glass + screen),
        (sampler.plastic(), parts),
        (rubber(sampler), feet(width, depth, low + 0.01, 0.025)),
        support_surfaces=(support_surface(width, depth, height),),
    )


def stacked(sampler: Sampler) -> Model:
    """A washing machine with its dryer on top: two portholes, two panels, a joining shelf."""
    width, depth = sampler.size(0.58, 0.66), sampler.size(0.5, 0.62)
    each, y = sampler.size(0.8, 0.88), -depth / 2
    between = sampler.uniform(0.02, 0.06)
    casing, strips, hoops, glasses, parts = [], [], [], [], []
    middle_panel = sampler.chance(0.4)
    for index, low in enumerate((0.03, each + between)):
        tall = each - 0.03 if index == 0 else each
        casing.append(rounded_box((width, depth - 0.02, tall), (0, 0.01, low), 0.012))
        band = sampler.uniform(0.09, 0.13)
        z = low + 0.02 if middle_panel and index == 1 else low + tall - band - 0.015
        strips.append(box((width - 0.004, 0.03, band), (0, y + 0.014, z)))
        knobs, screen = _panel(sampler, width, y - 0.004, z + band / 2)
        parts += knobs
        centre = low + (tall + (band if z < low + 0.1 else -band)) / 2
        hoop, glass = _porthole(sampler, sampler.uniform(0.15, 0.2), (0, y + 0.008, centre))
        hoops += hoop
        glasses += glass + screen
    kit = [box((width + 0.006, depth, between + 0.004), (0, 0, each - 0.002))]
    if sampler.chance(0.4):
        kit.append(rounded_box((width * 0.5, 0.05, 0.02), (0, y - 0.015, each + 0.004), 0.008))
    dark = feet(width, depth, 0.04, 0.025)
    if sampler.chance(0.5):
        dark += slats(width * 0.35, 0.09, (width * 0.25, y + 0.012, 0.06), 4)
    return assemble(
        CATEGORY,
        (sampler.enamel(), casing),
        (sampler.enamel(), strips),
        (sampler.metal(), hoops),
        (sampler.dark(), glasses),
        (sampler.plastic(), parts),
        (sampler.metal(), kit),
        (rubber(sampler), dark),
    )


def _swung_door(
    sampler: Sampler, radius: float, y: float, middle: float
) -> tuple[list[Mesh], list[Mesh]]:
    """A round door that stands open before the opening at (0, y, middle), and its glass bowl."""
    side = sampler.choice([-1, 1])
    profile = [
        (radius * 1.15, 0),
        (radius * 1.12, 0.04),
        (radius * 0.8, 0.045),
        (radius * 0.78, 0.0),
    ]
    rim = lathe([*profile, (radius * 1.15, 0)], segments=22, capped=False).rotated("x", 90)
    bowl = lathe(
        [(radius * 0.8, 0), (radius * 0.72, 0.09), (radius * 0.4, 0.12), (0.001, 0.122)],
        segments=18,
    )
    pivot = (side * radius * 1.12, y + 0.004)
    door = [rim.translated(0, y, middle)]
    door.append(rounded_box((0.03, 0.025, 0.1), (-side * radius, y - 0.05, middle - 0.05), 0.01))
    glass = [bowl.rotated("x", -90).translated(0, y - 0.02, middle)]
    angle_deg = side * sampler.uniform(75, 140)
    door, glass = turned(door, angle_deg, pivot), turned(glass, angle_deg, pivot)
    door.append(box((0.03, 0.03, 0.12), (pivot[0] + side * 0.01, y + 0.004, middle - 0.06)))
    return door, glass


def _washing(sampler: Sampler, radius: float, y: float, middle: float) -> list[Mesh]:
    """Crumpled pieces in the opening, and one that hangs out of it."""
    cloth = []
    for _ in range(sampler.integer(2, 5)):
        x = sampler.uniform(-0.5, 0.5) * radius
        size = (sampler.uniform(0.04, 0.08), 0.05, sampler.uniform(0.03, 0.07))
        cloth.append(
            ellipsoid(size, (x, y - 0.005, middle - radius * sampler.uniform(0.3, 0.65)), 8)
        )
    cloth.append(rounded_box((0.09, 0.04, 0.2), (0.02, y - 0.035, middle - radius - 0.12), 0.018))
    return cloth


def open_porthole(sampler: Sampler) -> Model:
    """A front loader with its round door swung open: drum, rubber bellows, washing inside."""
    width, depth = sampler.size(0.56, 0.64), sampler.size(0.46, 0.6)
    height, y, low = sampler.size(0.8, 0.88), -depth / 2, 0.03
    radius = sampler.uniform(0.15, 0.19)
    band = sampler.uniform(0.1, 0.14)
    middle = low + (height - band - low) * 0.53
    casing = [rounded_box((width, depth - 0.02, height - low), (0, 0.01, low), 0.012)]
    strip = [box((width - 0.01, 0.025, band - 0.03), (0, y + 0.012, height - band))]
    parts, screen = _panel(sampler, width, y - 0.004, height - band / 2 - 0.015)
    bellows = [
        ring(radius * 0.98, 0.024, (0, y + 0.004, middle)),
        ring(radius * 0.84, 0.02, (0, y + 0.008, middle)),
    ]
    hollow = [disc(radius * 0.96, 0.008, (0, y + 0.014, middle), 22)]
    drum = [ring(radius * 0.62, 0.008, (0, y + 0.006, middle), 18)]
    for angle in np.radians([90, 210, 330]):
        x, z = radius * 0.4 * float(np.cos(angle)), radius * 0.4 * float(np.sin(angle))
        fin = box((radius * 0.5, 0.012, 0.03), (0, 0, -0.015)).rotated(
            "y", -float(np.degrees(angle))
        )
        drum.append(fin.translated(x, y + 0.006, middle + z))
    door, glass = _swung_door(sampler, radius, y, middle)
    cloth = _washing(sampler, radius, y, middle) if sampler.chance(0.6) else []
    groups = [(sampler.fabric(), cloth)] if cloth else []
    return centred(
        assemble(
            CATEGORY,
            (sampler.enamel(), casing),
            (sampler.enamel(), strip),
            (sampler.metal(), drum),
            (sampler.dark(), hollow + screen),
            (rubber(sampler), bellows + feet(width, depth, low + 0.01, 0.025)),
            (sampler.enamel(), door),
            (sampler.dark(), glass),
            (sampler.plastic(), parts),
            *groups,
        )
    )
