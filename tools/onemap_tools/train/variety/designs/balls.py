"""Balls: football, basketball, beach, exercise, rugby and tennis balls."""

from __future__ import annotations

import numpy as np

from onemap_shared.geometry import F64
from onemap_simulator.generation.mesh import (
    Mesh,
    cylinder,
    ellipsoid,
    from_faces,
    lathe,
    torus,
    tube,
)
from onemap_simulator.generation.model import Material, Model, assemble
from onemap_simulator.generation.sampler import Sampler


def _set_down(sampler: Sampler, groups: list[tuple[Material, list[Mesh]]]) -> Model:
    """Turned at random about the centre, then laid on the floor."""
    turns = [(axis, sampler.uniform(0, 360)) for axis in ("x", "z")]
    turned = []
    for material, meshes in groups:
        (first, tilt), (second, spin) = turns
        turned.append((material, [m.rotated(first, tilt).rotated(second, spin) for m in meshes]))
    low = min(float(m.vertices[:, 2].min()) for _, ms in turned for m in ms)
    return assemble("ball", *((m, [p.translated(0, 0, -low) for p in ms]) for m, ms in turned))


def _circle(normal: F64, radius: float, share: float) -> F64:
    """A circle (24, 3) on the sphere about an axis, at height ``share`` of the radius."""
    axis = normal / np.linalg.norm(normal)
    side = np.cross(axis, np.eye(3)[np.abs(axis).argmin()])
    side /= np.linalg.norm(side)
    a = np.linspace(0, 2 * np.pi, 24, endpoint=False)[:, None]
    flat = np.cos(a) * side + np.sin(a) * np.cross(axis, side)
    ring: F64 = radius * (share * axis + np.sqrt(1 - share**2) * flat)
    return ring


def football(sampler: Sampler) -> Model:
    """A football: twelve raised pentagons on a sphere, with seams from one to the next."""
    r = sampler.size(0.1, 0.125)
    golden = (1 + 5**0.5) / 2
    poles = np.array([(0.0, s, t * golden) for s in (-1, 1) for t in (-1, 1)])
    poles = np.concatenate([poles, poles[:, [2, 0, 1]], poles[:, [1, 2, 0]]])
    poles /= np.linalg.norm(poles, axis=1, keepdims=True)
    patches, seams = [], []
    open_deg = sampler.uniform(18, 22)
    for pole in poles:
        near = poles[np.argsort(poles @ pole)[-6:-1]]
        out = near - (near @ pole)[:, None] * pole
        out /= np.linalg.norm(out, axis=1, keepdims=True)
        side = np.cross(pole, out[0])
        out = out[np.argsort(np.arctan2(out @ side, out @ out[0]))]
        corners = np.cos(np.radians(open_deg)) * pole + np.sin(np.radians(open_deg)) * out
        points = np.concatenate([[pole], corners]) * (r * 1.012)
        points = np.concatenate([points, corners * r * 0.97])
        ring = [(i, i % 5 + 1) for i in range(1, 6)]
        faces = [(0, i, j) for i, j in ring]
        faces += [f for i, j in ring for f in ((i, i + 5, j + 5), (i, j + 5, j))]
        patches.append(from_faces(points, faces))
        for way in near:
            if (pole > way).tolist() > (way > pole).tolist():
                arc = [pole * (1 - k) + way * k for k in np.linspace(0.3, 0.7, 4)]
                line = np.stack([p / np.linalg.norm(p) * r * 1.002 for p in arc])
                seams.append(tube(line, 0.0025, 4))
    sphere = ellipsoid((r, r, r), (0, 0, 0), 24)
    return _set_down(
        sampler,
        [
            (sampler.pale() if sampler.chance(0.6) else sampler.plastic(), [sphere]),
            (sampler.dark() if sampler.chance(0.6) else sampler.plastic(), patches),
            (sampler.dark(), seams),
        ],
    )


def basketball(sampler: Sampler) -> Model:
    """A basketball: two great circles and two curved seams on a sphere."""
    r = sampler.size(0.11, 0.135)
    thick = r * sampler.uniform(0.02, 0.035)
    seams = [tube(_circle(np.eye(3)[k], r, 0.0), thick, 4, closed=True) for k in (0, 2)]
    bend = sampler.uniform(0.55, 0.68)
    for s in (-1.0, 1.0):
        seams.append(tube(_circle(np.array([0.0, s, 0.0]), r, bend), thick, 4, closed=True))
    hue = sampler.uniform(0.8, 1.1)
    skin = (
        sampler.material("dots", 0.03, (0.8 * hue, 0.4 * hue, 0.15))
        if sampler.chance(0.6)
        else sampler.plastic()
    )
    return _set_down(
        sampler, [(skin, [ellipsoid((r, r, r), (0, 0, 0), 24)]), (sampler.dark(), seams)]
    )


