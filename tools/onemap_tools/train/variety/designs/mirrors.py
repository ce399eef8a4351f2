"""Mirrors of many shapes and frames, on the wall or on feet; the wall is at +y."""

from __future__ import annotations

import numpy as np

from onemap_shared.geometry import F64
from onemap_simulator.generation.furniture.wall_decor import frame
from onemap_simulator.generation.mesh import Mesh, box, cylinder, ellipsoid, front_panel, rod, tube
from onemap_simulator.generation.model import Model
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.mirror_parts import (
    back_board,
    edge_material,
    frame_band,
    glass_plate,
    mirror_glass,
    oval,
)
from onemap_tools.train.variety.designs.mirrors_lit import cabinet_mirror, with_lamps
from onemap_tools.train.variety.designs.mirrors_ornate import ornate, sunburst
from onemap_tools.train.variety.designs.sanitary import SQUARE, stand


def _outlined(sampler: Sampler, outer: F64, bar: float) -> Model:
    """A mirror of any outline about its middle with a frame of width ``bar``."""
    half = (outer.max(axis=0) - outer.min(axis=0)) / 2
    inner, depth = outer * (1 - bar / half), sampler.uniform(0.02, 0.045)
    band = frame_band(outer, inner, depth)
    groups = [(edge_material(sampler), [band, back_board(inner * 1.01, 0.008)])]
    return stand(
        "mirror", *groups, (mirror_glass(sampler), [glass_plate(inner * 1.005, -depth * 0.5)])
    )


def round_mirror(sampler: Sampler) -> Model:
    """A round or egg-shaped mirror in a thin or thick hoop, at times on a strap from a knob."""
    width = sampler.size(0.4, 0.85)
    size = (width, width * sampler.choice((1.0, 1.0, 1.25, 0.75)))
    bar = sampler.choice((0.01, 0.025, 0.06)) * sampler.uniform(0.8, 1.3)
    model = _outlined(sampler, oval(size), bar)
    if not sampler.chance(0.35):
        return model
    top, x = float(model.upper[2]), width * 0.36
    z = top - size[1] * 0.15
    strap = [rod((s * x, -0.008, z), (0, -0.008, top + 0.16), 0.008) for s in (-1, 1)]
    knob = cylinder(0.02, 0.04, segments=10).rotated("x", 90).translated(0, 0.02, top + 0.16)
    groups = [(part.material, [part.mesh]) for part in model.parts]
    return stand("mirror", *groups, (sampler.upholstery(), strap), (sampler.metal(), [knob]))


def arched(sampler: Sampler) -> Model:
    """A mirror with a round or pointed arch on top, at times barred like a window."""
    width, height = sampler.size(0.45, 0.8), sampler.size(0.75, 1.25)
    rise = width / 2 * sampler.choice((1.0, 1.0, 0.5, 1.5))
    angle = np.linspace(0, np.pi, 15)
    arc = np.stack([np.cos(angle) * width / 2, height - rise + np.sin(angle) * rise], axis=1)
    sides = [
        (-width / 2, height * 0.3),
        (-width / 2, 0.0),
        (-width / 4, 0.0),
        (width / 4, 0.0),
        (width / 2, 0.0),
        (width / 2, height * 0.3),
    ]
    outer = np.concatenate([arc, np.array(sides)]) - (0.0, height / 2)
    bar = sampler.uniform(0.012, 0.06)
    model = _outlined(sampler, outer, bar)
    if not sampler.chance(0.4):
        return model
    spring, y = height - rise, float(model.lower[1]) * 0.2
    bars = [box((width - bar, 0.016, 0.016), (0, y, z)) for z in (spring, spring * 0.5)]
    bars += [box((0.016, 0.016, height - bar if sampler.chance(0.5) else spring), (0, y, bar / 2))]
    groups = [(part.material, [part.mesh]) for part in model.parts]
    groups[0][1].extend(bars)
    return stand("mirror", *groups)


