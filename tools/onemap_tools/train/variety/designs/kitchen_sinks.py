"""Sinks of kitchens and laundries: with drainer, with apron, trough, on a steel frame."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import Mesh, box, box_between, cylinder, rod, tube
from onemap_simulator.generation.model import Model
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.sanitary import SQUARE, faucet, ring, skin, stand
from onemap_tools.train.variety.designs.washbasins import cabinet_front, carcass

Size = tuple[float, float]


def _trough(size: Size, low: float, top: float, wall: float) -> Mesh:
    """A rectangular vat with thick walls."""
    inner = (size[0] - 2 * wall, size[1] - 2 * wall)
    rings = [ring(size, low, SQUARE), ring(size, top, SQUARE), ring(inner, top, 14.0)]
    return skin([*rings, ring((inner[0] * 0.94, inner[1] * 0.94), low + 0.03, 10.0)])


def _high_tap(sampler: Sampler) -> list[Mesh]:
    """A kitchen tap: a high arch with a lever, at times with a coiled spring."""
    if sampler.chance(0.35):
        return faucet(sampler, (0, 0, 0))
    rise, reach = sampler.uniform(0.22, 0.38), sampler.uniform(0.16, 0.22)
    arc = [
        (0.0, -reach / 2 * (1 - np.cos(a)), rise + reach / 2 * np.sin(a))
        for a in np.linspace(0, np.pi, 9)
    ]
    meshes = [tube([(0, 0, 0), (0, 0, rise * 0.5), *arc, (0, -reach, rise * 0.7)], 0.014, 8)]
    meshes += [cylinder(0.025, 0.07, segments=10), rod((0, 0, 0.05), (0.1, -0.01, 0.08), 0.009)]
    if sampler.chance(0.4):
        meshes += [cylinder(0.024, 0.012, (0, 0, rise * 0.3 + i * 0.022), 10) for i in range(8)]
        meshes.append(cylinder(0.022, 0.1, (0, -reach, rise * 0.55), 10))
    return meshes


def _drainer(
    sampler: Sampler, size: tuple[float, float, float], x: float, top: float
) -> list[Mesh]:
    """A ribbed board about x with its upper face at ``top``."""
    drain_w, depth, thick = size
    ribs = sampler.integer(5, 9)
    return [
        box(size, (x, 0, top - thick)),
        *[
            box(
                (drain_w * 0.8, 0.012, 0.008),
                (x, (i / (ribs - 1) - 0.5) * depth * 0.65, top - 0.001),
            )
            for i in range(ribs)
        ],
    ]


def with_drainer(sampler: Sampler) -> Model:
    """A steel or enamel top with one or two bowls and a ribbed drainer on a cabinet."""
    width, depth, height = (
        sampler.size(0.8, 1.25),
        sampler.size(0.5, 0.62),
        sampler.size(0.84, 0.92),
    )
    bowls, side = sampler.integer(1, 2), sampler.choice((-1, 1))
    drain_w = width * sampler.uniform(0.32, 0.45)
    each, thick = (width - drain_w) / bowls, 0.03
    top: list[Mesh] = []
    holes: list[Mesh] = []
    for i in range(bowls):
        x = side * (drain_w / 2 - width / 2 + drain_w / 2 + (i + 0.5) * each)
        hole = (each - 0.06, depth - 0.14)
        rings = [ring((each, depth), height - thick, SQUARE), ring((each, depth), height, SQUARE)]
        rings += [
            ring((hole[0] * s, hole[1] * s), z, 6.0)
            for s, z in ((1.0, height), (0.94, height - 0.15), (0.01, height - 0.155))
        ]
        top.append(skin(rings, capped=False).translated(x, 0))
        holes.append(cylinder(0.04, 0.006, (x, 0, height - 0.155), 12))
    x = -side * (width / 2 - drain_w / 2)
    top += _drainer(sampler, (drain_w, depth, thick), x, height)
    if sampler.chance(0.5):
        top.append(
            box((width, 0.02, sampler.uniform(0.05, 0.3)), (0, depth / 2 + 0.008, height - 0.03))
        )
    plinth = [box((width - 0.04, depth - 0.1, 0.1), (0, 0.02, 0))]
    body = carcass((width - 0.02, depth - 0.04), 0.09, height - thick + 0.005, height - 0.18)
    leaves, handles = cabinet_front(
        sampler, (width - 0.03, 0.0), (0.11, height - 0.05), -depth / 2 + 0.012
    )
    tap_x = side * (drain_w / 2) if sampler.chance(0.7) else 0.0
    tap = [m.translated(tap_x, depth / 2 - 0.045, height) for m in _high_tap(sampler)]
    steel = sampler.metal() if sampler.chance(0.7) else sampler.ceramic()
    wood = sampler.wood()
    return stand(
        "sink",
        (steel, top),
        (wood, [*body, *leaves]),
        (sampler.dark(), [*plinth, *holes]),
        (sampler.metal(), [*handles, *tap]),
    )


def _shelf_frame(width: float, depth: float, low: float) -> list[Mesh]:
    """Four posts up to ``low``, rails under the sink and a slatted shelf."""
    x, y = width / 2 - 0.04, depth / 2 - 0.05
    frame = [box((0.06, 0.06, low), (sx * x, sy * y, 0)) for sx in (-1, 1) for sy in (-1, 1)]
    frame += [box((width - 0.06, 0.03, 0.08), (0, sy * y, low - 0.08)) for sy in (-1, 1)]
    frame += [box((width - 0.04, 0.06, 0.02), (0, (i - 2) * depth * 0.18, 0.16)) for i in range(5)]
    return frame


def farmhouse(sampler: Sampler) -> Model:
    """A thick ceramic apron sink that juts out over a cabinet or a shelf frame."""
    width, depth, height = (
        sampler.size(0.6, 0.95),
        sampler.size(0.5, 0.62),
        sampler.size(0.82, 0.92),
    )
    tall, wall = sampler.size(0.2, 0.28), sampler.uniform(0.025, 0.05)
    low = height - tall
    vat = [_trough((width, depth - 0.08), low, height, wall).translated(0, -0.04)]
    if sampler.chance(0.4):
        vat.append(box((wall, depth - 0.14, tall - 0.05), (0, -0.04, low + 0.02)))
    if sampler.chance(0.4):
        count = int(width / 0.06)
        vat += [
            box(
                (0.02, 0.012, tall - 0.06),
                ((i - (count - 1) / 2) * 0.06, -depth / 2 - 0.004, low + 0.03),
            )
            for i in range(count)
        ]
    ledge = [
        box((width, 0.08, 0.04), (0, depth / 2 - 0.04, height - 0.04)),
        box((width, 0.07, low - 0.1), (0, depth / 2 - 0.04, height - 0.04 - (low - 0.1))),
    ]
    handles: list[Mesh] = []
    if sampler.chance(0.65):
        frame = [
            box((width - 0.02, depth - 0.05, low - 0.08), (0, 0.02, 0.08)),
            box((width - 0.06, depth - 0.12, 0.1), (0, 0.03, 0)),
        ]
        leaves, handles = cabinet_front(
            sampler, (width - 0.03, 0.0), (0.09, low - 0.02), -depth / 2 + 0.04
        )
        frame += leaves
    else:
        frame = _shelf_frame(width, depth, low)
    tap = [m.translated(0, depth / 2 - 0.04, height) for m in _high_tap(sampler)]
    return stand(
        "sink",
        (sampler.ceramic(), vat),
        (
            sampler.wood()
            if sampler.chance(0.5)
            else sampler.material("marble", 0.8, sampler.colour()),
            ledge,
        ),
        (sampler.wood(), frame),
        (sampler.metal(), [*handles, *tap]),
    )


def _waste_pipe(low: float, depth: float) -> Mesh:
    """A trap that leads from a vat's underside at ``low`` to the wall."""
    return tube(
        [
            (0, 0, low + 0.01),
            (0, 0, 0.35),
            (0, 0.08, 0.3),
            (0, 0.1, 0.36),
            (0, depth / 2, 0.38),
        ],
        0.02,
    )