def beach_ball(sampler: Sampler) -> Model:
    """A beach ball: broad gores in two or three colours, a disc at each pole, a valve."""
    r, gores = sampler.size(0.14, 0.22), sampler.choice([6, 8, 12])
    sphere = ellipsoid((r, r, r), (0, 0, 0), 24)
    centre = sphere.vertices[sphere.faces].mean(axis=1)
    sector = np.floor((np.arctan2(centre[:, 1], centre[:, 0]) + np.pi) / (2 * np.pi / gores))
    colours = 3 if gores != 8 and sampler.chance(0.5) else 2
    groups: list[tuple[Material, list[Mesh]]] = []
    for k in range(colours):
        own = sphere.faces[sector.astype(int) % colours == k]
        groups.append((sampler.plastic(), [from_faces(sphere.vertices, own)]))
    caps = [
        lathe([(r * 0.26, s * r * 0.968), (0.0, s * r * 1.005)][::s], segments=16, capped=False)
        for s in (1, -1)
    ]
    valve = cylinder(0.008, 0.014, (r * 0.1, 0, r * 0.995), 8)
    groups.append((sampler.pale(), [*caps, valve]))
    return _set_down(sampler, groups)


def exercise_ball(sampler: Sampler) -> Model:
    """A large exercise ball, slightly squashed, ridged all round; a hopper with a grip at times."""
    r = sampler.size(0.2, 0.32)
    squash = sampler.uniform(0.88, 1.0)
    count = sampler.integer(3, 7)
    skin = [ellipsoid((r, r, r * squash), (0, 0, r * squash), 24)]
    ridges = []
    for k in np.linspace(-0.6, 0.6, count):
        ring = torus(
            r * float(np.sqrt(1 - k * k)), r * 0.018, (0, 0, r * squash * (1 + float(k))), 24
        )
        ridges.append(ring)
    base = sampler.plastic()
    groups = [(base, skin), (base if sampler.chance(0.5) else sampler.plastic(), ridges)]
    if sampler.chance(0.3):
        angle = np.linspace(0, np.pi, 8)
        for s in (-1, 1):
            x = s * r * 0.25 + 0 * angle
            loop = np.stack(
                [x, r * 0.16 * np.cos(angle), 2 * r * squash - 0.03 + r * 0.24 * np.sin(angle)],
                axis=1,
            )
            groups.append((groups[1][0], [tube(loop, 0.012)]))
    return assemble("ball", *groups)


def rugby_ball(sampler: Sampler) -> Model:
    """A pointed oval ball: seams from tip to tip, laces, bands near its ends."""
    half, r = sampler.size(0.14, 0.17), sampler.size(0.085, 0.105)
    a = np.linspace(-np.pi / 2, np.pi / 2, 13)
    point = sampler.uniform(1.0, 1.5)
    profile = list(zip((r * np.cos(a) ** point).tolist(), (half * np.sin(a)).tolist(), strict=True))
    body = lathe(profile, segments=20).rotated("y", 90)
    x, z = half * np.sin(a[1:-1]), r * np.cos(a[1:-1]) ** point
    seams = [tube(np.stack([x, 0 * x, z], axis=1), 0.003, 4).rotated("x", k * 90) for k in range(4)]
    laces = [
        cylinder(0.004, 0.03, (0, 0, -0.015), 6).rotated("x", 90).translated(float(k), 0, r * 1.01)
        for k in np.linspace(-0.25, 0.25, 6) * half
    ]
    bands = [
        lathe(
            [(r * float(np.cos(t)) ** point * 1.015, half * float(np.sin(t))) for t in (0.8, 0.95)],
            segments=20,
            capped=False,
        ).rotated("y", s * 90)
        for s in (-1, 1)
    ]
    tilt = sampler.uniform(-60, 60)
    groups = [
        (sampler.upholstery(), [body]),
        (sampler.dark(), seams),
        (sampler.pale(), [*laces, *bands]),
    ]
    turn = sampler.uniform(0, 360)
    turned = [(m, [p.rotated("x", tilt).rotated("z", turn) for p in ms]) for m, ms in groups]
    low = min(float(p.vertices[:, 2].min()) for _, ms in turned for p in ms)
    return assemble("ball", *((m, [p.translated(0, 0, -low) for p in ms]) for m, ms in turned))


def tennis_ball(sampler: Sampler) -> Model:
    """A tennis or base ball, large for a toy: one curved seam that winds about it."""
    r = sampler.size(0.05, 0.12)
    t = np.linspace(0, 2 * np.pi, 40, endpoint=False)
    b = sampler.uniform(0.35, 0.5)
    curve = np.stack(
        [
            (1 - b) * np.sin(t) + b * np.sin(3 * t),
            (1 - b) * np.cos(t) - b * np.cos(3 * t),
            2 * np.sqrt(b * (1 - b)) * np.cos(2 * t),
        ],
        axis=1,
    )
    line = curve / np.linalg.norm(curve, axis=1, keepdims=True) * r
    seam = [tube(line, r * 0.045, 5, closed=True)]
    skin = sampler.plastic() if sampler.chance(0.5) else sampler.fabric()
    return _set_down(
        sampler, [(skin, [ellipsoid((r, r, r), (0, 0, 0), 24)]), (sampler.pale(), seam)]
    )
