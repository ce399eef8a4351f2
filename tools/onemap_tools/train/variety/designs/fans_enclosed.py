"""Fans in a case: square boxes and industrial drums."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import Mesh, box, cylinder, lathe, rod, torus, tube
from onemap_simulator.generation.model import Model
from onemap_simulator.generation.sampler import Sampler
from onemap_tools.train.variety.designs.fan_parts import rotor_blades
from onemap_tools.train.variety.designs.sanitary import ring, skin, stand


def _grilles(sampler: Sampler, radius: float, deep: float, z: float) -> list[Mesh]:
    """Bars in front of and behind a round hole at height z: level ones, or rings and spokes."""
    bars: list[Mesh] = []
    kind = sampler.integer(0, 2)
    for y in (-deep / 2 - 0.002, deep / 2 + 0.002):
        if kind == 0:
            spread = np.linspace(-0.9, 0.9, 13) * radius
            bars += [
                rod(
                    (-np.sqrt(radius**2 - s * s), y, z + s),
                    (np.sqrt(radius**2 - s * s), y, z + s),
                    0.004,
                    5,
                )
                for s in spread.tolist()
            ]
            bars.append(rod((0, y, z - radius), (0, y, z + radius), 0.006, 5))
        else:
            bars += [
                torus(radius * s, 0.004, segments=22).rotated("x", 90).translated(0, y, z)
                for s in (0.25, 0.5, 0.75, 0.97)
            ]
            n = 4 if kind == 1 else 12
            bars += [
                rod((0, y, z), (radius * np.cos(a), y, z + radius * np.sin(a)), 0.004, 5)
                for a in np.linspace(0.4, 0.4 + 2 * np.pi, n, endpoint=False).tolist()
            ]
    return bars


def box_fan(sampler: Sampler) -> Model:
    """A square case with a rotor behind bars, a handle on top and two feet."""
    side, deep, lift = sampler.size(0.34, 0.56), sampler.size(0.1, 0.16), 0.02
    radius, wall = side / 2 - 0.035, 0.025
    soft = sampler.uniform(6, 40)
    inner = (radius * 2, radius * 2)
    rings = [
        ring((side, side), -deep / 2, soft),
        ring((side, side), deep / 2, soft),
        ring(inner, deep / 2),
        ring(inner, -deep / 2),
        ring((side, side), -deep / 2, soft),
    ]
    z = lift + side / 2
    case = [skin(rings, capped=False).rotated("x", 90).translated(0, 0, z)]
    bars = _grilles(sampler, radius, deep, z)
    rotor = [m.translated(0, 0, z) for m in rotor_blades(sampler, radius * 0.9)]
    feet = [box((0.04, deep + 0.12, lift + 0.008), (s * side * 0.35, 0, 0)) for s in (-1, 1)]
    top = lift + side
    feet.append(
        tube(
            [
                (-0.07, 0, top - 0.006),
                (-0.06, 0, top + 0.035),
                (0.06, 0, top + 0.035),
                (0.07, 0, top - 0.006),
            ],
            0.009,
        )
    )
    feet.append(
        cylinder(0.022, 0.02, segments=12)
        .rotated("x", 90)
        .translated(side / 2 - wall - 0.01, -deep / 2 + 0.004, lift + 0.05)
    )
    return stand(
        "fan",
        (sampler.enamel(), case),
        (sampler.metal(), bars),
        (sampler.plastic(), rotor),
        (sampler.dark(), feet),
    )


def _wires(radius: float, deep: float) -> list[Mesh]:
    """Rings and spokes over both ends of a drum about the y axis."""
    wires: list[Mesh] = []
    for y in (-deep / 2, deep / 2):
        wires += [
            torus(radius * s, 0.004, segments=20).rotated("x", 90).translated(0, y, 0)
            for s in (0.2, 0.4, 0.6, 0.8)
        ]
        wires += [
            rod((0, y, 0), (radius * np.cos(a), y, radius * np.sin(a)), 0.005, 5)
            for a in np.linspace(0, 2 * np.pi, 6, endpoint=False).tolist()
        ]
    return wires


def _drum_frame(x: float, z: float, spread: float) -> list[Mesh]:
    """A bent tube with a hinge at height z on each side (-x, x), and two bars between them."""
    frame: list[Mesh] = []
    for s in (-1, 1):
        frame.append(
            tube(
                [
                    (s * x, -spread, 0.016),
                    (s * x, -spread * 0.3, 0.04),
                    (s * x, 0, z),
                    (s * x, spread * 0.3, 0.04),
                    (s * x, spread, 0.016),
                ],
                0.014,
            )
        )
        frame.append(
            cylinder(0.03, 0.05, segments=12).rotated("y", 90).translated(s * x - 0.025, 0, z)
        )
    frame += [rod((-x, y, 0.016), (x, y, 0.016), 0.014) for y in (-spread, spread)]
    return frame


def _cart(x: float, spread: float, grip_z: float) -> tuple[list[Mesh], list[Mesh]]:
    """Two wheels behind a drum, and their axle with a handle at height ``grip_z``."""
    wheels = [
        cylinder(0.07, 0.03, segments=14)
        .rotated("y", 90)
        .translated(s * (x + 0.03) - 0.015, spread, 0.07 - 0.016)
        for s in (-1, 1)
    ]
    cart = [rod((-x - 0.03, spread, 0.054), (x + 0.03, spread, 0.054), 0.01)]
    cart += [
        tube(
            [
                (s * x * 0.5, spread, 0.02),
                (s * x * 0.5, spread + 0.08, 0.3),
                (s * x * 0.5, spread + 0.09, grip_z),
            ],
            0.012,
        )
        for s in (-1, 1)
    ]
    cart.append(
        rod(
            (-x * 0.5, spread + 0.09, grip_z),
            (x * 0.5, spread + 0.09, grip_z),
            0.012,
        )
    )
    return wheels, cart


def drum(sampler: Sampler) -> Model:
    """An industrial fan: a wide steel drum that tilts in a frame of tubes, on wheels or skids."""
    radius, deep = sampler.size(0.22, 0.4), sampler.size(0.16, 0.28)
    lift, tilt = sampler.uniform(0.06, 0.14), sampler.uniform(0, 22)
    z, x = radius + lift, radius + 0.045
    edges = [
        (radius, -deep / 2),
        (radius + 0.012, -deep / 2),
        (radius + 0.012, deep / 2),
        (radius, deep / 2),
        (radius, -deep / 2),
    ]
    shell = [lathe(edges, segments=24, capped=False).rotated("x", 90)]
    shell += [
        torus(radius + 0.01, 0.012, segments=24).rotated("x", 90).translated(0, s * deep / 2, 0)
        for s in (-1, 1)
    ]
    motor = [
        cylinder(radius * 0.25, deep * 0.6, segments=12)
        .rotated("x", 90)
        .translated(0, deep * 0.45, 0)
    ]
    moved = [
        [m.rotated("x", -tilt).translated(0, 0, z) for m in g]
        for g in (shell, _wires(radius, deep), motor, rotor_blades(sampler, radius * 0.95))
    ]
    spread = max(deep * 0.7, 0.16)
    frame = _drum_frame(x, z, spread)
    wheels: list[Mesh] = []
    if sampler.chance(0.5):
        wheels, cart = _cart(x, spread, z + radius * 0.6)
        frame += cart
    return stand(
        "fan",
        (sampler.metal() if sampler.chance(0.5) else sampler.enamel(), [*moved[0], *moved[2]]),
        (sampler.metal(), [*moved[1], *frame]),
        (sampler.plastic(), moved[3]),
        (sampler.dark(), wheels),
    )
