"""What turning seats stand on and lean against: a star of feet, armrests, a hollow back."""

from __future__ import annotations

import numpy as np

from onemap_shared.geometry import F64
from onemap_simulator.generation.mesh import Mesh, box, cylinder, lathe, rod
from onemap_simulator.generation.mesh import rounded_box as pad
from onemap_simulator.generation.model import Material
from onemap_simulator.generation.sampler import Sampler
from onemap_tools.train.variety.designs.seat_shapes import (
    SIDES,
    bent,
    sheet,
    swept,
    turned,
)

Groups = list[tuple[Material, list[Mesh]]]


def star(sampler: Sampler, radius: float, seat_h: float) -> Groups:
    """A star of five arms with castors or glides, a gas lift with its cover."""
    rolling, arch = sampler.chance(0.85), sampler.uniform(0.0, 0.05)
    foot = 0.06 if rolling else 0.012
    hub, arms, wheels = foot + 0.02 + arch, [], []
    flat = sampler.chance(0.5)
    for angle in np.radians(np.arange(5) * 72 + sampler.uniform(0, 72)).tolist():
        x, y = radius * np.cos(angle), radius * np.sin(angle)
        if flat:
            grid = np.array(
                [(0.03, 0, hub + 0.012), (radius * 0.6, 0, hub), (radius, 0, foot + 0.01)]
            )
            edge = np.array([(0, 0.032, 0), (0, 0.028, 0), (0, 0.016, 0)])
            arm = sheet(np.stack([grid - edge, grid + edge], axis=1), 0.022)
            arms.append(arm.rotated("z", float(np.degrees(angle))))
        else:
            low = (float(x), float(y), foot + 0.012)
            arms.append(turned((0, 0, hub + 0.01), low, [(0.026, 0.0), (0.02, 0.6), (0.014, 1.0)]))
        if rolling:
            turn = sampler.uniform(0, 360)
            for side in (-0.013, 0.013):
                wheel = cylinder(0.027, 0.018, (0, 0, -0.009), 12).rotated("x", 90)
                wheels.append(
                    wheel.translated(0, side, 0).rotated("z", turn).translated(x, y, 0.027)
                )
            wheels.append(cylinder(0.01, 0.03, (x, y, 0.04), 6))
        else:
            wheels.append(cylinder(0.022, 0.015, (x, y, 0.0), 10))
    arms.append(lathe([(0.045, hub - 0.02), (0.045, hub + 0.03), (0.028, hub + 0.06)], segments=12))
    middle = (hub + seat_h) / 2
    lift = [cylinder(0.025, middle - hub, (0, 0, hub), 10)]
    lift.append(cylinder(0.014, seat_h - middle + 0.01, (0, 0, middle - 0.01), 8))
    plate = [box((0.2, 0.22, 0.04), (0, 0, seat_h - 0.035))]
    if sampler.chance(0.6):
        plate.append(rod((0.08, 0.0, seat_h - 0.02), (0.24, -0.02, seat_h - 0.035), 0.006, 6))
    metal = sampler.metal() if sampler.chance(0.6) else sampler.plastic()
    dark = sampler.dark()
    return [(metal, arms), (dark, [*wheels, *lift, *plate])]


def armrests(sampler: Sampler, x: float, seat_h: float) -> tuple[list[Mesh], list[Mesh]]:
    """Posts and pads beside the seat, or bent loops."""
    arm_h, posts, pads = seat_h + sampler.uniform(0.17, 0.24), [], []
    loop = sampler.chance(0.35)
    for s in SIDES:
        if loop:
            ends = [(s * (x - 0.1), -0.1, seat_h), (s * x, -0.15, seat_h), (s * x, -0.17, arm_h)]
            rear = [(s * x, 0.16, arm_h), (s * x, 0.12, seat_h), (s * (x - 0.1), 0.1, seat_h)]
            posts.append(swept(bent([*ends, *rear], 0.06), 0.015))
        else:
            elbow = [
                (s * (x - 0.15), 0.02, seat_h - 0.01),
                (s * x, 0.02, seat_h),
                (s * x, 0.0, arm_h),
            ]
            posts.append(swept(bent(elbow, 0.04), 0.017))
        pads.append(pad((0.075, 0.25, 0.028), (s * x, -0.01, arm_h), 0.013))
    return posts, pads


def back_grid(width: float, z: tuple[float, float], y: float, lean: float, hollow: float) -> F64:
    """Points of a back with a lumbar curve, hollow across, rounded above and below."""
    up, across = np.linspace(0, 1, 8), np.linspace(-1, 1, 7)
    grid = np.empty((7, 8, 3))
    wide = width / 2 * (0.86 + 0.14 * np.sin(np.pi * up) - 0.12 * (up > 0.95))
    grid[..., 0] = np.outer(across, wide)
    curve = lean * up - 0.03 * np.sin(np.pi * np.clip(up * 1.6, 0, 1))
    grid[..., 1] = y + curve - hollow * across[:, None] ** 2
    grid[..., 2] = z[0] + up * (z[1] - z[0])
    return grid
