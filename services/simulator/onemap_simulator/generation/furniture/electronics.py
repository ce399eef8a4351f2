"""Televisions, laptops, lamps, radiators and fans."""

from __future__ import annotations

import numpy as np

from onemap_shared.geometry import U8
from onemap_simulator.generation.mesh import (
    Material,
    Mesh,
    Model,
    assemble,
    box,
    cone,
    cylinder,
    ellipsoid,
    front_panel,
    knob,
    lathe,
    panel,
    prism,
    rod,
    rounded_box,
    torus,
    tube,
)
from onemap_simulator.generation.style import Sampler
from onemap_simulator.generation.textures import smooth_noise, to_image


def television(draw: Sampler, *, hanging: bool) -> Model:
    """A wide thin panel with a dark screen, on a foot or to be hung on a wall."""
    width = draw.size(0.85, 1.25)
    height, thick = width * 0.58, draw.size(0.035, 0.06)
    lift = 0.0 if hanging else draw.size(0.06, 0.12)
    casing = draw.dark() if draw.chance(0.75) else draw.metal()
    glass = front_panel(width - 0.04, height - 0.05, (0, -thick / 2 - 0.003, lift + 0.03))
    body = [box((width, thick, height), (0, 0, lift))]
    if hanging:
        body.append(box((0.3, 0.05, 0.25), (0, thick / 2 + 0.02, height * 0.35)))
    elif draw.chance(0.5):
        body += [box((0.06, 0.04, lift + 0.1)), box((width * 0.4, 0.22, 0.018))]
    else:
        for x in (-width * 0.35, width * 0.35):
            body += [rod((x, y, 0.0), (x, 0.0, lift + 0.04), 0.012) for y in (-0.11, 0.11)]
    screen = Material(_screen(draw.rng, lit=draw.chance(0.12)))
    return assemble("television", (casing, body), (screen, [glass]))


def _screen(rng: np.random.Generator, *, lit: bool) -> U8:
    """A dark screen (64, 64, 3) with a faint slanted reflection, or one that shows something."""
    rows, columns = np.mgrid[0:64, 0:64] / 64.0
    if lit:
        cloud = np.stack([smooth_noise(rng, (4, 4)) for _ in range(3)], axis=-1)
        return to_image(0.15 + 0.7 * cloud)
    gleam = 0.06 * np.clip(1 - np.abs(rows + columns - rng.uniform(0.6, 1.4)) * 4, 0, 1)
    return to_image((0.04 + gleam)[..., None] * np.array([0.9, 1.0, 1.15]))


def laptop(draw: Sampler) -> Model:
    """An open laptop: base with keyboard and touchpad, a lid with a lit or dark screen."""
    width, depth = draw.sizes((0.36, 0.42), (0.25, 0.29))
    casing = draw.metal() if draw.chance(0.6) else draw.plastic()

    def flat(x: float, y: float, z: float, deep: float) -> Mesh:
        """A panel on the base from its back left corner, symmetric about x = 0."""
        return panel((x, y, z), (-2 * x, 0.0, 0.0), (0.0, -deep, 0.0))

    keys = flat(-width * 0.45, depth * 0.42, 0.024, depth * 0.5)
    pad = flat(-width * 0.14, -depth * 0.14, 0.024, depth * 0.28)
    lean, hinge = -draw.uniform(8, 22), (0, depth / 2, 0.015)
    lid = box((width, 0.014, depth)).rotated("x", lean).translated(*hinge)
    face = front_panel(width - 0.03, depth - 0.04, (0, -0.009, 0.022)).rotated("x", lean)
    lit = draw.chance(0.7)
    screen = Material(_desktop(draw.rng) if lit else _screen(draw.rng, lit=False))
    return assemble(
        "laptop",
        (casing, [box((width, depth, 0.022)), lid]),
        (Material(_keyboard(draw.rng)), [keys]),
        (draw.material("plain", 0.5, draw.grey(0.3, 0.6)), [pad]),
        (screen, [face.translated(*hinge)]),
    )


def _keyboard(rng: np.random.Generator) -> U8:
    case, ink = (25, 90) if rng.random() < 0.6 else (190, 70)
    image = np.full((64, 64, 3), case, np.uint8)
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


def table_lamp(draw: Sampler) -> Model:
    """A shade on a turned or straight foot, to stand on furniture."""
    return _lamp(draw, *draw.sizes((0.38, 0.52), (0.12, 0.17)))


def floor_lamp(draw: Sampler) -> Model:
    """A shade on a tall pole with a heavy foot."""
    return _lamp(draw, *draw.sizes((1.4, 1.65), (0.17, 0.24)))


