"""Bicycles, guitars, teddy bears and balls."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import (
    Mesh,
    box,
    box_between,
    cylinder,
    ellipsoid,
    from_faces,
    prism,
    rod,
    torus,
    tube,
)
from onemap_simulator.generation.model import Model, assemble
from onemap_simulator.generation.sampler import Sampler


def bicycle(sampler: Sampler) -> Model:
    """Two spoked wheels, a diamond or step-through frame, saddle, handlebar and pedals; along x."""
    radius, base = sampler.size(0.29, 0.34), sampler.size(0.95, 1.05)
    paint, dark, metal = sampler.plastic(), sampler.dark(), sampler.metal()
    rear, head = (-base / 2, 0.0, radius), (base / 2, 0.0, radius)
    crank, seat = (-0.06, 0.0, radius * 0.9), (-0.2, 0.0, radius + 0.42)
    neck, low_neck = (base / 2 - 0.14, 0.0, radius + 0.44), (base / 2 - 0.11, 0.0, radius + 0.32)
    wheels = [_wheel(radius, hub) for hub in (rear, head)]
    pairs = [
        (rear, crank),
        (rear, seat),
        (crank, seat),
        (crank, low_neck),
        (low_neck, head),
        (low_neck, neck),
    ]
    if sampler.chance(0.7):
        pairs.append((seat, neck))
    frame = [rod(a, b, 0.019) for a, b in pairs]
    saddle = (-0.23, 0.0, radius + 0.5)
    black = [ellipsoid((0.14, 0.075, 0.035), saddle, 10)]
    bars = [rod(seat, saddle, 0.013), rod(neck, (neck[0] + 0.02, 0, neck[2] + 0.1), 0.014)]
    grip = (neck[0] + 0.02, neck[2] + 0.1)
    bars.append(
        tube(
            [
                (grip[0] - 0.14, -0.27, grip[1]),
                (grip[0], -0.14, grip[1] + 0.02),
                (grip[0], 0.14, grip[1] + 0.02),
                (grip[0] - 0.14, 0.27, grip[1]),
            ],
            0.013,
        )
    )
    bars.append(
        cylinder(0.08, 0.02, segments=14).rotated("x", 90).translated(crank[0], 0.05, crank[2])
    )
    for side in (-1, 1):
        foot = (crank[0] + side * 0.11, side * 0.07, crank[2] - side * 0.1)
        bars.append(rod((crank[0], side * 0.05, crank[2]), foot, 0.01))
        black.append(box((0.08, 0.09, 0.02), (foot[0], foot[1] + side * 0.04, foot[2])))
    tyres = [tyre for tyre, _ in wheels]
    spokes = [part for _, parts in wheels for part in parts]
    return assemble("bicycle", (paint, frame), (dark, [*tyres, *black]), (metal, [*spokes, *bars]))


def _wheel(radius: float, hub: tuple[float, float, float]) -> tuple[Mesh, list[Mesh]]:
    """A tyre, and its rim, axle and spokes."""
    x, _, z = hub
    tyre = torus(radius - 0.022, 0.022, segments=24).rotated("x", 90).translated(*hub)
    metal = [
        torus(radius - 0.05, 0.009, segments=24).rotated("x", 90).translated(*hub),
        cylinder(0.025, 0.1, segments=8).rotated("x", 90).translated(x, 0.05, z),
    ]
    reach = radius * 0.86
    for angle in np.linspace(0, 2 * np.pi, 10, endpoint=False):
        rim = (x + reach * float(np.cos(angle)), 0.0, z + reach * float(np.sin(angle)))
        metal.append(rod(hub, rim, 0.004, 4))
    return tyre, metal


def guitar(sampler: Sampler) -> Model:
    """A guitar that leans back on a small stand: waisted body, sound hole, neck and head."""
    length, thick = sampler.size(0.42, 0.5), sampler.size(0.07, 0.1)
    wood, dark_wood = sampler.wood(), sampler.material("wood", 0.5, (0.22, 0.13, 0.08))
    t = np.linspace(0, 2 * np.pi, 28, endpoint=False)
    z = (1 - np.cos(t)) / 2
    lower, upper, waist = sampler.size(0.19, 0.22), sampler.size(0.13, 0.155), 0.11
    half = np.interp(
        z,
        [0, 0.08, 0.28, 0.58, 0.8, 0.94, 1.0],
        [0.05, 0.7 * lower, lower, waist, upper, 0.75 * upper, 0.03],
    )
    outline = np.stack([half * np.sign(np.sin(t)) * np.abs(np.sign(np.sin(t))), z * length], axis=1)
    outline[0, 0] = outline[14, 0] = 0.0
    body = prism(outline[::-1], thick).rotated("x", 90)
    hole = cylinder(0.05, 0.01, segments=16).rotated("x", 90).translated(0, -thick, length * 0.66)
    neck_l = length * 0.95
    neck = box_between(
        (-0.028, -thick - 0.012, length * 0.75), (0.028, -thick + 0.02, length + neck_l * 0.8)
    )
    head = box_between(
        (-0.045, -thick - 0.005, length + neck_l * 0.78), (0.045, -thick + 0.02, length + neck_l)
    )
    bridge = box_between((-0.07, -thick - 0.02, length * 0.28), (0.07, -thick, length * 0.32))
    pegs = [
        rod(
            (x * 0.04, -thick, length + neck_l * k),
            (x * 0.07, -thick, length + neck_l * k),
            0.009,
            6,
        )
        for x in (-1, 1)
        for k in (0.83, 0.89, 0.95)
    ]
    stand = [rod((x * 0.16, -0.16, 0.0), (x * 0.1, -0.02, 0.12), 0.012) for x in (-1, 1)] + [
        rod((0, 0.24, 0.0), (0, 0.06, 0.42), 0.012),
        rod((-0.13, -0.08, 0.09), (0.13, -0.08, 0.09), 0.012),
    ]
    return assemble(
        "guitar",
        (wood, [_leaning(body)]),
        (dark_wood, [_leaning(m) for m in (neck, head, hole, bridge)]),
        (sampler.metal(), [_leaning(m) for m in pegs]),
        (sampler.dark(), stand),
    )


def _leaning(mesh: Mesh) -> Mesh:
    return mesh.rotated("x", -12).translated(0, 0, 0.09)


def teddy_bear(sampler: Sampler) -> Model:
    """A sitting bear: belly, head with round ears and a muzzle, four limbs."""
    scale = sampler.size(0.36, 0.46) / 0.42
    hue = sampler.uniform(0.5, 1.1)
    fur = sampler.material(
        "noise",
        0.15,
        (0.7 * hue, 0.5 * hue, 0.3 * hue) if sampler.chance(0.55) else sampler.colour(),
    )
    light, dark = (
        sampler.material("noise", 0.15, sampler.grey(0.7, 0.95, tint=0.25)),
        sampler.dark(),
    )
    body = [
        ellipsoid((0.11, 0.095, 0.13), (0, 0, 0.13), 12),
        ellipsoid((0.095, 0.088, 0.085), (0, -0.01, 0.315), 12),
    ]
    for side in (-1, 1):
        body += [
            ellipsoid((0.035, 0.02, 0.035), (side * 0.075, 0.0, 0.385), 8),
            ellipsoid((0.04, 0.04, 0.085), (0, 0, 0), 8)
            .rotated("y", side * 40)
            .rotated("x", -25)
            .translated(side * 0.125, -0.04, 0.18),
            ellipsoid((0.048, 0.1, 0.048), (side * 0.085, -0.12, 0.05), 8),
        ]
    pale = [
        ellipsoid((0.042, 0.035, 0.032), (0, -0.09, 0.295), 8),
        ellipsoid((0.07, 0.03, 0.085), (0, -0.075, 0.13), 10),
    ]
    pale += [ellipsoid((0.036, 0.012, 0.036), (side * 0.085, -0.215, 0.055), 8) for side in (-1, 1)]
    black = [ellipsoid((0.015, 0.012, 0.012), (0, -0.125, 0.305), 6)]
    black += [ellipsoid((0.012, 0.01, 0.012), (side * 0.035, -0.09, 0.34), 6) for side in (-1, 1)]
    groups = [
        (material, [mesh.scaled(scale, scale, scale) for mesh in meshes])
        for material, meshes in ((fur, body), (light, pale), (dark, black))
    ]
    return assemble("teddy bear", *groups)


def ball(sampler: Sampler) -> Model:
    """A ball with coloured segments, or patches as a football has."""
    radius = sampler.size(0.11, 0.15)
    sphere = ellipsoid((radius, radius, radius), (0, 0, radius), 18)
    first, second = sampler.plastic(), sampler.plastic()
    centres = sphere.vertices[sphere.faces].mean(axis=1) - (0, 0, radius)
    if sampler.chance(0.5):
        sector = np.floor(np.degrees(np.arctan2(centres[:, 1], centres[:, 0])) / 60).astype(int) % 2
    else:
        golden = (1 + 5**0.5) / 2
        poles = np.array([(0, s, t * golden) for s in (-1, 1) for t in (-1, 1)])
        poles = np.concatenate([poles, poles[:, [2, 0, 1]], poles[:, [1, 2, 0]]])
        cosine = (centres @ poles.T).max(axis=1) / radius / np.linalg.norm(poles[0])
        sector = (cosine > 0.9).astype(int)
    halves = [from_faces(sphere.vertices, sphere.faces[sector == side]) for side in (0, 1)]
    axis, tilt = sampler.choice(["x", "y"]), sampler.uniform(0, 90)
    rotated = [
        m.translated(0, 0, -radius).rotated(axis, tilt).translated(0, 0, radius) for m in halves
    ]
    return assemble("ball", (first, [rotated[0]]), (second, [rotated[1]]))
