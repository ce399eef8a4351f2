"""Parts of guitars: outlines, bodies, necks, and how they stand."""

from __future__ import annotations

import numpy as np

from onemap_shared.geometry import F64
from onemap_simulator.generation.mesh import Mesh, box, from_faces, rod
from onemap_simulator.generation.model import Material, Model, assemble
from onemap_simulator.generation.sampler import Sampler


def spline(points: list[tuple[float, float]], count: int) -> F64:
    """A smooth closed curve through the (x, z) points (Catmull-Rom), ``count`` per span."""
    p = np.asarray(points)
    before, after, last = np.roll(p, 1, axis=0), np.roll(p, -1, axis=0), np.roll(p, -2, axis=0)
    curve = []
    for t in np.linspace(0, 1, count, endpoint=False):
        curve.append(
            0.5
            * (
                2 * p
                + (after - before) * t
                + (2 * before - 5 * p + 4 * after - last) * t**2
                + (3 * p - before - 3 * after + last) * t**3
            )
        )
    return np.stack(curve, axis=1).reshape(-1, 2)


def slab(outline: F64, thick: float, bevel: float = 0.0) -> Mesh:
    """An (x, z) outline, counter-clockwise seen from the front, as a plate from y = -thick to 0."""
    middle = outline.mean(axis=0)
    small = middle + (outline - middle) * (1 - bevel)
    layers = [(small, 0.0), (outline, -thick * 0.25), (outline, -thick * 0.75), (small, -thick)]
    if bevel == 0.0:
        layers = [layers[0], layers[3]]
    n = len(outline)
    rings = [np.stack([o[:, 0], np.full(n, y), o[:, 1]], axis=1) for o, y in layers]
    faces: list[tuple[int, int, int]] = []
    for k in range(len(rings) - 1):
        for i in range(n):
            a, b = k * n + i, k * n + (i + 1) % n
            faces += [(a, b, b + n), (a, b + n, a + n)]
    triangles = _ears(outline)
    top = (len(rings) - 1) * n
    faces += [(top + a, top + b, top + c) for a, b, c in triangles]
    faces += [(c, b, a) for a, b, c in triangles]
    return from_faces(np.concatenate(rings), faces)


def _ears(outline: F64) -> list[tuple[int, int, int]]:
    """Triangles of a simple counter-clockwise polygon, by cutting ears."""
    left, out = list(range(len(outline))), []

    def cross(a: int, b: int, c: int) -> float:
        (ax, ay), (bx, by), (cx, cy) = outline[a], outline[b], outline[c]
        return float((bx - ax) * (cy - ay) - (by - ay) * (cx - ax))

    while len(left) > 3:
        for i in range(len(left)):
            a, b, c = left[i - 1], left[i], left[(i + 1) % len(left)]
            others = [p for p in left if p not in (a, b, c)]
            inside = any(min(cross(a, b, p), cross(b, c, p), cross(c, a, p)) >= 0 for p in others)
            if cross(a, b, c) > 0 and not inside:
                out.append((a, b, c))
                left.pop(i)
                break
        else:
            left.pop(0)
    return [*out, (left[0], left[1], left[2])]