def frameless(sampler: Sampler) -> Model:
    """A bare sheet with clips or standoffs: rectangle, soft corners, octagon, pill or pebble."""
    width, height = sampler.size(0.4, 1.0), sampler.size(0.5, 1.0)
    kind = sampler.integer(0, 4)
    outline = oval((width, height), (SQUARE, 6.0, 2.4, 3.2, 2.0)[kind])
    if kind == 3:
        angle = np.arange(8) * np.pi / 4 + np.pi / 8
        outline = np.stack([np.cos(angle) * width, np.sin(angle) * height], axis=1) * 0.54
    if kind == 4:
        angle = np.linspace(0, 2 * np.pi, 24, endpoint=False)
        bump = (
            1
            + 0.16 * np.sin(2 * angle + sampler.uniform(0, 6))
            + 0.1 * np.sin(3 * angle + sampler.uniform(0, 6))
        )
        outline = outline * bump[:, None]
    thick = sampler.uniform(0.006, 0.03)
    edge = [back_board(outline, thick)]
    y = -thick - 0.002
    clips: list[Mesh] = []
    if sampler.chance(0.6):
        inset = outline * 0.98
        for index in (
            np.argmax(inset @ (1, 1)),
            np.argmax(inset @ (-1, 1)),
            np.argmax(inset @ (1, -1)),
            np.argmin(inset @ (1, 1)),
        ):
            x, z = (float(v) * 0.92 for v in inset[index])
            clips.append(
                cylinder(0.012, 0.016, segments=10).rotated("x", 90).translated(x, y + 0.004, z)
            )
    shelf: list[Mesh] = []
    if kind < 2 and sampler.chance(0.4):
        shelf = [box((width * 1.02, 0.11, 0.015), (0, -0.055, -height / 2 - 0.04))]
        clips += [
            box((0.02, 0.03, 0.06), (s * width * 0.35, -0.015, -height / 2 - 0.05)) for s in (-1, 1)
        ]
    return stand(
        "mirror",
        (sampler.plastic(), edge),
        (mirror_glass(sampler), [glass_plate(outline, y)]),
        (sampler.metal(), clips),
        (sampler.wood() if sampler.chance(0.5) else sampler.plastic(), shelf),
    )


def _cheval_legs(width: float, pivot: float) -> list[Mesh]:
    """Two posts on bowed feet with a pin each at height ``pivot``, and a bar between them."""
    x = width / 2 + 0.035
    legs: list[Mesh] = []
    for s in (-1, 1):
        legs += [
            rod((s * x, 0, 0.06), (s * x, 0, pivot + 0.12), 0.018),
            ellipsoid((0.028, 0.028, 0.035), (s * x, 0, pivot + 0.14), 8),
        ]
        foot = [
            (s * x, -0.24, 0.02),
            (s * x, -0.12, 0.06),
            (s * x, 0, 0.09),
            (s * x, 0.12, 0.06),
            (s * x, 0.24, 0.02),
        ]
        legs += [
            tube(foot, 0.02),
            rod((s * x, 0, pivot), (s * (width / 2 - 0.015), 0, pivot), 0.014),
        ]
    legs.append(rod((-x, 0, 0.1), (x, 0, 0.1), 0.016))
    return legs


def _strut(width: float, tall: float, tilt: float) -> list[Mesh]:
    """What a mirror tilted by degrees leans on: two legs behind it with a bar."""
    high = tall * 0.8
    back = (high - tall / 2) * np.sin(np.radians(tilt))
    legs = [
        rod((s * width * 0.35, 0.42, 0.012), (s * width * 0.35, back, high), 0.014) for s in (-1, 1)
    ]
    legs.append(rod((-width * 0.35, 0.4, 0.1), (width * 0.35, 0.4, 0.1), 0.012))
    return legs


def standing(sampler: Sampler) -> Model:
    """A tall mirror on the floor that tilts: leaning on a strut, or hung between two posts."""
    width, height = sampler.size(0.4, 0.65), sampler.size(1.35, 1.75)
    bar, tilt = sampler.uniform(0.02, 0.06), sampler.uniform(3, 9)
    glass, wood = mirror_glass(sampler), edge_material(sampler)
    cheval = sampler.chance(0.55)
    legs: list[Mesh] = []
    is_oval = cheval and sampler.chance(0.5)
    tall = height - 0.15 if cheval else height
    if is_oval:
        outer = oval((width, tall))
        inner = outer * (1 - bar / np.array([width / 2, tall / 2]))
        meshes = [frame_band(outer, inner, 0.03), back_board(inner * 1.01, 0.008)]
        plate = glass_plate(inner * 1.005, -0.016)
    else:
        meshes = [m.translated(0, 0, -tall / 2) for m in frame(width, tall, bar, 0.03)]
        meshes.append(box((width - 0.01, 0.008, tall - 0.01), (0, -0.006, -tall / 2 + 0.005)))
        plate = front_panel(
            width - 1.9 * bar, tall - 1.9 * bar, (0, -0.016, -tall / 2 + 0.95 * bar)
        )
    turned = [
        m.rotated("x", -tilt).translated(0, 0, tall / 2 + (0.12 if cheval else 0.0))
        for m in (*meshes, plate)
    ]
    if cheval:
        legs = _cheval_legs(width, tall / 2 + 0.12)
    elif sampler.chance(0.6):
        legs = _strut(width, tall, tilt)
    return stand(
        "mirror",
        (wood, turned[:-1]),
        (glass, turned[-1:]),
        (wood if sampler.chance(0.6) else sampler.metal(), legs),
    )


DESIGNS: dict[str, tuple[ModelFactory, ...]] = {
    "mirror": (
        round_mirror,
        arched,
        ornate,
        frameless,
        cabinet_mirror,
        standing,
        sunburst,
        with_lamps,
    )
}
