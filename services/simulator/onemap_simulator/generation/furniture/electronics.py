"""Televisions, laptops, lamps, radiators and fans."""

from __future__ import annotations

import numpy as np

from onemap_shared.geometry import U8
from onemap_simulator.generation.mesh import (
    Mesh,
    box,
    cone,
    cylinder,
    ellipsoid,
    front_panel,
    lathe,
    panel,
    prism,
    rod,
    rounded_box,
    torus,
    tube,
)
from onemap_simulator.generation.model import Material, Model, assemble
from onemap_simulator.generation.sampler import Sampler
from onemap_simulator.generation.textures import smooth_noise, to_image


def television(sampler: Sampler, *, hanging: bool) -> Model:
    """A wide thin panel with a dark screen, on a foot or to be hung on a wall."""
    width = sampler.size(0.85, 1.25)
    height, thick = width * 0.58, sampler.size(0.035, 0.06)
    lift = 0.0 if hanging else sampler.size(0.06, 0.12)
    casing = sampler.dark() if sampler.chance(0.75) else sampler.metal()
    body = [box((width, thick, height), (0, 0, lift))]
    glass = [front_panel(width - 0.04, height - 0.05, (0, -thick / 2 - 0.003, lift + 0.03))]
    stand: list[Mesh] = []
    if not hanging and sampler.chance(0.5):
        stand += [box((0.06, 0.04, lift + 0.1)), box((width * 0.4, 0.22, 0.018))]
    elif not hanging:
        for side in (-1, 1):
            x = side * width * 0.35
            stand += [
                rod((x, -0.11, 0.0), (x, 0.0, lift + 0.04), 0.012),
                rod((x, 0.11, 0.0), (x, 0.0, lift + 0.04), 0.012),
            ]
    else:
        stand.append(box((0.3, 0.05, 0.25), (0, thick / 2 + 0.02, height * 0.35)))
    screen = Material(_screen(sampler.rng, lit=sampler.chance(0.12)))
    return assemble("television", (casing, [*body, *stand]), (screen, glass))


def _screen(rng: np.random.Generator, *, lit: bool) -> U8:
    """A dark screen (64, 64, 3) with a faint slanted reflection, or one that shows something."""
    rows, columns = np.mgrid[0:64, 0:64] / 64.0
    if lit:
        cloud = np.stack([smooth_noise(rng, (4, 4)) for _ in range(3)], axis=-1)
        return to_image(0.15 + 0.7 * cloud)
    gleam = 0.06 * np.clip(1 - np.abs(rows + columns - rng.uniform(0.6, 1.4)) * 4, 0, 1)
    return to_image((0.04 + gleam)[..., None] * np.array([0.9, 1.0, 1.15]))


def laptop(sampler: Sampler) -> Model:
    """An open laptop: base with keyboard and touchpad, a lid with a lit or dark screen."""
    width, depth = sampler.size(0.36, 0.42), sampler.size(0.25, 0.29)
    casing = sampler.metal() if sampler.chance(0.6) else sampler.plastic()
    base = box((width, depth, 0.022))
    keys = panel(
        (-width * 0.45, depth * 0.42, 0.024), (width * 0.9, 0.0, 0.0), (0.0, -depth * 0.5, 0.0)
    )
    pad = panel(
        (-width * 0.14, -depth * 0.14, 0.024), (width * 0.28, 0.0, 0.0), (0.0, -depth * 0.28, 0.0)
    )
    lean = -sampler.uniform(8, 22)
    lid = box((width, 0.014, depth)).rotated("x", lean).translated(0, depth / 2, 0.015)
    face = front_panel(width - 0.03, depth - 0.04, (0, -0.009, 0.022)).rotated("x", lean)
    lit = sampler.chance(0.7)
    screen = Material(_desktop(sampler.rng) if lit else _screen(sampler.rng, lit=False))
    return assemble(
        "laptop",
        (casing, [base, lid]),
        (Material(_keyboard(sampler.rng)), [keys]),
        (sampler.material("plain", 0.5, sampler.grey(0.3, 0.6)), [pad]),
        (screen, [face.translated(0, depth / 2, 0.015)]),
    )


def _keyboard(rng: np.random.Generator) -> U8:
    image = np.full((64, 64, 3), 25 if rng.random() < 0.6 else 190, np.uint8)
    ink = 90 if image[0, 0, 0] < 100 else 70
    rows, columns = np.mgrid[0:64, 0:64]
    image[(rows % 13 > 2) & (columns % 6 > 1)] = ink
    return image


def _desktop(rng: np.random.Generator) -> U8:
    """A screen (64, 64, 3) with a bright page, a title bar and lines of text."""
    image = np.empty((64, 64, 3))
    image[:] = rng.uniform(0.2, 0.7, 3)
    image[8:58, 6:50] = 0.95
    image[8:13, 6:50] = rng.uniform(0.2, 0.8, 3)
    for row in range(17, 55, 4):
        image[row : row + 2, 9 : 9 + rng.integers(15, 38)] = 0.35
    return to_image(image)


def table_lamp(sampler: Sampler) -> Model:
    """A shade on a turned or straight foot, to stand on furniture."""
    return _lamp(sampler, sampler.size(0.38, 0.52), sampler.size(0.12, 0.17))


def floor_lamp(sampler: Sampler) -> Model:
    """A shade on a tall pole with a heavy foot."""
    return _lamp(sampler, sampler.size(1.4, 1.65), sampler.size(0.17, 0.24))


