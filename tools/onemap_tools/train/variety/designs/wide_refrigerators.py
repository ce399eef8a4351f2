"""Large refrigerators: French door, side by side, four doors, of steel, behind panels."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import Mesh, box, box_between, front_panel, tube
from onemap_simulator.generation.model import Material, Model, assemble
from onemap_simulator.generation.sampler import Sampler
from onemap_tools.train.variety.designs.appliance_parts import grip, rubber, slats
from onemap_tools.train.variety.designs.refrigerator_parts import (
    CATEGORY,
    Size,
    closed_body,
    dispenser,
    door_frame,
    door_leaf,
    hinge_covers,
)


def french_door(sampler: Sampler) -> Model:
    """Two doors above, one or two freezer drawers below, a dispenser in the left door."""
    width, depth = sampler.size(0.7, 0.9), sampler.size(0.64, 0.74)
    height, low, y = sampler.size(1.65, 1.85), 0.07, -depth / 2
    casing, dark = closed_body(sampler, (width, depth, height), 0.07, low)
    split = low + height * sampler.uniform(0.3, 0.42)
    leaves, handles = [], []
    for side in (-1, 1):
        size = (width / 2 - 0.004, 0.07, height - split - 0.008)
        leaves.append(door_leaf(sampler, size, (side * width / 4, y, split + 0.006)))
        at = (side * 0.045, y, (split + height) / 2 - 0.05)
        handles += grip(sampler, (height - split) * sampler.uniform(0.5, 0.8), at, True)
    count = sampler.integer(1, 2)
    each = (split - low) / count
    for row in range(count):
        z = low + row * each
        leaves.append(door_leaf(sampler, (width, 0.07, each - 0.008), (0, y, z)))
        handles += grip(sampler, width * sampler.uniform(0.5, 0.85), (0, y, z + each - 0.08), False)
    second, groups = sampler.metal(), []
    if sampler.chance(0.65):
        frame, recess = dispenser(sampler, (-width / 4 - 0.02, y, height * 0.6))
        groups, dark = [(sampler.metal(), frame)], [*dark, *recess]
    paint = sampler.enamel()
    side_paint = sampler.enamel() if sampler.chance(0.5) else paint
    caps = hinge_covers(width, depth, height, (-1, 1))
    return assemble(
        CATEGORY,
        (paint, leaves),
        (side_paint, casing),
        (second, handles),
        (rubber(sampler), [*dark, *caps]),
        *groups,
    )


def side_by_side(sampler: Sampler) -> Model:
    """A broad one with a narrow freezer door beside a wide door and two long handles."""
    width, depth = sampler.size(0.76, 0.92), sampler.size(0.62, 0.72)
    height, low, y = sampler.size(1.68, 1.86), 0.08, -depth / 2
    casing, dark = closed_body(sampler, (width, depth, height), 0.06, low)
    seam = width * sampler.choice([-0.1, -0.06, 0.0, 0.08])
    leaves, handles = [], []
    long = height * sampler.uniform(0.35, 0.75)
    for x0, x1, side in ((-width / 2, seam, -1), (seam, width / 2, 1)):
        size = (x1 - x0 - 0.007, 0.06, height - low)
        leaves.append(door_leaf(sampler, size, ((x0 + x1) / 2, y, low)))
        handles += grip(sampler, long, (seam + side * 0.045, y, height * 0.55), True)
    frame: list[Mesh] = []
    if sampler.chance(0.6):
        middle = (seam - width / 2) / 2 - 0.02
        frame, recess = dispenser(sampler, (middle, y, height * 0.5))
        dark += recess
    dark += hinge_covers(width, depth, height, (-1, 1))
    paint, metal = sampler.enamel(), sampler.metal()
    return assemble(
        CATEGORY, (paint, [*casing, *leaves]), (metal, [*handles, *frame]), (rubber(sampler), dark)
    )


def american(sampler: Sampler) -> Model:
    """A four-door or two-door block with a large display, an ice unit and a bar drawer."""
    width, depth = sampler.size(0.8, 0.95), sampler.size(0.66, 0.76)
    height, low, y = sampler.size(1.72, 1.9), 0.06, -depth / 2
    casing, dark = closed_body(sampler, (width, depth, height), 0.08, low)
    split = low + (height - low) * sampler.uniform(0.36, 0.48)
    gap = sampler.uniform(0.012, 0.04)
    leaves, trim = [], []
    for side in (-1, 1):
        for z0, z1 in ((low, split - gap / 2), (split + gap / 2, height)):
            size = (width / 2 - 0.006, 0.08, z1 - z0)
            leaves.append(door_leaf(sampler, size, (side * width / 4, y, z0)))
            strip = box((0.016, 0.012, (z1 - z0) * 0.96), (side * 0.012, y + 0.004, z0 + 0.01))
            trim.append(strip)
    wide, tall = width * sampler.uniform(0.24, 0.38), sampler.uniform(0.3, 0.5)
    glow = sampler.material("stripes", 1.0, sampler.colour(), sampler.colour())
    image = Material(glow.texture, 1.0)
    screen = front_panel(wide, tall, (width / 4, y - 0.008, height - tall - 0.22))
    rim = box((wide + 0.02, 0.008, tall + 0.02), (width / 4, y - 0.002, height - tall - 0.23))
    frame, recess = dispenser(sampler, (-width / 4, y, height * 0.58))
    dark += [*hinge_covers(width, depth, height, (-1, 1)), *recess, rim]
    return assemble(
        CATEGORY,
        (sampler.enamel(), leaves),
        (sampler.enamel(), casing),
        (sampler.metal(), [*trim, *frame]),
        (rubber(sampler), dark),
        (image, [screen]),
    )


def wide_steel(sampler: Sampler) -> Model:
    """A chef's steel refrigerator: heavy bar handles, an air grille above the doors, a plinth."""
    width, depth = sampler.size(0.66, 0.95), sampler.size(0.64, 0.75)
    height, low, y = sampler.size(1.75, 2.1), 0.1, -depth / 2
    grille = sampler.uniform(0.12, 0.24)
    casing, dark = closed_body(sampler, (width, depth, height), 0.05, low)
    steel, metal = sampler.material("brushed", 0.5, sampler.grey(0.4, 0.8)), sampler.metal()
    leaves = slats(
        width - 0.02, grille - 0.02, (0, y + 0.03, height - grille), sampler.integer(4, 8)
    )
    for side in (-1, 1):
        at = (side * (width / 2 - 0.012), y + 0.025, height - grille)
        leaves.append(box((0.024, 0.05, grille), at))
    leaves.append(box((width, 0.05, 0.016), (0, y + 0.025, height - 0.016)))
    top = height - grille - 0.01
    handles: list[Mesh] = []
    drawer = low + 0.02 + (sampler.uniform(0.4, 0.6) if sampler.chance(0.6) else 0.0)
    if drawer > 0.2:
        leaves.append(door_leaf(sampler, (width, 0.05, drawer - low - 0.01), (0, y, low)))
        handles += _bar((-width * 0.42, y, drawer - 0.1), (width * 0.42, y, drawer - 0.1))
    count = 2 if width > 0.78 else 1
    for index in range(count):
        x = (index - (count - 1) / 2) * width / count
        leaves.append(
            door_leaf(sampler, (width / count - 0.006, 0.05, top - drawer), (x, y, drawer))
        )
        hand = (1 if index == 0 else -1) * (width / count / 2 - 0.05)
        handles += _bar((x + hand, y, drawer + 0.1), (x + hand, y, top - 0.1))
    return assemble(
        CATEGORY,
        (steel, leaves),
        (sampler.enamel(), casing),
        (metal, handles),
        (rubber(sampler), dark),
    )


