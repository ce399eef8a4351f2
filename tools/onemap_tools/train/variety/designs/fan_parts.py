"""Parts of fans: rotors, wire cages, and the head that both make with a motor."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import Mesh, cylinder, ellipsoid, lathe, prism, torus, tube
from onemap_simulator.generation.model import Material, Model
from onemap_simulator.generation.sampler import Sampler
from onemap_tools.train.variety.designs.sanitary import stand

Head = tuple[list[Mesh], list[Mesh], list[Mesh]]  # cage, blades, motor


def rotor_blades(sampler: Sampler, radius: float) -> list[Mesh]:
    """A rotor about the y axis: narrow or broad blades, three to seven."""
    count, broad = sampler.integer(3, 7), sampler.uniform(0.25, 0.5)
    half = radius * broad * (3.5 / count) ** 0.5
    outline = [
        (radius * 0.1, -half * 0.3),
        (radius * 0.7, -half),
        (radius * 0.94, -half * 0.6),
        (radius * 0.97, half * 0.3),
        (radius * 0.6, half * 0.7),
        (radius * 0.1, half * 0.35),
    ]
    start, pitch = sampler.uniform(0, 90), sampler.uniform(12, 28)
    blades = [
        prism(outline, 0.005)
        .rotated("x", pitch)
        .rotated("z", start + i * 360 / count)
        .rotated("x", 90)
        for i in range(count)
    ]
    return [
        *blades,
        cylinder(radius * 0.16, 0.05, segments=12).rotated("x", 90).translated(0, 0.02, 0),
    ]


def _cage(sampler: Sampler, radius: float, depth: float) -> list[Mesh]:
    """A wire cage about the origin: rim, rings or a spiral of spokes, front and back."""
    parts = [torus(radius, 0.008, segments=24).rotated("x", 90)]
    twist, spokes = sampler.choice((0.0, 0.0, 0.5)), sampler.integer(10, 22)
    rings = sampler.integer(0, 3)
    for side in (-1, 1):
        for i in range(rings):
            share = (i + 1) / (rings + 1)
            y = side * depth / 2 * (1 - share**3)
            parts.append(
                torus(radius * share, 0.004, segments=20).rotated("x", 90).translated(0, y, 0)
            )
        for angle in np.linspace(0, 2 * np.pi, spokes, endpoint=False):
            path = [
                (
                    radius * s * np.cos(angle + twist * s),
                    side * depth / 2 * (1 - s**3),
                    radius * s * np.sin(angle + twist * s),
                )
                for s in (0.2, 0.6, 0.85, 1.0)
            ]
            parts.append(tube(path, 0.0028, 3))
    parts.append(
        cylinder(radius * 0.24, 0.012, segments=14)
        .rotated("x", 90)
        .translated(0, -depth / 2 + 0.006, 0)
    )
    return parts


def caged_head(sampler: Sampler, radius: float) -> Head:
    """A caged rotor about the origin that looks to -y, with its motor behind."""
    depth = radius * sampler.uniform(0.5, 0.8)
    motor: list[Mesh] = [
        ellipsoid((radius * 0.3, radius * 0.45, radius * 0.3), (0, depth * 0.6, 0), 12)
    ]
    if sampler.chance(0.5):
        long = radius * 0.6
        motor = [
            lathe(
                [(radius * 0.26, 0), (radius * 0.3, long * 0.3), (radius * 0.2, long)], segments=12
            )
            .rotated("x", -90)
            .translated(0, depth * 0.25, 0)
        ]
    return _cage(sampler, radius, depth), rotor_blades(sampler, radius * 0.92), motor


def placed_head(sampler: Sampler, head: Head, z: float) -> Head:
    """A head at height z, at times tilted or turned."""
    tilt, turn = sampler.uniform(-4, 18), sampler.choice((0.0, 0.0, sampler.uniform(-35, 35)))

    def move(meshes: list[Mesh]) -> list[Mesh]:
        return [m.rotated("x", -tilt).rotated("z", turn).translated(0, -0.02, z) for m in meshes]

    cage, blades, motor = head
    return move(cage), move(blades), move(motor)


def assembled_fan(sampler: Sampler, body: list[Mesh], base: list[Mesh], head: Head) -> Model:
    """A fan of pole or keys (``body``), base and head, each of its material."""
    cage, blades, motor = head
    case: Material = sampler.plastic() if sampler.chance(0.5) else sampler.enamel()
    return stand(
        "fan",
        (case, [*motor, *base]),
        (sampler.metal(), body),
        (sampler.metal() if sampler.chance(0.6) else case, cage),
        (sampler.plastic() if sampler.chance(0.6) else sampler.metal(), blades),
    )
