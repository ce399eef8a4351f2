"""Dials: hour marks, hands and their materials."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import Mesh, box, cylinder
from onemap_simulator.generation.model import Material
from onemap_simulator.generation.sampler import Sampler
from onemap_tools.train.variety.designs.flat_forms import ellipse_outline, upright

At = tuple[float, float, float]


def body_of(sampler: Sampler) -> Material:
    """The material of a case."""
    if sampler.chance(0.4):
        return sampler.wood()
    return sampler.metal() if sampler.chance(0.6) else sampler.plastic()


def face_and_ink(sampler: Sampler) -> tuple[Material, Material]:
    """The materials of a dial and of the hands and marks on it."""
    if sampler.chance(0.65):
        return sampler.pale() if sampler.chance(0.7) else sampler.plastic(), sampler.dark()
    return sampler.dark() if sampler.chance(0.6) else sampler.wood(), sampler.pale()


def spoke(angle: float, span: tuple[float, float], thick: float, at: At) -> Mesh:
    """A flat bar that points from ``at`` at an angle from twelve, from one radius to another."""
    start, end = span
    return box((thick, 0.004, end - start), (0, 0, start)).rotated("y", angle).translated(*at)


def hands_on(sampler: Sampler, radius: float, at: At, seconds: float = 0.5) -> list[Mesh]:
    """Two hands, sometimes a third, and a pin: bars, tapered or with a disc."""
    x, y, z = at
    kind, hour = sampler.integer(0, 2), sampler.uniform(0, 360)
    meshes = []
    for index, (long, thick) in enumerate(((0.52, 0.075), (0.8, 0.05))):
        angle, place = (hour, sampler.uniform(0, 360))[index], (x, y - 0.005 * index, z)
        if kind == 1:
            r, w = radius * long, radius * thick
            leaf = [(0.0, -r * 0.15), (w * 0.8, r * 0.35), (0.0, r), (-w * 0.8, r * 0.35)]
            hand = upright(np.array(leaf), 0.003, (0, 0, 0)).rotated("y", angle)
            meshes.append(hand.translated(*place))
        else:
            meshes.append(spoke(angle, (-radius * 0.12, radius * long), radius * thick, place))
        if kind == 2:
            disc = upright(ellipse_outline(radius * 0.16, radius * 0.16, 10), 0.003, (0, 0, 0))
            turned = disc.translated(0, 0, radius * long * 0.7).rotated("y", angle)
            meshes.append(turned.translated(*place))
    if sampler.chance(seconds):
        at_seconds = (x, y - 0.01, z)
        span = (-radius * 0.2, radius * 0.8)
        meshes.append(spoke(sampler.uniform(0, 360), span, radius * 0.018, at_seconds))
    pin = cylinder(radius * 0.06, 0.016, segments=8).rotated("x", 90)
    return [*meshes, pin.translated(x, y + 0.002, z)]


def marks_on(sampler: Sampler, radius: float, at: At) -> list[Mesh]:
    """Hour marks: bars, dots, only four, or twelve with minutes between."""
    kind, marks = sampler.integer(0, 3), []
    for hour in range(12):
        quarter = hour % 3 == 0
        if kind == 2 and not quarter:
            continue
        if kind == 1:
            a, r = np.radians(hour * 30), radius * (0.05 if quarter else 0.03)
            dot = cylinder(r, 0.004, segments=8).rotated("x", 90)
            x, z = at[0] + 0.85 * radius * np.sin(a), at[2] + 0.85 * radius * np.cos(a)
            marks.append(dot.translated(x, at[1] + 0.002, z))
        else:
            long = 0.24 if quarter else 0.12
            span = (radius * (0.93 - long), radius * 0.93)
            marks.append(spoke(hour * 30, span, radius * (0.06 if quarter else 0.035), at))
    if kind == 3:
        span = (radius * 0.88, radius * 0.93)
        marks += [spoke(a, span, radius * 0.015, at) for a in range(6, 360, 6) if a % 30]
    return marks
