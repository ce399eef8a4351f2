"""Pictures, clocks and mirrors, which hang on walls. z = 0 is the lower edge."""

from __future__ import annotations

import cv2
import numpy as np

from onemap_shared.geometry import U8
from onemap_simulator.generation.mesh import Mesh, box, cylinder, front_panel, lathe, rod
from onemap_simulator.generation.model import Material, Model, assemble
from onemap_simulator.generation.sampler import Sampler
from onemap_simulator.generation.textures import smooth_noise, to_image


def frame(width: float, height: float, bar: float, depth: float) -> list[Mesh]:
    """Four bars around a rectangle, in front of the wall at y = 0."""
    y = -depth / 2
    return [
        box((width, depth, bar), (0, y, 0)),
        box((width, depth, bar), (0, y, height - bar)),
        box((bar, depth, height), (-width / 2 + bar / 2, y, 0)),
        box((bar, depth, height), (width / 2 - bar / 2, y, 0)),
    ]


def picture(sampler: Sampler) -> Model:
    """A framed abstract painting, upright, square or wide."""
    width, height = sampler.size(0.45, 0.9), sampler.size(0.45, 0.75)
    bar, depth = sampler.size(0.025, 0.06), sampler.size(0.025, 0.04)
    canvas = front_panel(width - bar, height - bar, (0, -0.015, bar / 2))
    art = Material(painting(sampler.rng))
    back = box((width - 0.01, 0.01, height - 0.01), (0, -0.005, 0.005))
    edge = sampler.wood() if sampler.chance(0.7) else sampler.metal()
    return assemble("picture", (edge, [*frame(width, height, bar, depth), back]), (art, [canvas]))


def painting(rng: np.random.Generator) -> U8:
    """An abstract image (96, 96, 3): fields of colour, then discs, bars, strokes or hills."""
    image = np.empty((96, 96, 3), np.float32)
    image[:] = rng.uniform(0.3, 1.0, 3)
    kind = int(rng.integers(4))
    for _ in range(int(rng.integers(4, 9))):
        colour = tuple(map(float, rng.random(3)))
        a, b = (tuple(map(int, rng.integers(0, 96, 2))) for _ in range(2))
        if kind == 0:
            cv2.circle(image, a, int(rng.integers(6, 26)), colour, -1, cv2.LINE_AA)
        elif kind == 1:
            cv2.rectangle(image, a, b, colour, -1)
        elif kind == 2:
            cv2.line(image, a, b, colour, int(rng.integers(3, 12)), cv2.LINE_AA)
        else:
            crest = int(rng.integers(25, 85)) + 18 * (smooth_noise(rng, (1, 4), 64)[0] - 0.5)
            ridge = np.interp(np.arange(96), np.linspace(0, 95, 64), crest)
            image[np.arange(96)[:, None] > ridge] = colour
    image += 0.08 * (smooth_noise(rng, (32, 32), 96)[..., None] - 0.5)
    if rng.random() < 0.4:  # a paper mount around the picture
        mount = image.copy()
        mount[:] = 0.94
        mount[14:-14, 14:-14] = cv2.resize(image, (68, 68))
        image = mount
    return to_image(image)


def clock(sampler: Sampler) -> Model:
    """A wall clock: a rim, a pale or dark face with twelve marks and two hands."""
    radius, depth = sampler.size(0.15, 0.21), 0.05
    rim_material = sampler.metal() if sampler.chance(0.5) else sampler.wood()
    pale = sampler.chance(0.75)
    face_material, ink = (
        (sampler.pale(), sampler.dark()) if pale else (sampler.dark(), sampler.pale())
    )
    marks = []
    for hour in range(12):
        long = 0.2 if hour % 3 == 0 else 0.12
        mark = box((radius * 0.06, 0.006, radius * long), (0, 0, radius * (0.9 - long)))
        marks.append(mark.rotated("y", hour * 30).translated(0, -depth * 0.72, radius))
    for length, thick in ((0.5, 0.09), (0.75, 0.06)):
        hand = box((radius * thick, 0.006, radius * length), (0, 0, -0.02))
        marks.append(
            hand.rotated("y", sampler.uniform(0, 360)).translated(0, -depth * 0.78, radius)
        )
    if sampler.chance(0.3):  # a square case
        side = 2 * radius
        rim = [*frame(side, side, radius * 0.1, depth)]
        face = [box((side - 0.01, depth * 0.7, side - 0.01), (0, -depth * 0.35, 0.005))]
    else:
        hoop = [(radius, 0), (radius, depth), (radius * 0.92, depth), (radius * 0.9, depth * 0.6)]
        rim = [lathe(hoop, segments=28, capped=False).rotated("x", 90).translated(0, 0, radius)]
        face = [
            cylinder(radius * 0.95, depth * 0.7, segments=28)
            .rotated("x", 90)
            .translated(0, 0, radius)
        ]
    pin = (
        cylinder(radius * 0.07, 0.01, segments=8)
        .rotated("x", 90)
        .translated(0, -depth * 0.78, radius)
    )
    return assemble("clock", (rim_material, rim), (face_material, face), (ink, [*marks, pin]))


def mirror(sampler: Sampler) -> Model:
    """A framed mirror, rectangular or oval; its glass is painted with a soft reflection."""
    width, height = sampler.size(0.45, 0.65), sampler.size(0.6, 0.95)
    glass = Material(_silver(sampler.rng))
    edge = sampler.metal() if sampler.chance(0.5) else sampler.wood()
    if sampler.chance(0.35):
        plate = cylinder(0.5, 0.02, segments=28).rotated("x", 90)
        hoop = lathe(
            [(0.5, 0), (0.55, 0.01), (0.55, 0.035), (0.49, 0.035)], segments=28, capped=False
        )
        sized = [
            mesh.scaled(width, 1.0, height).translated(0, 0, height * 0.55)
            for mesh in (plate, hoop.rotated("x", 90))
        ]
        # One image across the whole oval: uv from x and z instead of metres.
        flat = sized[0]
        uv = flat.vertices[flat.faces][..., [0, 2]] / (width, -height) + (0.5, 1.05)
        return assemble(
            "mirror", (edge, [sized[1]]), (glass, [Mesh(flat.vertices, flat.faces, uv)])
        )
    bar = sampler.size(0.02, 0.05)
    plate = front_panel(width - bar, height - bar, (0, -0.018, bar / 2))
    back = box((width - 0.01, 0.012, height - 0.01), (0, -0.006, 0.005))
    parts = [*frame(width, height, bar, 0.035), back]
    if sampler.chance(0.3):
        parts.append(rod((-width / 2, -0.05, -0.02), (width / 2, -0.05, -0.02), 0.015))
    return assemble("mirror", (edge, parts), (glass, [plate]))


def _silver(rng: np.random.Generator) -> U8:
    """A bluish grey gradient (64, 64, 3) with slanted bright streaks."""
    rows, columns = np.mgrid[0:64, 0:64] / 64.0
    base = 0.62 + 0.18 * rows + 0.06 * (smooth_noise(rng, (2, 2)) - 0.5)
    for at in rng.uniform(0.4, 1.6, 2):
        base = base + 0.2 * np.exp(-(((rows + columns - at) / 0.05) ** 2))
    return to_image(base[..., None] * np.array([0.92, 1.0, 1.06]))
