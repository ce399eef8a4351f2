"""Children's beds: low with guard rails, under a house, bunks and lofts."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import Mesh, box, rod
from onemap_simulator.generation.model import Model, assemble
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.bedding import bedding, head_area
from onemap_tools.train.variety.designs.upholstery import Group, settled, sideways, wall


def childs_bed(sampler: Sampler) -> Model:
    """A child's bed: short, with guard rails at both sides, maybe under the frame of a house."""
    width, length = sampler.size(0.7, 0.92), sampler.size(1.4, 1.95)
    base, height, thick = sampler.size(0.16, 0.3), sampler.size(0.5, 0.7), sampler.size(0.03, 0.06)
    x, y = width / 2 + thick / 2, length / 2 + thick / 2
    house, slats = sampler.chance(0.45), sampler.chance(0.6)
    post_h = sampler.size(1.1, 1.4) if house else height + 0.03
    wood = [box((thick, thick, post_h), (sx * x, sy * y, 0)) for sx in (-1, 1) for sy in (-1, 1)]
    wood.append(box((width, length, 0.04), (0, 0, base - 0.045)))
    for side in (-1, 1):
        wood.append(box((0.022, length, 0.12), (side * x, 0, base - 0.06)))
        reach = length if sampler.chance(0.4) else length * sampler.uniform(0.4, 0.65)
        mid = (length - reach) / 2
        wood.append(box((0.02, reach, 0.06), (side * x, mid, height - 0.1)))
        for at in np.linspace(mid - reach / 2 + 0.02, mid + reach / 2 - 0.04, 4 + 4 * slats):
            wood.append(box((0.016, 0.035, height - base), (side * x, float(at), base - 0.05)))
        u = np.linspace(-1, 1, 13)
        tops = height + sampler.choice((0.0, 0.12)) * np.cos(np.pi * u / 2)
        path = np.stack([u * (x - 0.005), np.full(13, side * y)], axis=1)
        wood.append(wall(path, base - 0.08, tops, thick * 0.7, 0.008))
    if house:
        ridge = post_h + width * sampler.uniform(0.4, 0.6)
        for sy in (-1, 1):
            wood += [
                rod((s * x, sy * y, post_h - 0.02), (0, sy * y, ridge), thick / 2) for s in (-1, 1)
            ]
        wood.append(box((thick, 2 * y, thick), (0, 0, ridge - thick / 2)))
        wood += [box((thick * 0.9, 2 * y, thick), (s * x, 0, post_h - thick)) for s in (-1, 1)]
    groups, top = bedding(sampler, width - 0.02, length - 0.02, base - 0.01)
    return settled(
        assemble(
            "bed", (sampler.wood(), wood), *groups, support_surfaces=head_area(width, length, top)
        )
    )


def _deck(
    sampler: Sampler, width: float, length: float, z: float
) -> tuple[list[Mesh], list[Group]]:
    rails = [box((width, length, 0.03), (0, 0, z - 0.04))]
    rails += [
        box((0.024, length + 0.06, 0.12), (s * (width / 2 + 0.014), 0, z - 0.06)) for s in (-1, 1)
    ]
    rails += [box((width, 0.024, 0.12), (0, s * (length / 2 + 0.014), z - 0.06)) for s in (-1, 1)]
    return rails, bedding(sampler, width - 0.01, length - 0.02, z - 0.012)[0]


def bunk(sampler: Sampler) -> Model:
    """A bunk or loft bed: one bed above another or above nothing, guard rails and a ladder."""
    width, length = sampler.size(0.82, 1.0), sampler.size(1.9, 2.05)
    low, high, thick = sampler.size(0.25, 0.4), sampler.size(1.2, 1.5), sampler.size(0.045, 0.08)
    x, y = width / 2 + thick / 2 + 0.01, length / 2 + thick / 2 + 0.01
    height = high + sampler.uniform(0.35, 0.5)
    frame = [box((thick, thick, height), (sx * x, sy * y, 0)) for sx in (-1, 1) for sy in (-1, 1)]
    levels = (low, high) if sampler.chance(0.75) else (high,)
    groups: list[Group] = []
    for z in levels:
        rails, soft = _deck(sampler, width, length, z)
        frame += rails
        groups += soft
    for z in (high + 0.2, height - 0.06):
        frame.append(box((0.02, 2 * y, 0.07), (x, 0, z)))
        frame.append(box((0.02, 2 * y * 0.7, 0.07), (-x, y * 0.3, z)))
        frame += [box((2 * x, 0.02, 0.066), (0, s * y, z + 0.002)) for s in (-1, 1)]
    frame.append(box((0.05, 0.05, height - high + 0.05), (-x, -y * 0.4, high - 0.05)))
    foot, lean = -x - sampler.uniform(0.03, 0.25), -x - 0.03
    rungs = []
    for at in (-y + 0.08, -y * 0.5):
        rungs.append(rod((foot, at, 0), (lean, at, high + 0.2), 0.018))
    for z in np.arange(0.22, high + 0.1, 0.24).tolist():
        across = foot + (lean - foot) * z / (high + 0.2)
        rungs.append(rod((across, -y + 0.08, z), (across, -y * 0.5, z), 0.015))
    material = sampler.wood() if sampler.chance(0.7) else sampler.metal()
    model = assemble(
        "bed",
        (material, frame),
        (material if sampler.chance(0.6) else sampler.metal(), rungs),
        *groups,
        support_surfaces=head_area(width, length, levels[0] + 0.2),
    )
    return settled(sideways(model) if sampler.chance(0.6) else model)


DESIGNS: dict[str, tuple[ModelFactory, ...]] = {
    "bed": (
        childs_bed,
        bunk,
    ),
}
