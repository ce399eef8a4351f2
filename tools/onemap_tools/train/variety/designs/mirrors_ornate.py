"""Mirrors in which the frame is the show: gilt scrolls, wreaths of rays."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import Mesh, ellipsoid, prism, rod, torus, tube
from onemap_simulator.generation.model import Model
from onemap_simulator.generation.sampler import Sampler
from onemap_tools.train.variety.designs.mirror_parts import (
    back_board,
    frame_band,
    glass_plate,
    mirror_glass,
    oval,
)
from onemap_tools.train.variety.designs.sanitary import SQUARE, stand


def ornate(sampler: Sampler) -> Model:
    """A gilt frame with beads, corner scrolls and a crest."""
    width, height = sampler.size(0.5, 0.85), sampler.size(0.65, 1.15)
    is_oval, bar = sampler.chance(0.4), sampler.uniform(0.05, 0.1)
    power = 2.0 if is_oval else SQUARE
    outer = oval((width, height), power)
    half = np.array([width, height]) / 2
    inner = outer * (1 - bar / half)
    parts = [
        frame_band(outer, inner, 0.035),
        frame_band(outer * (1 - bar * 0.5 / half), inner, 0.055),
        back_board(inner * 1.01, 0.008),
    ]
    count = sampler.integer(16, 30)
    spread = oval((width, height), power)
    at = np.linspace(0, 24, count, endpoint=False)
    closed = np.concatenate([spread, spread[:1]]) * (1 - bar * 0.3 / half)
    bead = sampler.uniform(0.01, 0.02)
    for s in at:
        x, z = (float(np.interp(s, np.arange(25), closed[:, i])) for i in (0, 1))
        parts.append(ellipsoid((bead, 0.02, bead), (x, -0.035, z), 6))
    crest = height / 2
    for s in (-1, 1):
        curl = [
            (s * r * np.sin(a) + s * 0.07, -0.025, crest + r * np.cos(a) + 0.02)
            for a, r in zip(np.linspace(-1.5, 4.5, 12), np.linspace(0.07, 0.02, 12), strict=True)
        ]
        parts.append(tube(curl, 0.012, 6))
        if not is_oval:
            for z in (-height / 2, height / 2):
                parts.append(ellipsoid((0.055, 0.03, 0.04), (s * width / 2, -0.02, z), 8))
    parts.append(
        ellipsoid((0.04, 0.025, sampler.uniform(0.05, 0.1)), (0, -0.025, crest + 0.02), 10)
    )
    glass = glass_plate(inner * 1.005, -0.02)
    gilt = sampler.metal() if sampler.chance(0.6) else sampler.wood()
    return stand("mirror", (gilt, parts), (mirror_glass(sampler), [glass]))


def sunburst(sampler: Sampler) -> Model:
    """A small round mirror in a wreath of rays, sticks, leaves or beads."""
    radius = sampler.size(0.11, 0.2)
    reach = radius * sampler.uniform(1.7, 2.6)
    count, kind = sampler.integer(14, 32), sampler.integer(0, 2)
    hoop = [
        torus(radius, 0.016, segments=24).rotated("x", 90).translated(0, -0.02, 0),
        back_board(oval((2 * radius, 2 * radius)), 0.016),
    ]
    rays: list[Mesh] = []
    for i in range(count):
        end = reach * (0.78 if i % 2 and count % 2 == 0 else 1.0)
        if kind == 0:
            flat = [
                (-0.014, radius * 0.95),
                (0.014, radius * 0.95),
                (0.022, radius * 1.2),
                (0.0, end),
            ]
            ray = prism(np.array(flat) * (1, 1), 0.012).rotated("x", 90)
        elif kind == 1:
            ray = rod((0, -0.012, radius * 0.9), (0, -0.012, end), 0.006, 6)
        else:
            ray = ellipsoid(
                (0.022, 0.01, (end - radius) / 2 + 0.01), (0, -0.012, (end + radius) / 2), 8
            )
        rays.append(ray.rotated("y", i * 360 / count))
        if kind == 1:
            rays.append(
                ellipsoid((0.013, 0.013, 0.013), (0, -0.012, end), 6).rotated("y", i * 360 / count)
            )
    plate = glass_plate(oval((2 * radius, 2 * radius)), -0.019)
    gilt = sampler.metal() if sampler.chance(0.6) else sampler.wood()
    return stand(
        "mirror",
        (gilt, rays),
        (gilt if sampler.chance(0.5) else sampler.wood(), hoop),
        (mirror_glass(sampler), [plate]),
    )
