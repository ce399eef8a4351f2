"""Trash cans with a lid: pedal, swing, sensor, wheelie and push bins."""

from __future__ import annotations

import numpy as np

from onemap_shared.geometry import F64
from onemap_simulator.generation.mesh import (
    Mesh,
    box,
    cylinder,
    lathe,
    prism,
    rod,
    rounded_box,
    torus,
    tube,
)
from onemap_simulator.generation.model import Material, Model, assemble
from onemap_simulator.generation.sampler import Sampler

Size = tuple[float, float, float]


def _skin(sampler: Sampler) -> Material:
    return sampler.choice([sampler.metal, sampler.enamel, sampler.plastic])()


def _tapered(size: Size, low: float) -> Mesh:
    """A box with rounded edges whose foot is narrower by a factor."""
    mesh = rounded_box(size, radius=min(size[:2]) * 0.12)
    share = mesh.vertices[:, 2:] / size[2]
    flat = mesh.vertices[:, :2] * (low + (1 - low) * share)
    return Mesh(np.concatenate([flat, mesh.vertices[:, 2:]], axis=1), mesh.faces, mesh.uv)


def pedal_bin(sampler: Sampler) -> Model:
    """A pedal bin, round or half round: flat or domed lid, closed or swung up, rear hinge, bail."""
    r, h = sampler.size(0.11, 0.17), sampler.size(0.27, 0.6)
    deep = sampler.uniform(0.75, 1.0)
    body = cylinder(r, h, (0, 0, 0.02), 20).scaled(1.0, deep, 1.0)
    dome = r * sampler.choice([0.12, 0.25, 0.5])
    lid = lathe(
        [(r * 1.03, 0), (r * 1.03, 0.02), (r * 0.75, 0.02 + dome * 0.7), (0, 0.02 + dome)],
        segments=20,
    ).scaled(1.0, deep, 1.0)
    back = r * deep
    tilt = sampler.choice([0.0, 0.0, sampler.uniform(30, 75)])
    lid = lid.translated(0, -back, 0).rotated("x", -tilt).translated(0, back, h + 0.022)
    dark = [
        cylinder(r * 1.03, 0.022, segments=20).scaled(1.0, deep, 1.0),
        rounded_box((0.09, 0.08, 0.014), (0, -back - 0.025, 0.012), 0.006),
        box((r * 0.8, 0.03, 0.05), (0, back, h - 0.015)),
    ]
    if tilt:
        dark.append(cylinder(r * 0.93, 0.006, (0, 0, h + 0.018), 20).scaled(1.0, deep, 1.0))
    if sampler.chance(0.4):
        angle = np.linspace(0, np.pi, 9)
        x, y = r * 1.05 * np.cos(angle), -back * 1.08 * np.sin(angle)
        dark.append(tube(np.stack([x, y, 0 * x + h * 0.8], axis=1), 0.005))
    skin = _skin(sampler)
    lid_skin = skin if sampler.chance(0.5) else sampler.plastic()
    return assemble("trash can", (skin, [body]), (lid_skin, [lid]), (sampler.dark(), dark))


def swing_bin(sampler: Sampler) -> Model:
    """A tapered bin with a hood whose flap swings about an axle, often askew."""
    w, h = sampler.size(0.24, 0.36), sampler.size(0.35, 0.55)
    d = w * sampler.uniform(0.7, 1.0)
    body = _tapered((w, d, h), sampler.uniform(0.7, 0.9))
    rise = h * sampler.uniform(0.25, 0.4)
    hood = [box((0.035, d + 0.012, 0.03), (s * (w / 2 - 0.012), 0, h - 0.01)) for s in (-1, 1)]
    hood += [box((w + 0.01, 0.03, 0.032), (0, s * (d / 2 - 0.009), h - 0.011)) for s in (-1, 1)]
    for s in (-1, 1):
        cheek = np.array([(-d / 2, 0), (d / 2, 0), (d * 0.2, rise), (-d * 0.2, rise)])
        hood.append(_plate(cheek, 0.02).translated(s * (w / 2 - 0.012), 0, h + 0.018))
    tilt = sampler.choice([0.0, sampler.uniform(-25, 25)])
    flap = []
    slope = float(np.degrees(np.arctan2(rise, d * 0.3)))
    length = float(np.hypot(rise, d * 0.3))
    for s in (-1, 1):
        side = box((w - 0.05, length * 0.98, 0.01), (0, 0, -0.012)).rotated("x", -s * slope)
        side = side.translated(0, s * d * 0.35, rise / 2)
        flap.append(side)
    flap.append(box((w - 0.05, d * 0.42, 0.012), (0, 0, rise - 0.012)))
    axis = rise * 0.8
    flap = [
        m.translated(0, 0, -axis).rotated("x", tilt).translated(0, 0, h + 0.018 + axis)
        for m in flap
    ]
    dark = [box((w * 0.9, d * 0.9, 0.004), (0, 0, h - 0.002))]
    hood_skin = sampler.plastic()
    flap_skin = hood_skin if sampler.chance(0.4) else sampler.metal()
    return assemble(
        "trash can",
        (_skin(sampler), [body]),
        (hood_skin, hood),
        (flap_skin, flap),
        (sampler.dark(), dark),
    )


