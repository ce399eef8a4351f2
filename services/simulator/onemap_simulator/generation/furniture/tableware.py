"""Bottles, cups, bowls and books, oversized so that they are visible in a small image."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import (
    Mesh,
    box,
    box_between,
    cylinder,
    ellipsoid,
    lathe,
    tube,
)
from onemap_simulator.generation.model import Model, assemble
from onemap_simulator.generation.sampler import Sampler


def bottle(sampler: Sampler) -> Model:
    """A tall body, a shoulder, a thin neck with a cap, and a label."""
    height, radius = sampler.size(0.28, 0.36), sampler.size(0.04, 0.055)
    shoulder = height * sampler.uniform(0.5, 0.68)
    neck = radius * sampler.uniform(0.3, 0.42)
    profile = [(radius * 0.9, 0), (radius, 0.01), (radius, shoulder), (neck, height * 0.78)]
    body = lathe([*profile, (neck, height * 0.93)], segments=14)
    cap = cylinder(neck * 1.2, height * 0.08, (0, 0, height * 0.92), 10)
    label = cylinder(radius * 1.015, shoulder * 0.5, (0, 0, shoulder * 0.25), 14)
    return assemble(
        "bottle",
        (sampler.plastic(), [body]),
        (sampler.plastic(), [cap]),
        (sampler.fabric(), [label]),
    )


def cup(sampler: Sampler) -> Model:
    """A mug with a handle, generously sized, at times on a saucer."""
    height, radius = sampler.size(0.11, 0.14), sampler.size(0.05, 0.065)
    foot = radius * sampler.uniform(0.65, 1.0)
    lift = 0.014 if sampler.chance(0.4) else 0.0
    wall = [(foot, 0), (radius, height), (radius * 0.88, height), (foot * 0.85, 0.015), (0, 0.015)]
    angle = np.linspace(-np.pi / 2, np.pi / 2, 7)
    loop = [
        (radius * 0.85 + height * 0.35 * np.cos(a), 0.0, height * (0.5 + 0.32 * np.sin(a)))
        for a in angle
    ]
    meshes = [lathe(wall, (0, 0, lift)), tube(loop, 0.011).translated(0, 0, lift)]
    if lift:
        meshes.append(lathe([(radius * 0.8, 0), (radius * 1.7, 0.018), (radius * 0.8, 0.012)]))
    coffee = cylinder(radius * 0.8, 0.005, (0, 0, lift + height * 0.8), 12)
    glaze = sampler.plastic() if sampler.chance(0.6) else sampler.fabric()
    return assemble(
        "cup", (glaze, meshes), (sampler.material("plain", 0.5, (0.25, 0.14, 0.08)), [coffee])
    )


def bowl(sampler: Sampler) -> Model:
    """A wide open bowl, empty or with fruit."""
    radius, height = sampler.size(0.13, 0.18), sampler.size(0.08, 0.11)
    foot = radius * 0.45
    outer = [(foot, 0), (foot, 0.012), (radius * 0.8, height * 0.5), (radius, height)]
    inner = [(radius * 0.94, height), (radius * 0.72, height * 0.5), (0.0, 0.025)]
    groups = [
        (sampler.ceramic() if sampler.chance(0.4) else sampler.wood(), [lathe([*outer, *inner])])
    ]
    if sampler.chance(0.55):
        fruit: list[list[Mesh]] = [[], []]
        for index in range(sampler.integer(3, 6)):
            angle, size = index * 1.25, sampler.uniform(0.038, 0.048)
            at = (radius * 0.45 * np.cos(angle), radius * 0.45 * np.sin(angle), height * 0.8)
            fruit[index % 2].append(ellipsoid((size, size, size), at, 8))
        groups += [(sampler.plastic(), fruit[0]), (sampler.plastic(), fruit[1])]
    return assemble("bowl", *groups)


def book(sampler: Sampler) -> Model:
    """A pile of two to five books, each with covers, a spine and paper edges."""
    z, pages = 0.0, []
    groups = []
    for _ in range(sampler.integer(2, 5)):
        width, depth, thick = (
            sampler.size(0.2, 0.27),
            sampler.size(0.15, 0.2),
            sampler.size(0.03, 0.055),
        )
        turn = sampler.uniform(-15, 15)
        covers = [
            box((width, depth, 0.006), (0, 0, 0)),
            box((width, depth, 0.006), (0, 0, thick - 0.006)),
            box_between((-width / 2, -depth / 2, 0.0), (width / 2, -depth / 2 + 0.008, thick)),
        ]
        block = box_between(
            (-width / 2 + 0.006, -depth / 2, 0.006),
            (width / 2 - 0.006, depth / 2 - 0.008, thick - 0.006),
        )
        pages.append(block.rotated("z", turn).translated(0, 0, z))
        cover = sampler.plastic() if sampler.chance(0.7) else sampler.fabric()
        groups.append((cover, [mesh.rotated("z", turn).translated(0, 0, z) for mesh in covers]))
        z += thick
    return assemble("book", (sampler.material("stripes", 0.02, (0.93, 0.9, 0.8)), pages), *groups)
