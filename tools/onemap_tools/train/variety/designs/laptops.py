"""Laptops: slim, thick, folded as a tent, nearly shut."""

from __future__ import annotations

import numpy as np

from onemap_shared.geometry import U8
from onemap_simulator.generation.mesh import (
    Mesh,
    box,
    cylinder,
    front_panel,
    panel,
    prism,
    rod,
    rounded_box,
)
from onemap_simulator.generation.model import Material, Model
from onemap_simulator.generation.sampler import ModelFactory, Sampler
from onemap_tools.train.variety.designs.drawn_images import desktop, switched_off
from onemap_tools.train.variety.designs.flat_forms import rounded_outline, settled


def _screen(sampler: Sampler) -> Material:
    return Material(desktop(sampler.rng) if sampler.chance(0.65) else switched_off(sampler.rng))


def _casing(sampler: Sampler) -> Material:
    if sampler.chance(0.3):
        return sampler.dark()
    return sampler.metal() if sampler.chance(0.6) else sampler.plastic()


def _keys(rng: np.random.Generator) -> U8:
    """A keyboard (72, 180, 3): staggered rows, a space bar, sometimes a block of digits."""
    ground, key = rng.uniform(0.05, 0.9), rng.uniform(0.05, 0.9)
    tint = rng.uniform(0.9, 1.1, 3)
    image = np.ones((72, 180, 3)) * ground * tint
    digits = 138 if rng.random() < 0.4 else 180
    for row in range(6):
        top, high = row * 12 + 2, 9 if row else 6
        shift = int(rng.integers(0, 6))
        for left in range(-shift, digits, 12):
            image[top : top + high, max(left, 0) + 1 : min(left + 11, digits - 1)] = key * tint
        for left in range(digits + 4, 176, 12):
            image[top : top + high, left : left + 10] = key * tint
    image[62:71, 40:95] = key * tint
    result: U8 = (np.clip(image, 0, 1) * 255).astype(np.uint8)
    return result


def _deck(sampler: Sampler, size: tuple[float, float], top: float) -> list[tuple[Material, Mesh]]:
    """Keyboard and touchpad on a base of width and depth whose upper face is at ``top``."""
    width, depth = size
    w, share = width * sampler.uniform(0.84, 0.95), sampler.uniform(0.42, 0.52)
    keys = panel((-w / 2, depth * 0.4, top), (w, 0, 0), (0, -depth * share, 0))
    pad_w, pad_x = width * sampler.uniform(0.22, 0.42), sampler.choice((0.0, 0.0, -0.06)) * width
    pad_y = depth * (0.4 - share) - depth * 0.05
    pad = panel((pad_x - pad_w / 2, pad_y, top), (pad_w, 0, 0), (0, -(pad_y + depth * 0.46), 0))
    grey = sampler.material("plain", 0.5, sampler.grey(0.1, 0.8))
    return [(Material(_keys(sampler.rng)), keys), (grey, pad)]


def _plate(size: tuple[float, float], thick: float, radius: float) -> Mesh:
    """A flat plate with round corners, its hinge edge along y = 0, lying to the front."""
    width, depth = size
    return prism(rounded_outline(width, depth, radius), thick).translated(0, -depth / 2, 0)


def _lid(size: tuple[float, float], thick: float, bezel: tuple[float, float]) -> tuple[Mesh, Mesh]:
    """A lid upright on its hinge and its screen; ``bezel`` at the sides and below."""
    width, high = size
    lid = _plate((width, high), thick, 0.012).rotated("x", -90)
    side, below = bezel
    glass = front_panel(width - 2 * side, high - side - below, (0, -0.003, below))
    return lid, glass


def open_wide(sampler: Sampler) -> Model:
    """An ordinary laptop, its lid from half open to laid far back."""
    width = sampler.size(0.29, 0.42)
    depth = width * sampler.uniform(0.64, 0.74)
    thick = sampler.uniform(0.014, 0.026)
    base = rounded_box((width, depth, thick), (0, 0, 0.003), 0.006)
    feet = [
        cylinder(0.008, 0.006, (x * width * 0.4, y * depth * 0.4, 0), 8)
        for x in (-1, 1)
        for y in (-1, 1)
    ]
    top = thick + 0.005
    lid, glass = _lid((width, depth), 0.008, (sampler.uniform(0.006, 0.018), 0.025))
    lean = -sampler.choice((-35, -20, -5, 10, 25, 40, 60))
    hinge = rod((-width * 0.35, 0, 0), (width * 0.35, 0, 0), 0.007).translated(0, depth / 2, top)
    parts = [mesh.rotated("x", lean).translated(0, depth / 2, top) for mesh in (lid, glass)]
    return settled(
        "laptop",
        (_casing(sampler), [base, parts[0]]),
        (sampler.dark(), [*feet, hinge]),
        *((material, [mesh]) for material, mesh in _deck(sampler, (width, depth), top)),
        (_screen(sampler), [parts[1]]),
    )