def _bar(start: Size, end: Size) -> list[Mesh]:
    """A thick round bar in front of two points of a door, on posts."""
    out = np.array([0.0, -0.055, 0.0])
    first, last = np.array(start), np.array(end)
    meshes = [tube([first + out, last + out], 0.016, 8)]
    for share in (0.06, 0.94):
        foot = first + share * (last - first)
        meshes.append(tube([foot + (0, 0.005, 0), foot + out], 0.013, 6))
    return meshes


def panelled(sampler: Sampler) -> Model:
    """One built into a tall cabinet: framed or plain wooden fronts, vents, a sunk plinth."""
    width, depth = sampler.size(0.6, 0.78), sampler.size(0.58, 0.64)
    height, low, y = sampler.size(1.9, 2.15), sampler.uniform(0.08, 0.14), -depth / 2
    wood, fronts, hands = sampler.wood(), [], []
    side, framed = sampler.choice([-1, 1]), sampler.chance(0.6)
    board = 0.02
    casing = [box_between((-width / 2, y + 0.03, low), (width / 2, depth / 2, height))]
    for x in (-1, 1):
        casing.append(box((board, depth, height), (x * (width / 2 + board / 2), 0, 0)))
    casing.append(box((width + 2 * board, depth, board), (0, 0, height)))
    split = low + (height - low) * sampler.uniform(0.3, 0.42)
    upper = height - (sampler.uniform(0.25, 0.4) if sampler.chance(0.4) else 0.0)
    spans = [(low, split, 1), (split, upper, -1)] + (
        [(upper, height, -1)] if upper < height else []
    )
    for bottom, top, sign in spans:
        tall = top - bottom - 0.014
        fronts.append(box((width - 0.008, 0.02, tall), (0, y + 0.018, bottom + 0.005)))
        if framed:
            fronts += [
                m.translated(0, 0, bottom + 0.005)
                for m in door_frame(width - 0.008, tall, (0, y - 0.006, 0), 0.07)
            ]
        long = min(sampler.uniform(0.2, 0.7), tall * 0.7)
        z = (bottom + tall - long / 2 - 0.05) if sign > 0 else bottom + long / 2 + 0.06
        hands += grip(sampler, long, (side * (width / 2 - 0.045), y - 0.004, z), True)
    dark = [box((width, depth - 0.1, low), (0, 0.04, 0))]
    dark.append(box((width - 0.01, 0.006, height - low), (0, y + 0.027, low)))
    dark += slats(width * 0.9, low - 0.03, (0, y + 0.085, 0.012), 4)
    second = sampler.wood() if sampler.chance(0.4) else wood
    return assemble(
        CATEGORY,
        (wood, fronts),
        (second, casing),
        (sampler.metal(), hands),
        (rubber(sampler), dark),
    )
