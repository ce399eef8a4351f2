"""Bathroom fixtures, the washing machine and towels."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.furniture.kitchen import tap
from onemap_simulator.generation.mesh import (
    Model,
    assemble,
    box,
    box_between,
    corners,
    cylinder,
    ellipsoid,
    knob,
    lathe,
    prism,
    rod,
    rounded_box,
    top,
    torus,
    tube,
)
from onemap_simulator.generation.style import Sampler


def toilet(draw: Sampler) -> Model:
    """A bowl with seat and lid, lid up or down, in front of a cistern."""
    ceramic = draw.ceramic()
    seat_material = ceramic if draw.chance(0.5) else draw.wood()
    height, length, width = draw.sizes((0.39, 0.44), (0.42, 0.5), (0.34, 0.4))
    foot, tank_h = draw.sizes((0.55, 0.8), (0.34, 0.42))
    profile = [
        (0.5 * foot, 0.0),
        (0.42 * foot, 0.3 * height),
        (0.7, 0.6 * height),
        (0.98, 0.9 * height),
        (1.0, height),
        (0.72, height),
        (0.5, 0.7 * height),
        (0.0, 0.65 * height),
    ]
    y, z = length / 2 + 0.06, height - 0.03
    bowl = lathe(profile, segments=18).scaled(width / 2, length / 2, 1.0)
    body = [
        bowl.translated(0, -0.06, 0),
        box((width * 0.55, 0.3, height * 0.85), (0, 0.16, 0)),
        rounded_box((width + 0.06, 0.18, tank_h), (0, y, z), 0.03),
        rounded_box((width + 0.09, 0.2, 0.035), (0, y, z + tank_h), 0.015),
    ]
    button = cylinder(0.025, 0.015, (0, y, height + tank_h), 10)
    ring = torus(1.0, 0.12, segments=20).scaled(width * 0.43, length * 0.43, 0.16)
    turns = np.linspace(0, 2 * np.pi, 18, endpoint=False)
    lid = prism(np.stack([np.cos(turns) * width / 2, np.sin(turns) * length / 2], axis=1), 0.022)
    if draw.chance(0.5):
        lid = lid.translated(0, -0.06, height + 0.03)
    else:
        lid = lid.translated(0, length / 2, 0).rotated("x", 82)
        lid = lid.translated(0, y - 0.12, height + 0.03)
    seat = [ring.translated(0, -0.06, height + 0.015), lid]
    return assemble("toilet", (ceramic, body), (seat_material, seat), (draw.metal(), [button]))


def bathtub(draw: Sampler) -> Model:
    """A hollow tub, boxed in or standing free on feet, with a tap at one end; x is its length."""
    length, width, height = draw.sizes((1.45, 1.7), (0.68, 0.78), (0.5, 0.6))
    ceramic, metal = draw.ceramic(), draw.metal()
    if draw.chance(0.45):
        outside = [(0.78, 0.1), (0.9, 0.3), (1.0, 1.0), (1.03, 1.0)]
        inside = [(0.95, 0.97), (0.8, 0.35), (0, 0.25)]
        tub = lathe([(r, z * height) for r, z in outside + inside], segments=22)
        shell = [tub.scaled(length / 2, width / 2, 1.0)]
        foot = [(0.03, 0), (0.05, 0.03), (0.03, 0.12)]
        feet = [lathe(foot, (x, y, 0), 8) for x, y in corners(length * 0.3, width * 0.28)]
    else:
        x, y, wall = length / 2, width / 2, 0.07
        rim = (length + 0.03, wall + 0.02, 0.05)
        shell = [
            box_between((-x, -y, 0), (x, y, 0.15)),
            box_between((-x, -y, 0), (x, -y + wall, height)),
            box_between((-x, y - wall, 0), (x, y, height)),
            box_between((-x, -y, 0), (-x + wall * 1.5, y, height)),
            box_between((x - wall * 1.5, -y, 0), (x, y, height)),
            rounded_box(rim, (0, -y + wall / 2, height - 0.02), 0.02),
        ]
        feet = []
    at = (-length / 2 + 0.06, 0, height)
    faucet = [mesh.rotated("z", -90).translated(*at) for mesh in tap(draw, (0, 0, 0))]
    water = draw.material("noise", 0.5, (0.6, 0.8, 0.88))
    groups = [(ceramic, shell), (metal, [*feet, *faucet])]
    if draw.chance(0.4):
        groups.append((water, [box((length * 0.75, width * 0.6, 0.01), (0, 0, height * 0.62))]))
    return assemble("bathtub", *groups)


def shower(draw: Sampler) -> Model:
    """A tray with a back panel, a riser with a rose overhead, and a framed side screen."""
    side, height, bar = draw.size(0.82, 0.95), 2.0, 0.025
    half, metal = side / 2, draw.metal()
    tray = [
        box((side, side, 0.05)),
        *(box((side, 0.05, 0.11), (0, y * (half - 0.025), 0)) for y in (-1, 1)),
        *(box((0.05, side, 0.11), (x * (half - 0.025), 0, 0)) for x in (-1, 1)),
    ]
    back = [box_between((-half, half - 0.02, 0.1), (half, half, height))]
    rose_y, riser_y, x, post = half - 0.32, half - 0.05, half - 0.015, (bar, bar, height)
    pipes = [
        tube([(0, riser_y, 0.9), (0, riser_y, 1.95), (0, rose_y, 1.95)], 0.014),
        lathe([(0.11, 0.0), (0.11, 0.02), (0.02, 0.05)], (0, rose_y, 1.89), 16),
        box((0.26, 0.05, 0.05), (0, riser_y, 1.0)),
        cylinder(0.025, 0.03, (0.1, half - 0.07, 1.05), 8),
        *(box(post, (x, y, 0.05)) for y in (-half + bar, 0.0, half - bar)),
        *(box((bar, side, bar), (x, 0, z)) for z in (0.12, height + 0.02)),
        *(box((side, bar, bar), (0, -half + bar, z)) for z in (0.12, height + 0.02)),
        box(post, (-half + bar, -half + bar, 0.05)),
        tube([(0.05, riser_y, 1.0), (0.16, half - 0.1, 0.7), (0.2, half - 0.06, 1.3)], 0.01),
    ]
    tiles = draw.material("tiles", 0.5, draw.colour())
    glass = draw.material("plain", 0.5, (0.75, 0.85, 0.88))
    pane = box_between((x - 0.004, -half + 0.03, 0.15), (x + 0.004, half - 0.03, height))
    groups = (draw.ceramic(), tray), (tiles, back), (metal, pipes), (glass, [pane])
    return assemble("shower", *groups)


def bathroom_sink(draw: Sampler) -> Model:
    """A basin on a pedestal, on a small cabinet, or on the wall, with a tap."""
    width, depth, height = draw.sizes((0.5, 0.65), (0.42, 0.5), (0.82, 0.88))
    ceramic, bowl_h = draw.ceramic(), draw.size(0.16, 0.22)
    rim = [(0.55, 0), (0.9, 0.55), (1.0, 1.0), (0.9, 1.0), (0.7, 0.5), (0.0, 0.3)]
    bowl = lathe([(r, z * bowl_h) for r, z in rim], segments=18)
    shelf = (width * 0.8, 0.12, bowl_h * 0.7)
    body = [
        bowl.scaled(width / 2, depth / 2, 1.0).translated(0, 0, height - bowl_h),
        box(shelf, (0, depth / 2 - 0.05, height - bowl_h * 0.7)),
    ]
    cabinet = []
    if draw.chance(0.5):
        column = lathe([(0.13, 0), (0.08, 0.1), (0.07, 0.5), (0.11, height - bowl_h + 0.02)])
        body.append(column.translated(0, 0.05, 0))
    else:
        leaf, low = (width * 0.42, 0.02, height - bowl_h - 0.16), height - bowl_h - 0.1
        chest = [
            box((width * 0.9, depth * 0.85, low), (0, 0.03, 0.12)),
            *(box(leaf, (x * width * 0.22, -depth * 0.4, 0.15)) for x in (-1, 1)),
        ]
        knobs = [box((0.015, 0.03, 0.1), (x, -depth * 0.43, height * 0.5)) for x in (-0.04, 0.04)]
        cabinet = [(draw.wood(), chest), (draw.metal(), knobs)]
    faucet = tap(draw, (0, depth / 2 - 0.05, height - 0.01))
    return assemble("sink", (ceramic, body), (draw.metal(), faucet), *cabinet)


def washing_machine(draw: Sampler) -> Model:
    """A box with a round drum door, a control strip with a dial and a soap drawer."""
    width, depth, height = draw.sizes((0.58, 0.62), (0.52, 0.6), (0.82, 0.88))
    y, z = -depth / 2, height * 0.46
    casing, metal, dark, radius = draw.enamel(), draw.metal(), draw.dark(), draw.size(0.16, 0.2)
    body = [
        rounded_box((width, depth, height), radius=0.015),
        box((0.16, 0.02, 0.08), (-width / 2 + 0.11, y - 0.006, height - 0.115)),  # the soap drawer
    ]
    door = [
        torus(radius, 0.028, segments=22).rotated("x", 90).translated(0, y - 0.01, z),
        box((0.03, 0.03, 0.09), (radius, y - 0.03, z - 0.045)),
        knob(0.035, 0.03, (0.05, y, height - 0.075), 12),
    ]
    glass = [
        ellipsoid((radius * 0.9, 0.05, radius * 0.9), (0, y + 0.005, z), 16),
        box((0.1, 0.02, 0.045), (width / 2 - 0.09, y - 0.004, height - 0.1)),
    ]
    strip = [box((width - 0.02, 0.012, 0.11), (0, y - 0.002, height - 0.13))]
    plain = draw.material("plain", 0.5, draw.grey(0.3, 0.9))
    rings = metal if draw.chance(0.6) else dark
    groups = (casing, body), (rings, door), (dark, glass), (plain, strip)
    return assemble("washing machine", *groups, tops=[top(width, depth, height)])


def towel(draw: Sampler) -> Model:
    """A towel folded over a rail on the wall; z = 0 is its lower hem."""
    width, drop = draw.sizes((0.4, 0.6), (0.5, 0.75))
    y, x = -0.06, np.linspace(-width / 2, width / 2, 9)
    wave = 0.012 * np.sin(np.linspace(0, 3 * np.pi, 9))
    cloth = [
        box((wide, 0.02, drop), (left + wide / 2, y - 0.03 + fold, 0.0))
        for left, wide, fold in zip(x[:-1], np.diff(x), wave[:-1], strict=True)
    ]
    back_drop, end = drop * draw.uniform(0.6, 0.9), width / 2 + 0.06
    cloth.append(box((width, 0.015, back_drop), (0, y + 0.025, drop - back_drop)))
    cloth.append(rod((-width / 2, y, drop), (width / 2, y, drop), 0.034))
    stripes = [box((width * 1.01, 0.035, 0.05), (0, y - 0.03, 0.06 + i * 0.09)) for i in (0, 1)]
    rail = [
        rod((-width / 2 - 0.07, y, drop), (width / 2 + 0.07, y, drop), 0.012),
        *(rod((x, y, drop), (x, 0.0, drop), 0.012) for x in (-end, end)),
    ]
    fabric, trim = draw.fabric(), draw.fabric()
    groups = [(fabric, cloth), (draw.metal(), rail)]
    if draw.chance(0.5):
        groups.append((trim, stripes))
    return assemble("towel", *groups)
