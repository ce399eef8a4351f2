"""Parts of bicycles: wheels, stays, drive, saddle, handlebar; along x, the front towards +x."""

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
    torus,
    tube,
)


class BicyclePlan(NamedTuple):
    """Where the joints of a frame are, metres: x and z in its plane."""

    radius: float
    rear: Vec
    front: Vec
    crank: Vec
    seat: Vec
    head: Vec
    low_head: Vec


def frame_plan(radius: float, base: float, seat_z: float, head_z: float) -> BicyclePlan:
    """The joints for a wheel radius, a wheelbase and the heights of saddle tube and head."""
    half = base / 2
    crank = (-0.08 * base, 0.0, max(radius * 0.85, 0.15))
    lean = 0.32 * (seat_z - crank[2])
    lift = head_z - radius
    low = head_z - min(0.14, 0.3 * lift)
    slope = 0.3
    head = (half - 0.04 - slope * lift, 0.0, head_z)
    low_head = (half - 0.04 - slope * (low - radius), 0.0, low)
    seat = (crank[0] - lean, 0.0, seat_z)
    return BicyclePlan(radius, (-half, 0, radius), (half, 0, radius), crank, seat, head, low_head)


def wheels(plan: BicyclePlan, tyre: float, spokes: int) -> tuple[list[Mesh], list[Mesh]]:
    """Tyres, and rims, hubs and spokes."""
    tyres, metal = [], []
    for hub in (plan.rear, plan.front):
        tyres.append(torus(plan.radius - tyre, tyre, segments=24).rotated("x", 90).translated(*hub))
        rim = torus(plan.radius - 2 * tyre, 0.009, segments=20).rotated("x", 90)
        metal.append(rim.translated(*hub))
        metal.append(
            cylinder(0.022, 0.1, segments=8).rotated("x", 90).translated(hub[0], 0.05, hub[2])
        )
        reach = plan.radius - 2 * tyre
        for a in np.linspace(0, 2 * np.pi, spokes, endpoint=False):
            end = (hub[0] + reach * float(np.cos(a)), 0.0, hub[2] + reach * float(np.sin(a)))
            metal.append(rod(hub, end, 0.003 if spokes > 6 else 0.012, 4))
    return tyres, metal


def stays(plan: BicyclePlan, thick: float) -> list[Mesh]:
    """Twin chain and seat stays and the fork, left and right of the wheels."""
    bars = []
    for y in (-0.045, 0.045):
        ends = [(plan.crank, plan.rear), (plan.seat, plan.rear), (plan.low_head, plan.front)]
        for (ax, _, az), (bx, _, bz) in ends:
            bars.append(rod((ax, y * 0.5, az - 0.02), (bx, y, bz), thick, 6))
    return bars


def drive_train(plan: BicyclePlan, arm: float) -> tuple[list[Mesh], list[Mesh]]:
    """Chainring, chain and crank arms; pedals."""
    x, _, z = plan.crank
    ring = cylinder(arm * 0.55, 0.012, segments=14).rotated("x", 90).translated(x, -0.04, z)
    metal, black = [ring], []
    for dz in (arm * 0.5, -arm * 0.5):
        metal.append(
            rod((x, -0.045, z + dz), (plan.rear[0], -0.045, plan.rear[2] + dz * 0.5), 0.005, 4)
        )
    for side in (-1, 1):
        foot = (x + side * arm * 0.75, side * 0.075, z - side * arm * 0.65)
        metal.append(rod((x, side * 0.06, z), foot, 0.01, 6))
        black.append(box((0.09, 0.08, 0.022), (foot[0], foot[1] + side * 0.04, foot[2] - 0.01)))
    metal.append(rod((x, -0.07, z), (x, 0.07, z), 0.014, 6))
    return metal, black


def saddle_on_post(plan: BicyclePlan, post: float, width: float) -> tuple[Mesh, list[Mesh]]:
    """The post, and a saddle with a broad rear and a thin nose."""
    x, _, z = plan.seat
    top = (x - 0.3 * post, 0.0, z + post)
    rear = ellipsoid((0.1, width, 0.035), (top[0] - 0.05, 0, top[2] + 0.015), 10)
    nose = ellipsoid((0.15, 0.03, 0.026), (top[0] + 0.05, 0, top[2] + 0.015), 8)
    return rod(plan.seat, top, 0.013), [rear, nose]


def mudguards(plan: BicyclePlan, reach: float) -> list[Mesh]:
    """Guards over both wheels: arcs of a tube flattened to a band."""
    guards = []
    for hub, start, end in ((plan.rear, 25, 25 + reach), (plan.front, 40, 40 + reach * 0.75)):
        a = np.radians(np.linspace(start, end, 9))
        r = plan.radius + 0.018
        arc = np.stack([r * np.cos(a), 0 * a, r * np.sin(a)], axis=1)
        guards.append(tube(arc, 0.011, 6).scaled(1.0, 2.6, 1.0).translated(*hub))
    return guards


def handlebar(
    plan: BicyclePlan, rise: float, width: float, back: float
) -> tuple[list[Mesh], list[Mesh], Vec]:
    """A bar swept ``back`` at its ends; grips; the middle of the bar."""
    x, _, z = plan.head
    middle = (x - 0.3 * rise + 0.03, 0.0, z + rise)
    w = width / 2
    line = [
        (middle[0] - back, -w, middle[2] + 0.01),
        (middle[0], -w * 0.5, middle[2] + 0.015),
        middle,
        (middle[0], w * 0.5, middle[2] + 0.015),
        (middle[0] - back, w, middle[2] + 0.01),
    ]
    grips = []
    for side, (a, b) in ((-1, (line[0], line[1])), (1, (line[4], line[3]))):
        near = tuple(0.55 * p + 0.45 * q for p, q in zip(a, b, strict=True))
        out = (a[0] - 0.02, a[1] + side * 0.01, a[2])
        grips.append(rod(out, (near[0], near[1], near[2]), 0.018, 8))
    return [rod(plan.head, middle, 0.014), tube(line, 0.011)], grips, middle


def wire_basket(at: Vec, w: float, d: float, h: float) -> list[Mesh]:
    """A wire basket, its foot at ``at``."""
    x, y, z = at
    wires = []
    for k in range(4):
        s = 0.8 + 0.2 * k / 3
        ring = [
            (x + u * d * s / 2, y + v * w * s / 2, z + h * k / 3)
            for u, v in ((-1, -1), (1, -1), (1, 1), (-1, 1))
        ]
        wires += [rod(p, q, 0.005, 4) for p, q in zip(ring, [*ring[1:], ring[0]], strict=True)]
    for k in np.linspace(-0.5, 0.5, 6):
        for u in (-0.5, 0.5):
            wires.append(
                rod((x + u * d * 0.8, y + k * w * 0.8, z), (x + u * d, y + k * w, z + h), 0.004, 4)
            )
            wires.append(
                rod((x + k * d * 0.8, y + u * w * 0.8, z), (x + k * d, y + u * w, z + h), 0.004, 4)
            )
    wires.append(box((d * 0.8, w * 0.8, 0.006), (x, y, z)))
    return wires