def wedge(sampler: Sampler) -> Model:
    """A slim laptop whose base tapers to a thin front edge, with a very thin lid."""
    width = sampler.size(0.28, 0.36)
    depth = width * sampler.uniform(0.66, 0.74)
    rear, front = sampler.uniform(0.014, 0.02), 0.004
    side = [(-depth / 2, rear - front), (depth / 2, 0.002), (depth / 2, rear), (-depth / 2, rear)]
    base = prism(side, width).rotated("x", 90).rotated("z", 90).translated(-width / 2, 0, 0)
    top = rear + 0.002
    lid, glass = _lid((width, depth), 0.005, (sampler.uniform(0.004, 0.01), 0.012))
    lean = -sampler.uniform(5, 40)
    parts = [mesh.rotated("x", lean).translated(0, depth / 2, rear) for mesh in (lid, glass)]
    badge = cylinder(0.014, 0.002, segments=12).rotated("x", 90).translated(0, 0.008, depth * 0.5)
    badge = badge.rotated("x", lean).translated(0, depth / 2, rear)
    return settled(
        "laptop",
        (_casing(sampler), [base, parts[0]]),
        (sampler.metal(), [badge]),
        *((material, [mesh]) for material, mesh in _deck(sampler, (width, depth), top)),
        (_screen(sampler), [parts[1]]),
    )


def tent(sampler: Sampler) -> Model:
    """A convertible folded over: a tent on two edges, or a stand with its keyboard face down."""
    width = sampler.size(0.28, 0.36)
    depth = width * sampler.uniform(0.64, 0.72)
    lid, glass = _lid((width, depth), 0.009, (0.01, 0.016))
    screen, tilt = [lid, glass], sampler.uniform(18, 32)
    if sampler.chance(0.6):  # the hinge is the ridge, and the picture turned to stand upright
        screen[1] = Mesh(glass.vertices, glass.faces, 1 - glass.uv)
        turned = [mesh.rotated("y", 180).rotated("x", -tilt) for mesh in screen]
        base = _plate((width, depth), 0.016, 0.012).rotated("x", 90 + tilt)
    else:
        turned = [mesh.rotated("x", -tilt) for mesh in screen]
        base = _plate((width, depth), 0.016, 0.012).translated(0, 0.02, -0.016)
    hinges = [
        rod((x - 0.02, 0.003, 0), (x + 0.02, 0.003, 0), 0.012) for x in (-width * 0.3, width * 0.3)
    ]
    return settled(
        "laptop",
        (_casing(sampler), [turned[0], base]),
        (sampler.metal(), hinges),
        (_screen(sampler), [turned[1]]),
    )


def thick_old(sampler: Sampler) -> Model:
    """A heavy old laptop: thick base with drive and ports, a thick lid with a wide bezel."""
    width, depth = sampler.size(0.3, 0.38), sampler.size(0.25, 0.3)
    thick = sampler.uniform(0.035, 0.055)
    base = [box((width, depth, thick))]
    if sampler.chance(0.6):
        base.append(
            rounded_box((width + 0.006, depth * 0.3, thick * 0.7), (0, -depth * 0.34, 0), 0.01)
        )
    top, high = thick + 0.003, depth * 0.94
    lid_thick = sampler.uniform(0.014, 0.024)
    lid = [box((width, lid_thick, high), (0, lid_thick / 2, 0))]
    bezel = sampler.uniform(0.02, 0.035)
    rim = front_panel(width - 2 * bezel, high - 2.4 * bezel, (0, -0.003, bezel * 1.4))
    lean = -sampler.uniform(-5, 35)
    hinge_y = depth * 0.42
    moved = [mesh.rotated("x", lean).translated(0, hinge_y, thick) for mesh in (*lid, rim)]
    dark = [
        box((0.006, 0.13, 0.008), (width / 2, -0.02, thick * 0.5)),
        box((0.05, 0.006, 0.012), (-width * 0.25, depth / 2, thick * 0.3)),
        rod((-width * 0.3, hinge_y, thick), (width * 0.3, hinge_y, thick), 0.011),
        *(box((0.006, 0.02, 0.01), (-width / 2, y, thick * 0.4)) for y in (-0.05, 0.0, 0.04)),
    ]
    return settled(
        "laptop",
        (_casing(sampler), [*base, moved[0]]),
        (sampler.dark(), dark),
        *((material, [mesh]) for material, mesh in _deck(sampler, (width, depth * 0.82), top)),
        (_screen(sampler), [moved[1]]),
    )


def nearly_shut(sampler: Sampler) -> Model:
    """A laptop with its lid lowered to a gap, or shut, a badge and stickers on it."""
    width = sampler.size(0.29, 0.4)
    depth = width * sampler.uniform(0.64, 0.72)
    thick = sampler.uniform(0.014, 0.024)
    base = rounded_box((width, depth, thick), (0, 0, 0), 0.006)
    top = thick + 0.003
    lid, glass = _lid((width, depth), 0.009, (0.01, 0.02))
    badge = cylinder(0.02, 0.002, segments=12).rotated("x", 90).translated(0, 0.012, depth * 0.5)
    marks = [badge]
    for _ in range(sampler.integer(0, 3)):
        at = (sampler.uniform(-0.35, 0.35) * width, 0.011, sampler.uniform(0.1, 0.8) * depth)
        marks.append(box((sampler.uniform(0.03, 0.07), 0.002, sampler.uniform(0.02, 0.05)), at))
    fold = 90 - sampler.choice((1.5, 8.0, 18.0, 30.0, 45.0))
    moved = [
        mesh.rotated("x", fold).translated(0, depth / 2 - 0.004, top)
        for mesh in (lid, glass, *marks)
    ]
    return settled(
        "laptop",
        (_casing(sampler), [base, moved[0]]),
        *((material, [mesh]) for material, mesh in _deck(sampler, (width, depth), thick + 0.002)),
        (sampler.plastic(), moved[2:]),
        (_screen(sampler), [moved[1]]),
    )


DESIGNS: dict[str, tuple[ModelFactory, ...]] = {
    "laptop": (open_wide, wedge, tent, thick_old, nearly_shut)
}