def _lamp(sampler: Sampler, height: float, radius: float) -> Model:
    foot_material = sampler.metal() if sampler.chance(0.5) else sampler.wood()
    shade_h = min(radius * sampler.size(1.2, 1.6), height * 0.5)
    upper = radius * sampler.uniform(0.45, 1.0)
    shade = _tube_shell((radius, upper), shade_h, height - shade_h)
    low = height - shade_h * 0.6
    stem: list[Mesh]
    if height < 0.7 and sampler.chance(0.6):
        stem = [ellipsoid((radius * 0.55, radius * 0.55, low * 0.35), (0, 0, low * 0.38), 12)]
        stem.append(cylinder(0.012, low, segments=6))
        stem.append(cylinder(radius * 0.5, 0.02, segments=14))
    elif height > 0.7 and sampler.chance(0.35):
        stem = [
            rod((0.28 * np.cos(a), 0.28 * np.sin(a), 0), (0, 0, low * 0.85), 0.014)
            for a in np.radians([90, 210, 330])
        ]
        stem.append(cylinder(0.014, height - low * 0.8, (0, 0, low * 0.8), 6))
    else:
        stem = [cylinder(radius * 0.75, 0.03, segments=16), cylinder(0.014, low, segments=8)]
    bulb = ellipsoid((0.04, 0.04, 0.05), (0, 0, height - shade_h * 0.5), 8)
    cloth = sampler.pale() if sampler.chance(0.55) else sampler.fabric()
    return assemble("lamp", (foot_material, stem), (cloth, [shade]), (sampler.pale(), [bulb]))


def _tube_shell(radii: tuple[float, float], height: float, z: float) -> Mesh:
    """A thin open cone: outer skin, upper rim, inner skin."""
    lower, upper = radii
    profile = [(lower, 0), (upper, height), (upper - 0.008, height), (lower - 0.008, 0)]
    return lathe([*profile, (lower, 0.0)], (0, 0, z), 18, capped=False)


def radiator(sampler: Sampler) -> Model:
    """A row of upright ribs between two pipes, or a flat panel with grooves, with a valve."""
    width, height = sampler.size(0.6, 1.1), sampler.size(0.55, 0.7)
    lift, depth = sampler.size(0.1, 0.15), sampler.size(0.09, 0.13)
    paint = (
        sampler.pale()
        if sampler.chance(0.55)
        else sampler.metal()
        if sampler.chance(0.4)
        else sampler.plastic()
    )
    count = int(width / sampler.size(0.06, 0.085))
    pitch = width / count
    if sampler.chance(0.7):
        ribs = [
            rounded_box(
                (pitch * 0.68, depth, height), ((i + 0.5) * pitch - width / 2, 0, lift), 0.02
            )
            for i in range(count)
        ]
    else:
        ribs = [box((width, 0.02, height), (0, 0, lift))]
        ribs += [
            box(
                (pitch * 0.5, 0.045, height - 0.04),
                ((i + 0.5) * pitch - width / 2, -0.02, lift + 0.02),
            )
            for i in range(count)
        ]
        ribs.append(box((width, depth, 0.02), (0, 0, lift + height)))
    pipes = [
        rod((-width / 2, 0, lift + z), (width / 2, 0, lift + z), 0.02)
        for z in (0.06, height - 0.06)
    ]
    pipes.append(cylinder(0.013, lift + 0.06, (width / 2 + 0.03, 0, 0), 8))
    knob = cylinder(0.028, 0.09, segments=10).rotated("y", 90)
    valve = [knob.translated(width / 2, 0, lift + height - 0.06)]
    bracket = box((0.04, 0.06, 0.1), (0, depth / 2, lift + height - 0.15))
    return assemble("radiator", (paint, [*ribs, *pipes, bracket]), (sampler.pale(), valve))


def standing_fan(sampler: Sampler) -> Model:
    """A round cage with blades on a pole with a foot."""
    return _fan(sampler, sampler.size(1.05, 1.3), sampler.size(0.2, 0.25))


def table_fan(sampler: Sampler) -> Model:
    """A small fan for a table."""
    return _fan(sampler, sampler.size(0.42, 0.5), sampler.size(0.14, 0.17))


def _fan(sampler: Sampler, height: float, radius: float) -> Model:
    casing, metal = sampler.plastic() if sampler.chance(0.6) else sampler.dark(), sampler.metal()
    hub_z = height - radius
    foot = [
        cone((radius * 0.9, radius * 0.75), 0.035, segments=18),
        cone((0.03, 0.02), hub_z - 0.03, (0, 0, 0.03), 10),
        ellipsoid((0.06, 0.1, 0.06), (0, 0.03, hub_z), 10),
    ]
    cage = [
        torus(radius * share, 0.007, segments=24).rotated("x", 90).translated(0, y, hub_z)
        for share, y in ((1.0, -0.05), (0.7, -0.085), (0.35, -0.095), (1.0, -0.01))
    ]
    for angle in np.linspace(0, 2 * np.pi, 12, endpoint=False):
        x, z = radius * np.cos(angle), radius * np.sin(angle)
        spoke = [(0, -0.1, hub_z), (x * 0.7, -0.085, hub_z + z * 0.7), (x, -0.05, hub_z + z)]
        cage.append(tube(spoke, 0.004, 4))
    blades = []
    outline = [(0.02, -0.03), (radius * 0.85, -0.09), (radius * 0.9, 0.05), (0.02, 0.03)]
    count = sampler.integer(3, 5)
    for index in range(count):
        blade = prism(outline, 0.008).rotated("x", 20).rotated("z", index * 360 / count + 20)
        blades.append(blade.rotated("x", 90).translated(0, -0.045, hub_z))
    cap = cylinder(0.045, 0.03, segments=12).rotated("x", 90).translated(0, -0.085, hub_z)
    return assemble("fan", (casing, [*foot, cap]), (metal, cage), (sampler.plastic(), blades))
