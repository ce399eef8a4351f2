"""Trash cans without a lid: wastepaper baskets and office bins."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import (
    Mesh,
    box,
    ellipsoid,
    lathe,
    rod,
    torus,
)
from onemap_simulator.generation.model import Material, Model, assemble
from onemap_simulator.generation.sampler import Sampler

Size = tuple[float, float, float]


def _crumpled(sampler: Sampler, reach: float, z: float) -> tuple[Material, list[Mesh]]:
    """Crumpled paper that shows at the rim."""
    count = sampler.integer(2, 5)
    balls = []
    for k in range(count):
        r, angle = sampler.uniform(0.035, 0.05), 2.4 * k
        at = (reach * 0.5 * float(np.cos(angle)), reach * 0.5 * float(np.sin(angle)), z)
        balls.append(ellipsoid((r, r * 0.9, r), at, 6).rotated("z", 0))
    return sampler.pale(), balls


def wastepaper_basket(sampler: Sampler) -> Model:
    """An open wire mesh wastepaper basket with a solid rim and foot, paper in it."""
    r, h = sampler.size(0.12, 0.17), sampler.size(0.26, 0.38)
    low = r * sampler.uniform(0.7, 0.9)
    mesh: list[Mesh] = []
    count = sampler.integer(16, 22)
    lean = sampler.choice([0.0, 25.0])
    for k in range(count):
        for way in (-1, 1) if lean else (0,):
            a, b = np.radians(360 * k / count), np.radians(360 * k / count + way * lean)
            foot = (low * float(np.cos(a)), low * float(np.sin(a)), 0.01)
            mesh.append(rod(foot, (r * float(np.cos(b)), r * float(np.sin(b)), h), 0.003, 4))
    for k in range(1, 7):
        mesh.append(torus(low + (r - low) * k / 7, 0.0025, (0, 0, h * k / 7), 16))
    solid = [lathe([(low, 0), (low + 0.004, 0.025), (low - 0.008, 0.025), (0, 0.008)], segments=20)]
    solid.append(
        lathe(
            [(r, h - 0.02), (r + 0.006, h), (r - 0.006, h), (r - 0.008, h - 0.02), (r, h - 0.02)],
            segments=20,
            capped=False,
        )
    )
    groups = [(sampler.metal(), mesh), (sampler.metal(), solid)]
    if sampler.chance(0.6):
        groups += [_crumpled(sampler, low, 0.07 + z * h) for z in (0.0, 0.3)]
    return assemble("trash can", *groups)


def office_bin(sampler: Sampler) -> Model:
    """A square open office bin, leather, wood or plastic, with hand holes or a bag over its rim."""
    w, h = sampler.size(0.2, 0.3), sampler.size(0.26, 0.38)
    d = w * sampler.uniform(0.65, 1.0)
    low, t = sampler.uniform(0.72, 1.0), 0.01
    ring = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    outer = [(0.7071 * low, 0.0), (0.7071, h)]
    inner = [(0.7071 - t / w * 1.6, h), (0.7071 * low - t / w * 1.6, t), (0.0, t)]
    body = lathe([*outer, *inner], segments=4).rotated("z", 45).scaled(w, d, 1.0)
    groups = [(sampler.choice([sampler.wood, sampler.plastic, sampler.upholstery])(), [body])]
    if sampler.chance(0.5):
        bag = lathe(
            [
                (0.7071 * 0.97, h - 0.06),
                (0.74, h - 0.05),
                (0.745, h + 0.006),
                (0.66, h + 0.004),
                (0.5, h * 0.45),
                (0, h * 0.4),
            ],
            segments=4,
        )
        groups.append(
            (
                sampler.pale() if sampler.chance(0.5) else sampler.dark(),
                [bag.rotated("z", 45).scaled(w, d, 1.0)],
            )
        )
    else:
        holes = [
            box((0.004, 0.07, 0.025), (s * w * (0.5 - (1 - low) * 0.08), 0, h * 0.82))
            for s in (-1, 1)
        ]
        trim = [
            rod((x * w / 2, y * d / 2, h), (u * w / 2, v * d / 2, h), 0.005, 6)
            for (x, y), (u, v) in zip(ring, np.roll(ring, -1, axis=0), strict=True)
        ]
        groups.append((sampler.dark(), [*holes, *trim]))
    if sampler.chance(0.6):
        groups.append(_crumpled(sampler, min(w, d) * 0.4, h * 0.85))
    return assemble("trash can", *groups)
