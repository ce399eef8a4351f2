"""Radiators of many makes: columns, panels, ladders, tubes, portable ones; the wall is at +y."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import Mesh, box, cone, cylinder, rod, rounded_box
from onemap_simulator.generation.model import Model
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.radiator_parts import radiator_paint, valve
from onemap_tools.train.variety.designs.radiators_portable import convector, oil_filled
from onemap_tools.train.variety.designs.radiators_upright import towel_ladder, vertical
from onemap_tools.train.variety.designs.sanitary import stand


def _column(x: float, height: float, pitch: float, tubes: int) -> list[Mesh]:
    """One section of a column radiator: upright tubes one behind the other with round ends."""
    gap = 0.055
    ys = [(i - (tubes - 1) / 2) * gap for i in range(tubes)]
    radius = min(pitch * 0.36, 0.024)
    parts = [cylinder(radius, height - 0.08, (x, y, 0.04), 8) for y in ys]
    depth = gap * (tubes - 1) + 2.4 * radius
    parts += [
        rounded_box((pitch * 0.9, depth, 0.075), (x, 0, z), 0.028) for z in (0.0, height - 0.075)
    ]
    return parts


def cast_iron(sampler: Sampler) -> Model:
    """Sections of cast-iron columns on feet, with a valve."""
    height, pitch = sampler.size(0.35, 0.85), sampler.uniform(0.048, 0.065)
    count, tubes, lift = sampler.integer(6, 17), sampler.integer(2, 4), sampler.uniform(0.06, 0.12)
    count = min(count, 3600 // (32 * tubes + 264) + 1)
    width = count * pitch
    iron: list[Mesh] = []
    for i in range(count):
        iron += _column((i + 0.5) * pitch - width / 2, height, pitch, tubes)
    iron = [m.translated(0, 0, lift) for m in iron]
    for x in (-width / 2 + pitch / 2, width / 2 - pitch / 2):
        for y in (-0.04, 0.04):
            iron.append(cone((0.026, 0.016), lift + 0.03, (x, y * (tubes - 1) / 2, 0), 8))
    pipe, head = valve(sampler, width / 2 * sampler.choice((-1, 1)), lift + 0.04)
    iron.append(
        rod(
            (-width / 2 - 0.012, 0, lift + height - 0.04),
            (width / 2 + 0.012, 0, lift + height - 0.04),
            0.02,
        )
    )
    shelf: list[Mesh] = []
    if sampler.chance(0.25):
        shelf = [box((width + 0.06, 0.2, 0.025), (0, 0, lift + height + 0.001))]
    return stand(
        "radiator",
        (radiator_paint(sampler), iron),
        (sampler.metal(), pipe),
        (sampler.plastic(), head),
        (sampler.wood(), shelf),
    )


def _relief(sampler: Sampler, width: float, height: float, lift: float) -> list[Mesh]:
    """What stands out of the front sheet: upright ridges, lying ones or nothing."""
    kind = sampler.integer(0, 2)
    if kind == 0:
        count = int(width / 0.045)
        return [
            rounded_box(
                (0.022, 0.016, height - 0.08),
                ((i - (count - 1) / 2) * 0.045, -0.011, lift + 0.04),
                0.007,
            )
            for i in range(count)
        ]
    elif kind == 1:
        count = int(height / 0.06)
        return [
            box(
                (width - 0.02, 0.008, 0.045),
                (0, -0.013, lift + 0.012 + i * (height - 0.02) / count),
            )
            for i in range(count)
        ]
    return []


def flat_panel(sampler: Sampler) -> Model:
    """One or two sheets with grooves or quite flat, a grille on top and closed sides."""
    width, height, lift = sampler.size(0.5, 1.3), sampler.size(0.3, 0.7), sampler.size(0.08, 0.16)
    plates, y = sampler.integer(1, 3), 0.0
    paint = radiator_paint(sampler)
    sheets: list[Mesh] = []
    for i in range(plates):
        y = i * 0.05
        sheets.append(rounded_box((width, 0.022, height), (0, y, lift), 0.01))
    sheets += _relief(sampler, width, height, lift)
    sheets += [
        box((0.012, y + 0.03, height * 0.97), (s * (width / 2 - 0.002), y / 2, lift + 0.01))
        for s in (-1, 1)
    ]
    slats = [
        box((width - 0.01, 0.008, 0.02), (0, s, lift + height - 0.01))
        for s in np.arange(0.0, y + 0.02, 0.012)
    ]
    ribs = [
        box((0.012, y + 0.02, 0.012), (x, y / 2, lift + height))
        for x in np.linspace(-width / 2 + 0.02, width / 2 - 0.02, int(width / 0.05))
    ]
    hooks = [
        box((0.04, 0.05, 0.12), (s * width * 0.35, y + 0.03, lift + height * 0.6)) for s in (-1, 1)
    ]
    pipe, head = valve(
        sampler,
        width / 2 * sampler.choice((-1, 1)),
        lift + (0.05 if sampler.chance(0.5) else height - 0.06),
    )
    grille = slats if sampler.chance(0.5) else ribs
    return stand(
        "radiator",
        (paint, [*sheets, *hooks]),
        (sampler.metal(), pipe),
        (sampler.plastic(), head),
        (paint, grille),
    )


def tubular(sampler: Sampler) -> Model:
    """Two or three long horizontal finned or smooth tubes, or many, on end stands."""
    width, lift = sampler.size(0.6, 1.4), sampler.size(0.1, 0.2)
    many = sampler.chance(0.5)
    count = sampler.integer(5, 10) if many else sampler.integer(1, 3)
    radius = sampler.uniform(0.016, 0.026) if many else sampler.uniform(0.03, 0.05)
    pitch = radius * sampler.uniform(2.2, 3.0) if many else 0.17
    lengths = width
    bars: list[Mesh] = []
    fins: list[Mesh] = []
    for i in range(count):
        z = lift + radius + i * pitch
        bars.append(rod((-lengths / 2, 0, z), (lengths / 2, 0, z), radius, 12))
        if not many and sampler.chance(0.7):
            n = int(width / 0.04 / count)
            fins += [
                cylinder(radius * 1.55, 0.006, segments=12).rotated("y", 90).translated(x, 0, z)
                for x in np.linspace(-width * 0.45, width * 0.45, n).tolist()
            ]
    top = lift + radius + (count - 1) * pitch
    ends = [box((0.035, 0.05, top + 0.03), (s * width * 0.47, 0.02, 0)) for s in (-1, 1)]
    if many:
        ends = [
            rod((s * width / 2, 0, 0), (s * width / 2, 0, top + radius), radius * 1.3, 12)
            for s in (-1, 1)
        ]
    feet = [
        box((0.07, 0.14, 0.015), (s * width * (0.5 if many else 0.47), 0.01, 0)) for s in (-1, 1)
    ]
    knob = [
        cylinder(0.026, 0.07, segments=10).rotated("y", 90).translated(width / 2 + radius, 0, top)
    ]
    return stand(
        "radiator",
        (radiator_paint(sampler), [*bars, *fins, *ends]),
        (sampler.metal(), feet),
        (sampler.plastic(), knob),
    )


DESIGNS: dict[str, tuple[ModelFactory, ...]] = {
    "radiator": (cast_iron, flat_panel, towel_ladder, tubular, oil_filled, vertical, convector)
}
