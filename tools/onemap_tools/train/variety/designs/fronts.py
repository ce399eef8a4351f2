"""Fronts of chests and desks: drawers shut or pulled out, doors, handles."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from onemap_simulator.generation.mesh import (
    Mesh,
    Vec,
    box,
    cylinder,
    ellipsoid,
    rod,
    rounded_box,
    torus,
    tube,
)
from onemap_simulator.generation.sampler import Sampler

HANDLES = ("knob", "bar", "cup", "ring", "bow", "slot", "strap", "lip")
Pair = tuple[float, float]


def rows_of(sampler: Sampler, count: int, total: float) -> list[float]:
    """Heights of drawers from the bottom up that fill ``total``: equal or growing downwards."""
    grow = sampler.choice([0.0, 0.0, 0.25])
    shares = [1.0 + grow * (count - 1 - index) for index in range(count)]
    return [total * share / sum(shares) for share in shares]


def drawer(size: Pair, at: Vec, out: float = 0.0) -> list[Mesh]:
    """A front (width, height) that lies 2 cm before y; pulled ``out``, it shows its open box."""
    (width, height), (x, y, z) = size, at
    meshes = [rounded_box((width, 0.022, height), (x, y - 0.009 - out, z), 0.005)]
    if out <= 0.0:
        return meshes
    deep, low = out + 0.02, height * 0.7
    middle = y - out + deep / 2 - 0.003
    meshes += [box((0.014, deep, low), (x + s * (width / 2 - 0.03), middle, z)) for s in (-1, 1)]
    meshes.append(box((width - 0.05, deep, 0.012), (x, middle, z + 0.008)))
    return meshes


def framed_door(style: str, size: Pair, at: Vec) -> list[Mesh]:
    """A door (width, height) before y: flat, with a raised frame, upright slats or louvres."""
    (width, height), (x, y, z) = size, at
    meshes = [box((width, 0.018, height), (x, y - 0.007, z))]
    front = y - 0.02
    if style == "slats":
        count = max(int(width / 0.04), 4)
        each = width / count
        for index in range(count):
            at_x = x + (index - (count - 1) / 2) * each
            meshes.append(box((each * 0.6, 0.014, height - 0.01), (at_x, front, z + 0.005)))
    elif style in ("panel", "louvre"):
        rim = 0.055
        for s in (-1, 1):
            meshes.append(box((rim, 0.018, height), (x + s * (width - rim) / 2, front, z)))
            low = z if s < 0 else z + height - rim
            meshes.append(box((width - 2 * rim + 0.004, 0.016, rim), (x, front, low)))
        if style == "louvre":
            levels = np.arange(z + rim + 0.012, z + height - rim - 0.02, 0.036)
            blade = box((width - 2 * rim, 0.02, 0.008)).rotated("x", 35)
            meshes += [blade.translated(x, front, float(level)) for level in levels]
    return meshes


def pulls(kind: str, at: Vec, width: float, height: float) -> list[Mesh]:
    """The handles of a front whose face is centred on ``at``: two on a wide one."""
    x, y, z = at
    offsets = (-width / 4, width / 4) if width > 0.55 and kind not in ("slot", "lip") else (0.0,)
    meshes: list[Mesh] = []
    for offset in offsets:
        meshes += [m.translated(x + offset, y, z) for m in _pull(kind, width, height)]
    return meshes


def _pull(kind: str, width: float, height: float) -> list[Mesh]:
    long = min(0.14, width * 0.4)
    if kind == "knob":
        return [
            cylinder(0.009, 0.02, segments=8).rotated("x", 90),
            ellipsoid((0.018, 0.012, 0.018), (0, -0.026, 0), 8),
        ]
    if kind == "bar":
        posts = [
            rod((s * long * 0.4, 0.002, 0), (s * long * 0.4, -0.03, 0), 0.006) for s in (-1, 1)
        ]
        return [*posts, rod((-long / 2, -0.03, 0), (long / 2, -0.03, 0), 0.008)]
    if kind == "cup":
        return [ellipsoid((long * 0.4, 0.026, 0.02), (0, 0, 0), 12)]
    if kind == "ring":
        ring = torus(0.024, 0.005, segments=10).rotated("x", 90)
        plate = cylinder(0.016, 0.008, segments=10).rotated("x", 90)
        return [plate, ring.translated(0, -0.014, -0.02)]
    if kind == "bow":
        angle = np.linspace(0, np.pi, 8)
        x, y = np.cos(angle) * long / 2, -0.032 * np.sin(angle) + 0.002
        return [tube(np.column_stack([x, y, -0.3 * np.abs(y)]), 0.006)]
    shapes: dict[str, tuple[Vec, Vec]] = {
        "slot": ((long * 1.2, 0.006, 0.03), (0, -0.001, height / 2 - 0.05)),
        "strap": ((0.022, 0.014, 0.07), (0, -0.006, -0.035)),
        "lip": ((width * 0.9, 0.022, 0.014), (0, -0.01, height / 2 - 0.024)),
    }
    return [box(*shapes[kind])]


class Block(NamedTuple):
    """A stack of drawers: its case, the fronts and the handles."""

    case: list[Mesh]
    fronts: list[Mesh]
    handles: list[Mesh]


def drawer_block(sampler: Sampler, kind: str, size: Vec, at: Vec, count: int) -> Block:
    """``count`` drawers in a case of a size that stands on ``at``; handles of ``kind``."""
    (width, depth, height), (x, y, z) = size, at
    block = Block([box((width, depth - 0.02, height), (x, y + 0.01, z))], [], [])
    front, level = y - depth / 2 + 0.02, z + 0.012
    for each in rows_of(sampler, count, height - 0.024):
        block.fronts.extend(drawer((width - 0.024, each - 0.01), (x, front, level)))
        face = (x, front - 0.02, level + each / 2)
        block.handles.extend(pulls(kind, face, width - 0.03, each))
        level += each
    return block
