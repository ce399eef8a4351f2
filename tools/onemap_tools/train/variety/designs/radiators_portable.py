"""Electric heaters that stand free: fins with oil on castors, a thin case on feet."""

from __future__ import annotations

from onemap_simulator.generation.mesh import (
    Mesh,
    box,
    cylinder,
    ellipsoid,
    rod,
    rounded_box,
    torus,
    tube,
)
from onemap_simulator.generation.model import Model
from onemap_simulator.generation.sampler import Sampler
from onemap_tools.train.variety.designs.radiator_parts import radiator_paint
from onemap_tools.train.variety.designs.sanitary import stand


def _fins(count: int, pitch: float, size: tuple[float, float], lift: float) -> list[Mesh]:
    """Fins of depth and height in a row along x, their cores and the pipes that join them."""
    deep, tall = size
    length = count * pitch
    fins = [
        rounded_box((pitch * 0.3, deep, tall), ((i + 0.5) * pitch - length / 2, 0, lift), 0.006)
        for i in range(count)
    ]
    fins += [
        rounded_box(
            (pitch * 0.6, deep * 0.35, tall * 0.96),
            ((i + 0.5) * pitch - length / 2, 0, lift + tall * 0.02),
            0.01,
        )
        for i in range(count)
    ]
    fins += [
        rod((-length / 2, 0, lift + z), (length / 2, 0, lift + z), 0.026, 10)
        for z in (0.06, tall - 0.06)
    ]
    return fins


def _castors(ends: tuple[float, float], deep: float, lift: float) -> tuple[list[Mesh], list[Mesh]]:
    """Axles below a body of depth ``deep`` at the given places of x, and their wheels."""
    wheels: list[Mesh] = []
    axles: list[Mesh] = []
    for wx in ends:
        axles.append(box((0.035, deep + 0.1, 0.02), (wx, 0, 0.04)))
        axles.append(box((0.03, deep * 0.5, lift), (wx, 0, 0.04)))
        for y in (-1, 1):
            wheels.append(
                cylinder(0.028, 0.022, segments=12)
                .rotated("x", 90)
                .translated(wx, y * (deep / 2 + 0.04) + 0.011, 0.028)
            )
    return axles, wheels


def oil_filled(sampler: Sampler) -> Model:
    """A portable radiator of fins on castors, with a control box, a handle and a cable."""
    count, pitch = sampler.integer(5, 12), sampler.uniform(0.036, 0.048)
    tall, deep, lift = sampler.size(0.42, 0.62), sampler.size(0.13, 0.2), sampler.uniform(0.06, 0.1)
    length = count * pitch
    fins = _fins(count, pitch, (deep, tall), lift)
    control = [
        rounded_box(
            (0.09, deep * 0.95, tall * sampler.uniform(0.75, 1.05)),
            (length / 2 + 0.045, 0, lift),
            0.02,
        )
    ]
    x = length / 2 + 0.09
    dials = [
        cylinder(r, 0.02, segments=12).rotated("y", 90).translated(x, 0, lift + tall * z)
        for r, z in ((0.032, 0.62), (0.025, 0.42))
    ]
    dials += [box((0.012, 0.03, 0.02), (x, y, lift + tall * 0.25)) for y in (-0.03, 0.03)]
    grip = [
        tube(
            [
                (length / 2 + 0.02, 0, lift + tall * 0.95),
                (length / 2, 0, lift + tall + 0.05),
                (length / 2 - 0.12, 0, lift + tall + 0.05),
                (length / 2 - 0.14, 0, lift + tall - 0.01),
            ],
            0.012,
            8,
        )
    ]
    ends = (-length / 2 + pitch, length / 2 - pitch * 0.5)
    axles, wheels = _castors(ends, deep, lift)
    cable = tube(
        [
            (x - 0.03, deep * 0.45, lift + 0.1),
            (x + 0.03, deep * 0.6, 0.04),
            (x - 0.1, deep * 0.7, 0.008),
            (x - 0.25, deep * 0.7, 0.008),
        ],
        0.006,
    )
    paint = radiator_paint(sampler)
    return stand(
        "radiator",
        (paint, fins),
        (paint if sampler.chance(0.4) else sampler.dark(), [*control, *grip, *axles]),
        (sampler.plastic(), dials),
        (sampler.dark(), [*wheels, cable]),
    )


def convector(sampler: Sampler) -> Model:
    """A long low electric heater: a thin case with slots, on two splayed feet."""
    width, tall, lift = (
        sampler.size(0.5, 0.95),
        sampler.size(0.32, 0.46),
        sampler.uniform(0.04, 0.09),
    )
    case = [rounded_box((width, 0.09, tall), (0, 0, lift), sampler.uniform(0.01, 0.04))]
    count = int((width - 0.1) / 0.035)
    slots = [
        box((0.02, 0.012, tall * 0.22), ((i - (count - 1) / 2) * 0.035, -0.043, lift + tall * 0.66))
        for i in range(count)
    ]
    if sampler.chance(0.5):
        slots = [
            box((width * 0.82, 0.012, 0.014), (0, -0.043, lift + tall * 0.55 + i * 0.026))
            for i in range(sampler.integer(3, 6))
        ]
    feet = [box((0.035, 0.24, 0.02), (s * width * 0.36, 0, 0)) for s in (-1, 1)]
    feet += [box((0.03, 0.06, lift + 0.01), (s * width * 0.36, 0, 0)) for s in (-1, 1)]
    side = width / 2
    knobs = [
        cylinder(0.025, 0.025, segments=12)
        .rotated("y", 90)
        .translated(side - 0.003, 0, lift + tall * z)
        for z in (0.72, 0.45)
    ]
    knobs += [
        torus(0.03, 0.006, segments=12)
        .rotated("y", 90)
        .translated(side + 0.004, 0, lift + tall * 0.72),
        ellipsoid((0.01, 0.012, 0.012), (side, 0, lift + tall * 0.25), 8),
    ]
    return stand(
        "radiator",
        (sampler.enamel(), case),
        (sampler.dark(), [*slots]),
        (sampler.plastic(), feet),
        (sampler.dark(), knobs),
    )