def _lamp(draw: Sampler, height: float, radius: float) -> Model:
    foot_material = draw.metal() if draw.chance(0.5) else draw.wood()
    shade_h = min(radius * draw.size(1.2, 1.6), height * 0.5)
    upper, low = radius * draw.uniform(0.45, 1.0), height - shade_h * 0.6
    skin = [(radius, 0), (upper, shade_h), (upper - 0.008, shade_h), (radius - 0.008, 0)]
    shade = lathe([*skin, (radius, 0.0)], (0, 0, height - shade_h), 18, capped=False)
    if height < 0.7 and draw.chance(0.6):
        stem = [
            ellipsoid((radius * 0.55, radius * 0.55, low * 0.35), (0, 0, low * 0.38), 12),
            cylinder(0.012, low, segments=6),
            cylinder(radius * 0.5, 0.02, segments=14),
        ]
    elif height > 0.7 and draw.chance(0.35):
        turns = np.radians([90, 210, 330])
        feet = [(0.28 * np.cos(turn), 0.28 * np.sin(turn), 0) for turn in turns]
        stem = [rod(foot, (0, 0, low * 0.85), 0.014) for foot in feet]
        stem.append(cylinder(0.014, height - low * 0.8, (0, 0, low * 0.8), 6))
    else:
        stem = [cylinder(radius * 0.75, 0.03, segments=16), cylinder(0.014, low, segments=8)]
    bulb = ellipsoid((0.04, 0.04, 0.05), (0, 0, height - shade_h * 0.5), 8)
    cloth = draw.pale() if draw.chance(0.55) else draw.fabric()
    return assemble("lamp", (foot_material, stem), (cloth, [shade]), (draw.pale(), [bulb]))


def radiator(draw: Sampler) -> Model:
    """A row of upright ribs between two pipes, or a flat panel with grooves, with a valve."""
    width, height = draw.sizes((0.6, 1.1), (0.55, 0.7))
    lift, depth = draw.sizes((0.1, 0.15), (0.09, 0.13))
    if draw.chance(0.55):
        paint = draw.pale()
    else:
        paint = draw.metal() if draw.chance(0.4) else draw.plastic()
    count = int(width / draw.size(0.06, 0.085))
    pitch, end = width / count, width / 2
    places = [(i + 0.5) * pitch - end for i in range(count)]
    if draw.chance(0.7):
        rib = (pitch * 0.68, depth, height)
        body = [rounded_box(rib, (x, 0, lift), 0.02) for x in places]
    else:
        groove = (pitch * 0.5, 0.045, height - 0.04)
        body = [
            box((width, 0.02, height), (0, 0, lift)),
            *(box(groove, (x, -0.02, lift + 0.02)) for x in places),
            box((width, depth, 0.02), (0, 0, lift + height)),
        ]
    for z in (0.06, height - 0.06):
        body.append(rod((-end, 0, lift + z), (end, 0, lift + z), 0.02))
    body.append(cylinder(0.013, lift + 0.06, (end + 0.03, 0, 0), 8))
    body.append(box((0.04, 0.06, 0.1), (0, depth / 2, lift + height - 0.15)))
    valve = knob(0.028, 0.09, (end, 0, lift + height - 0.06), axis="y")
    return assemble("radiator", (paint, body), (draw.pale(), [valve]))


def standing_fan(draw: Sampler) -> Model:
    """A round cage with blades on a pole with a foot."""
    return _fan(draw, *draw.sizes((1.05, 1.3), (0.2, 0.25)))


def table_fan(draw: Sampler) -> Model:
    """A small fan for a table."""
    return _fan(draw, *draw.sizes((0.42, 0.5), (0.14, 0.17)))


def _fan(draw: Sampler, height: float, radius: float) -> Model:
    casing = draw.plastic() if draw.chance(0.6) else draw.dark()
    metal, hub_z = draw.metal(), height - radius
    body = [
        cone((radius * 0.9, radius * 0.75), 0.035, segments=18),
        cone((0.03, 0.02), hub_z - 0.03, (0, 0, 0.03), 10),
        ellipsoid((0.06, 0.1, 0.06), (0, 0.03, hub_z), 10),
        knob(0.045, 0.03, (0, -0.085, hub_z), 12),
    ]
    cage = [
        torus(radius * share, 0.007, segments=24).rotated("x", 90).translated(0, y, hub_z)
        for share, y in ((1.0, -0.05), (0.7, -0.085), (0.35, -0.095), (1.0, -0.01))
    ]
    for turn in np.linspace(0, 2 * np.pi, 12, endpoint=False):
        x, z = radius * np.cos(turn), radius * np.sin(turn)
        spoke = [(0, -0.1, hub_z), (x * 0.7, -0.085, hub_z + z * 0.7), (x, -0.05, hub_z + z)]
        cage.append(tube(spoke, 0.004, 4))
    outline = [(0.02, -0.03), (radius * 0.85, -0.09), (radius * 0.9, 0.05), (0.02, 0.03)]
    blade, count = prism(outline, 0.008).rotated("x", 20), draw.integer(3, 5)
    turned = [blade.rotated("z", index * 360 / count + 20) for index in range(count)]
    blades = [each.rotated("x", 90).translated(0, -0.045, hub_z) for each in turned]
    return assemble("fan", (casing, body), (metal, cage), (draw.plastic(), blades))