def mirrored(half: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Both sides of a body from its right half, bottom to top, ends not on the axis."""
    return [*half, *((-x, z) for x, z in reversed(half))]


def neck(
    z: float, length: float, front: float, head: int
) -> tuple[list[Mesh], list[Mesh], list[Mesh]]:
    """Neck with a head, frets and strings, tuning pegs; ``front`` is the y of its board."""
    top = z + length
    board = [box((0.05, 0.022, length + 0.1), (0, front + 0.008, z - 0.1))]
    shapes = [
        [
            (0.03, top),
            (0.045, top + 0.03),
            (0.035, top + 0.16),
            (-0.035, top + 0.16),
            (-0.045, top + 0.03),
            (-0.03, top),
        ],
        [
            (0.028, top),
            (0.03, top + 0.17),
            (0.0, top + 0.2),
            (-0.055, top + 0.16),
            (-0.05, top + 0.04),
            (-0.028, top),
        ],
        [(0.03, top), (0.07, top + 0.16), (0.0, top + 0.11), (-0.07, top + 0.16), (-0.03, top)],
    ]
    board.append(slab(np.asarray(shapes[head]), 0.018).translated(0, front + 0.03, 0))
    metal = [
        box((0.05, 0.004, 0.004), (0, front - 0.004, z + length * (1 - 0.75**k)))
        for k in range(1, 9)
    ]
    metal += [
        rod((x, front - 0.008, z - 0.24), (x, front - 0.006, top + 0.02), 0.0012, 4)
        for x in (-0.016, 0.0, 0.016)
    ]
    sides = (-1,) if head == 1 else (-1, 1)
    pegs = [
        rod((s * 0.03, front + 0.02, top + k), (s * 0.078, front + 0.02, top + k), 0.008, 6)
        for s in sides
        for k in (0.045, 0.085, 0.125)
    ]
    return board, metal, pegs


def posed(sampler: Sampler, groups: list[tuple[Material, list[Mesh]]], thick: float) -> Model:
    """The instrument leaning on an A stand, a tripod with a yoke or nothing (against a wall)."""
    kind = sampler.integer(0, 2)
    lean, lift = sampler.uniform(8, 18), 0.0 if kind == 2 else sampler.uniform(0.08, 0.16)
    posed = [
        (m, [p.translated(0, thick / 2, 0).rotated("x", -lean) for p in ms]) for m, ms in groups
    ]
    low = min(float(p.vertices[:, 2].min()) for _, ms in posed for p in ms)
    tall = max(float(p.vertices[:, 2].max()) for _, ms in posed for p in ms)
    shift = -0.5 * tall * float(np.sin(np.radians(lean))) if kind == 2 else -0.06
    out = [(m, [p.translated(0, shift, lift - low) for p in ms]) for m, ms in posed]
    bars: list[Mesh] = []
    front, back = shift - thick * 0.7 - 0.02, shift + thick * 0.5
    if kind == 0:
        for s in (-1, 1):
            bars += [
                rod((s * 0.15, front, 0.012), (s * 0.08, back + 0.06, 0.3), 0.011),
                rod((s * 0.13, back + 0.22, 0.012), (s * 0.08, back + 0.06, 0.3), 0.011),
                rod((s * 0.1, back + 0.03, lift), (s * 0.1, front, lift - 0.004), 0.012),
                rod((s * 0.1, front, lift - 0.01), (s * 0.1, front, lift + 0.04), 0.012),
            ]
        bars.append(rod((-0.1, back + 0.04, lift), (0.1, back + 0.04, lift), 0.01))
    elif kind == 1:
        y = back + 0.1
        for x, dy in ((-0.2, -0.12), (0.2, -0.12), (0.0, 0.18)):
            bars.append(rod((0, y, 0.12), (x, y + dy, 0.012), 0.011))
        top = lift + tall * 0.62
        bars.append(rod((0, y, 0.1), (0, y + 0.2 * 0.3, top), 0.011))
        bars += [rod((0, y, lift + 0.02), (s * 0.11, front, lift), 0.011) for s in (-1, 1)]
        bars += [
            rod((s * 0.11, front, lift - 0.01), (s * 0.11, front, lift + 0.05), 0.013)
            for s in (-1, 1)
        ]
    if bars:
        out.append((sampler.dark() if sampler.chance(0.6) else sampler.metal(), bars))
    points = np.concatenate([p.vertices for _, ms in out for p in ms])
    y, z = (points[:, 1].min() + points[:, 1].max()) / 2, points[:, 2].min()
    return assemble("guitar", *((m, [p.translated(0, -y, -z) for p in ms]) for m, ms in out))
