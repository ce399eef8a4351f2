"""Bathroom fixtures, the washing machine and towels."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.furniture.kitchen import tap
from onemap_simulator.generation.mesh import (
    Mesh,
    box,
    box_between,
    cylinder,
    ellipsoid,
    lathe,
    prism,
    rod,
    rounded_box,
    torus,
    tube,
)
from onemap_simulator.generation.model import Model, assemble, support_surface
from onemap_simulator.generation.sampler import Sampler


def toilet(sampler: Sampler) -> Model:
    """A bowl with seat and lid, lid up or down, in front of a cistern."""
    ceramic = sampler.ceramic()
    seat_material = ceramic if sampler.chance(0.5) else sampler.wood()
    height, length, width = (
        sampler.size(0.39, 0.44),
        sampler.size(0.42, 0.5),
        sampler.size(0.34, 0.4),
    )
    foot = sampler.size(0.55, 0.8)
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
    bowl = lathe(profile, segments=18).scaled(width / 2, length / 2, 1.0)
    bowl = bowl.translated(0, -0.06, 0)
    pedestal = box((width * 0.55, 0.3, height * 0.85), (0, 0.16, 0))
    cistern_h, cistern_y = sampler.size(0.34, 0.42), length / 2 + 0.06
    cistern = rounded_box((width + 0.06, 0.18, cistern_h), (0, cistern_y, height - 0.03), 0.03)
    lid = rounded_box((width + 0.09, 0.2, 0.035), (0, cistern_y, height - 0.03 + cistern_h), 0.015)
    button = cylinder(0.025, 0.015, (0, cistern_y, height + cistern_h), 10)
    seat_ring = torus(1.0, 0.12, segments=20).scaled(width * 0.43, length * 0.43, 0.16)
    seat = [seat_ring.translated(0, -0.06, height + 0.015)]
    angle = np.linspace(0, 2 * np.pi, 18, endpoint=False)
    outline = np.stack([np.cos(angle) * width / 2, np.sin(angle) * length / 2], axis=1)
    cover = prism(outline, 0.022)
    if sampler.chance(0.5):
        seat.append(cover.translated(0, -0.06, height + 0.03))
    else:
        upright = cover.translated(0, length / 2, 0).rotated("x", 82)
        seat.append(upright.translated(0, cistern_y - 0.12, height + 0.03))
    return assemble(
        "toilet",
        (ceramic, [bowl, pedestal, cistern, lid]),
        (seat_material, seat),
        (sampler.metal(), [button]),
    )


def bathtub(sampler: Sampler) -> Model:
    """A hollow tub, boxed in or standing free on feet, with a tap at one end; x is its length."""
    length, width, height = (
        sampler.size(1.45, 1.7),
        sampler.size(0.68, 0.78),
        sampler.size(0.5, 0.6),
    )
    ceramic, metal = sampler.ceramic(), sampler.metal()
    if sampler.chance(0.45):
        rim = [
            (0.78, 0.1),
            (0.9, 0.3),
            (1.0, 1.0),
            (1.03, 1.0),
            (0.95, 0.97),
            (0.8, 0.35),
            (0, 0.25),
        ]
        tub = lathe([(r, z * height) for r, z in rim], segments=22)
        shell = [tub.scaled(length / 2, width / 2, 1.0)]
        feet = [
            lathe(
                [(0.03, 0), (0.05, 0.03), (0.03, 0.12)], (x * length * 0.3, y * width * 0.28, 0), 8
            )
            for x in (-1, 1)
            for y in (-1, 1)
        ]
    else:
        x, y, wall = length / 2, width / 2, 0.07
        shell = [
            box_between((-x, -y, 0), (x, y, 0.15)),
            box_between((-x, -y, 0), (x, -y + wall, height)),
            box_between((-x, y - wall, 0), (x, y, height)),
            box_between((-x, -y, 0), (-x + wall * 1.5, y, height)),
            box_between((x - wall * 1.5, -y, 0), (x, y, height)),
            rounded_box(
                (length + 0.03, wall + 0.02, 0.05), (0, -y + wall / 2, height - 0.02), 0.02
            ),
        ]
        feet = []
    faucet = [
        m.rotated("z", -90).translated(-length / 2 + 0.06, 0, height)
        for m in tap(sampler, (0, 0, 0))
    ]
    water = sampler.material("noise", 0.5, (0.6, 0.8, 0.88))
    groups = [(ceramic, shell), (metal, [*feet, *faucet])]
    if sampler.chance(0.4):
        level = box((length * 0.75, width * 0.6, 0.01), (0, 0, height * 0.62))
        groups.append((water, [level]))
    return assemble("bathtub", *groups)


def shower(sampler: Sampler) -> Model:
    """A tray with a back panel, a riser with a rose overhead, and a framed side screen."""
    side, height = sampler.size(0.82, 0.95), 2.0
    half = side / 2
    metal = sampler.metal()
    tray = [
        box((side, side, 0.05)),
        *(box((side, 0.05, 0.11), (0, y * (half - 0.025), 0)) for y in (-1, 1)),
        *(box((0.05, side, 0.11), (x * (half - 0.025), 0, 0)) for x in (-1, 1)),
    ]
    back = [box_between((-half, half - 0.02, 0.1), (half, half, height))]
    rose_y = half - 0.32
    pipes = [
        tube([(0, half - 0.05, 0.9), (0, half - 0.05, 1.95), (0, rose_y, 1.95)], 0.014),
        lathe([(0.11, 0.0), (0.11, 0.02), (0.02, 0.05)], (0, rose_y, 1.89), 16),
        box((0.26, 0.05, 0.05), (0, half - 0.05, 1.0)),
        cylinder(0.025, 0.03, (0.1, half - 0.07, 1.05), 8),
    ]
    x = half - 0.015
    bar = 0.025
    for y in (-half + bar, 0.0, half - bar):
        pipes.append(box((bar, bar, height), (x, y, 0.05)))
    for z in (0.12, height + 0.02):
        pipes.append(box((bar, side, bar), (x, 0, z)))
    for z in (0.12, height + 0.02):
        pipes.append(box((side, bar, bar), (0, -half + bar, z)))
    pipes.append(box((bar, bar, height), (-half + bar, -half + bar, 0.05)))
    tiles = sampler.material("tiles", 0.5, sampler.colour())
    glass = sampler.material("plain", 0.5, (0.75, 0.85, 0.88))
    pane = box_between((x - 0.004, -half + 0.03, 0.15), (x + 0.004, half - 0.03, height))
    hose = tube([(0.05, half - 0.05, 1.0), (0.16, half - 0.1, 0.7), (0.2, half - 0.06, 1.3)], 0.01)
    return assemble(
        "shower", (sampler.ceramic(), tray), (tiles, back), (metal, [*pipes, hose]), (glass, [pane])
    )


def bathroom_sink(sampler: Sampler) -> Model:
    """A basin on a pedestal, on a small cabinet, or on the wall, with a tap."""
    width, depth, height = (
        sampler.size(0.5, 0.65),
        sampler.size(0.42, 0.5),
        sampler.size(0.82, 0.88),
    )
    ceramic = sampler.ceramic()
    bowl_h = sampler.size(0.16, 0.22)
    rim = [(0.55, 0), (0.9, 0.55), (1.0, 1.0), (0.9, 1.0), (0.7, 0.5), (0.0, 0.3)]
    bowl = lathe([(r, z * bowl_h) for r, z in rim], segments=18)
    body = [bowl.scaled(width / 2, depth / 2, 1.0).translated(0, 0, height - bowl_h)]
    body.append(
        box((width * 0.8, 0.12, bowl_h * 0.7), (0, depth / 2 - 0.05, height - bowl_h * 0.7))
    )
    groups = []
    if sampler.chance(0.5):
        column = lathe([(0.13, 0), (0.08, 0.1), (0.07, 0.5), (0.11, height - bowl_h + 0.02)])
        body.append(column.translated(0, 0.05, 0))
    else:
        chest = box((width * 0.9, depth * 0.85, height - bowl_h - 0.1), (0, 0.03, 0.12))
        leaves = [
            box(
                (width * 0.42, 0.02, height - bowl_h - 0.16), (x * width * 0.22, -depth * 0.4, 0.15)
            )
            for x in (-1, 1)
        ]
        knobs = [box((0.015, 0.03, 0.1), (x * 0.04, -depth * 0.43, height * 0.5)) for x in (-1, 1)]
        groups = [(sampler.wood(), [chest, *leaves]), (sampler.metal(), knobs)]
    faucet = tap(sampler, (0, depth / 2 - 0.05, height - 0.01))
    return assemble("sink", (ceramic, body), (sampler.metal(), faucet), *groups)


def washing_machine(sampler: Sampler) -> Model:
    """A box with a round drum door, a control strip with a dial and a soap drawer."""
    width, depth, height = (
        sampler.size(0.58, 0.62),
        sampler.size(0.52, 0.6),
        sampler.size(0.82, 0.88),
    )
    y = -depth / 2
    casing, metal, dark = sampler.enamel(), sampler.metal(), sampler.dark()
    body = [rounded_box((width, depth, height), (0, 0, 0), 0.015)]
    radius, z = sampler.size(0.16, 0.2), height * 0.46
    hoop = torus(radius, 0.028, segments=22).rotated("x", 90).translated(0, y - 0.01, z)
    glass = ellipsoid((radius * 0.9, 0.05, radius * 0.9), (0, y + 0.005, z), 16)
    latch = box((0.03, 0.03, 0.09), (radius, y - 0.03, z - 0.045))
    strip = box((width - 0.02, 0.012, 0.11), (0, y - 0.002, height - 0.13))
    drawer = box((0.16, 0.02, 0.08), (-width / 2 + 0.11, y - 0.006, height - 0.115))
    dial = cylinder(0.035, 0.03, segments=12).rotated("x", 90).translated(0.05, y, height - 0.075)
    screen = box((0.1, 0.02, 0.045), (width / 2 - 0.09, y - 0.004, height - 0.1))
    plain = sampler.material("plain", 0.5, sampler.grey(0.3, 0.9))
    return assemble(
        "washing machine",
        (casing, [*body, drawer]),
        (metal if sampler.chance(0.6) else dark, [hoop, latch, dial]),
        (dark, [glass, screen]),
        (plain, [strip]),
        support_surfaces=(support_surface(width, depth, height),),
    )


def towel(sampler: Sampler) -> Model:
    """A towel folded over a rail on the wall; z = 0 is its lower hem."""
    width, drop = sampler.size(0.4, 0.6), sampler.size(0.5, 0.75)
    y = -0.06
    front_x = np.linspace(-width / 2, width / 2, 9)
    wave = 0.012 * np.sin(np.linspace(0, 3 * np.pi, 9))
    cloth: list[Mesh] = []
    for i in range(8):
        strip_w = float(front_x[i + 1] - front_x[i])
        at = (float(front_x[i] + strip_w / 2), y - 0.03 + float(wave[i]), 0.0)
        cloth.append(box((strip_w, 0.02, drop), at))
    back_drop = drop * sampler.uniform(0.6, 0.9)
    cloth.append(box((width, 0.015, back_drop), (0, y + 0.025, drop - back_drop)))
    cloth.append(rod((-width / 2, y, drop), (width / 2, y, drop), 0.034))
    stripe = [box((width * 1.01, 0.035, 0.05), (0, y - 0.03, 0.06 + i * 0.09)) for i in (0, 1)]
    rail = [rod((-width / 2 - 0.07, y, drop), (width / 2 + 0.07, y, drop), 0.012)]
    rail += [
        rod((x * (width / 2 + 0.06), y, drop), (x * (width / 2 + 0.06), 0.0, drop), 0.012)
        for x in (-1, 1)
    ]
    cloth_material, trim = sampler.fabric(), sampler.fabric()
    groups = [(cloth_material, cloth), (sampler.metal(), rail)]
    if sampler.chance(0.5):
        groups.append((trim, stripe))
    return assemble("towel", *groups)