def _plate(outline: F64, thick: float) -> Mesh:
    """A plate in the y z plane, its outline counter-clockwise as (y, z), centred about x = 0."""
    flat = prism(outline, thick)
    return flat.rotated("z", 90).rotated("y", 90).translated(-thick / 2, 0, 0)


def sensor_bin(sampler: Sampler) -> Model:
    """A tall steel bin with a broad electric lid: sensor window, liner rim, two flaps at times."""
    w, h = sampler.size(0.26, 0.42), sampler.size(0.55, 0.72)
    d = w * sampler.uniform(0.62, 0.85)
    body = rounded_box((w, d, h - 0.06), (0, 0, 0.02), d * sampler.uniform(0.2, 0.45))
    dark = [rounded_box((w * 0.96, d * 0.96, 0.05), (0, 0, 0), 0.02)]
    lid = [rounded_box((w + 0.012, d + 0.012, 0.085), (0, 0, h - 0.07), 0.035)]
    dark.append(box((w * 0.42, 0.012, 0.035), (0, -d / 2 - 0.003, h - 0.045)))
    if sampler.chance(0.5):
        wing = sampler.uniform(0, 65)
        for s in (-1, 1):
            leaf = rounded_box((w * 0.42, d * 0.8, 0.014), (-s * w * 0.21, 0, 0), 0.006)
            lid.append(leaf.rotated("y", s * wing).translated(s * w * 0.42, 0, h + 0.018))
    else:
        lid.append(rounded_box((w * 0.85, d * 0.75, 0.02), (0, 0, h + 0.008), 0.009))
    lamp = [box((0.02, 0.006, 0.008), (w * 0.1, -d / 2 - 0.008, h - 0.03))]
    return assemble(
        "trash can",
        (_skin(sampler), [body]),
        (sampler.enamel(), lid),
        (sampler.dark(), dark),
        (sampler.pale(), lamp),
    )


def wheelie_bin(sampler: Sampler) -> Model:
    """A wheelie bin: tapered tub, overhanging sloped lid with a rear handle bar, two wheels."""
    w, h = sampler.size(0.36, 0.5), sampler.size(0.65, 0.95)
    d = w * sampler.uniform(1.0, 1.2)
    r = w * 0.16
    tub = [_tapered((w, d, h - 0.04), 0.74).translated(0, 0, 0.03)]
    tub.append(box((w + 0.03, d + 0.02, 0.04), (0, 0, h - 0.07)))
    tilt = sampler.choice([3.0, 3.0, sampler.uniform(15, 50)])
    lid = [
        rounded_box((w + 0.05, d + 0.05, 0.05), (0, -d / 2, -0.01), 0.02),
        rounded_box((w * 0.7, d * 0.6, 0.03), (0, -d / 2, 0.03), 0.012),
    ]
    lid = [m.rotated("x", -tilt).translated(0, d / 2 - 0.01, h - 0.025) for m in lid]
    tub.append(rod((-w * 0.4, d / 2 + 0.04, h - 0.05), (w * 0.4, d / 2 + 0.04, h - 0.05), 0.014))
    tub += [box((0.03, 0.06, 0.03), (s * w * 0.4, d / 2 + 0.02, h - 0.065)) for s in (-1, 1)]
    wheels = [
        cylinder(r, 0.05, segments=16)
        .rotated("y", 90)
        .translated(s * w * 0.43 - 0.025, d * 0.36, r)
        for s in (-1, 1)
    ]
    wheels.append(rod((-w * 0.43, d * 0.36, r), (w * 0.43, d * 0.36, r), 0.012))
    feet = [box((w * 0.6, 0.04, 0.034), (0, -d * 0.3, 0))]
    skin = sampler.plastic()
    return assemble(
        "trash can",
        (skin, [*tub, *feet]),
        (skin if sampler.chance(0.5) else sampler.plastic(), lid),
        (sampler.dark(), wheels),
    )


def push_bin(sampler: Sampler) -> Model:
    """A retro push bin: a fat cylinder, a big dome with a round flap, carrying rings."""
    r, h = sampler.size(0.15, 0.2), sampler.size(0.42, 0.62)
    body = [cylinder(r, h, (0, 0, 0.016), 20)]
    angle = np.linspace(0, np.pi / 2, 6)
    dome = r * sampler.uniform(0.7, 1.0)
    profile = [(r * 1.02 * float(np.cos(a)), dome * float(np.sin(a))) for a in angle]
    top = [lathe(profile, (0, 0, h + 0.016), 20)]
    trim = [torus(r * 1.01, 0.01, (0, 0, z), 20) for z in (0.0087, h + 0.014)]
    frame = torus(r * 0.42, 0.01, (0, 0, 0), 16).rotated("x", 55)
    flap = cylinder(r * 0.42, 0.01, (0, 0, -0.008), 16).rotated("x", 55)
    at = (0.0, -r * 0.76, h + 0.016 + dome * 0.54)
    trim.append(frame.translated(*at))
    return assemble(
        "trash can",
        (_skin(sampler), [*body, *top]),
        (sampler.metal(), trim),
        (sampler.metal(), [flap.translated(*at)]),
    )