def utility(sampler: Sampler) -> Model:
    """A deep vat on a bare frame of tubes: a laundry trough or a catering sink."""
    width, depth, height = (
        sampler.size(0.5, 1.2),
        sampler.size(0.48, 0.62),
        sampler.size(0.82, 0.92),
    )
    tall = sampler.size(0.24, 0.36)
    bowls = 1 if width < 0.75 else sampler.integer(1, 2)
    each = width / bowls
    vats = [
        _trough((each - 0.002, depth), height - tall, height, 0.025).translated(
            (i - (bowls - 1) / 2) * each, 0
        )
        for i in range(bowls)
    ]
    rim = [box((width + 0.02, 0.03, 0.03), (0, s * (depth / 2), height - 0.028)) for s in (-1, 1)]
    back = [
        box_between(
            (-width / 2, depth / 2 - 0.01, height - 0.05),
            (width / 2, depth / 2 + 0.012, height + sampler.uniform(0.06, 0.3)),
        )
    ]
    x, y = width / 2 - 0.03, depth / 2 - 0.03
    legs = [
        rod((sx * x, sy * y, 0), (sx * x, sy * y, height - tall + 0.02), 0.02)
        for sx in (-1, 1)
        for sy in (-1, 1)
    ]
    if sampler.chance(0.5):
        legs.append(box((width - 0.04, depth - 0.04, 0.015), (0, 0, 0.18)))
    else:
        legs += [rod((sx * x, -y, 0.2), (sx * x, y, 0.2), 0.014) for sx in (-1, 1)]
        legs.append(rod((-x, 0, 0.2), (x, 0, 0.2), 0.014))
    pipe = _waste_pipe(height - tall, depth)
    tap = [m.rotated("x", 0).translated(0, depth / 2 - 0.03, height) for m in _high_tap(sampler)]
    material = sampler.metal() if sampler.chance(0.5) else sampler.ceramic()
    return stand(
        "sink",
        (material, [*vats, *rim, *back]),
        (sampler.metal(), legs),
        (sampler.plastic(), [pipe]),
        (sampler.metal(), tap),
    )


DESIGNS: dict[str, tuple[ModelFactory, ...]] = {"sink": (with_drainer, farmhouse, utility)}
