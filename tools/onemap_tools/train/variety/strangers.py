"""Things without a name: random bodies and recombined parts, which no word of the classes fits."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from onemap_shared.geometry import F64
from onemap_simulator.generation.mesh import (
    Mesh,
    box,
    cone,
    cylinder,
    ellipsoid,
    lathe,
    prism,
    rounded_box,
    torus,
    tube,
)
from onemap_simulator.generation.model import Material, Model, Part
from onemap_tools.train.variety.shapes import box_of, fitted

STRANGER = "stranger"  # the category; no name of the vocabulary
RECOMBINED = 0.35  # share of strangers made of parts of named things

MakeMaterial = Callable[[], Material]


def stranger(
    rng: np.random.Generator,
    size_m: tuple[float, float, float],
    parts: Sequence[Part],
    material: MakeMaterial,
) -> Model:
    """A thing of about this size, base at z = 0; ``parts``: of named things, to recombine."""
    if len(parts) and rng.random() < RECOMBINED:
        pieces = _from_parts(rng, parts, material)
    else:
        pieces = _from_bodies(rng, material)
    turned = float(rng.integers(4) * 90)
    pieces = [Part(p.mesh.rotated("z", turned), p.material) for p in pieces]
    half = np.array([size_m[0] / 2, size_m[1] / 2])
    target = np.array([[-half[0], -half[1], 0.0], [half[0], half[1], size_m[2]]])
    inner = box_of(pieces)
    scale = (target[1] - target[0]) / np.maximum(inner[1] - inner[0], 1e-6)
    # From faces anew: textures keep their scale in metres, whatever the body was before.
    shaped = [Part(_stretched(p.mesh, inner[0], scale, target[0]), p.material) for p in pieces]
    return Model(STRANGER, tuple(shaped))


def _stretched(mesh: Mesh, lower: F64, scale: F64, base: F64) -> Mesh:
    grow = float(np.cbrt(np.prod(scale)))
    return Mesh((mesh.vertices - lower) * scale + base, mesh.faces, mesh.uv * grow)


def _from_bodies(rng: np.random.Generator, material: MakeMaterial) -> list[Part]:
    """Two to seven bodies that touch: each begins somewhere within those before it."""
    pieces: list[Part] = []
    shared = material()
    for _ in range(int(rng.integers(2, 8))):
        mesh = BODIES[int(rng.integers(len(BODIES)))](rng)
        mesh = mesh.rotated("xyz"[int(rng.integers(3))], float(rng.choice([0, 90, 90, 35])))
        grow = np.exp(rng.uniform(-1.2, 0.3, 3))
        mesh = mesh.scaled(float(grow[0]), float(grow[1]), float(grow[2]))
        if pieces:
            around = box_of(pieces)
            at = around[0] + rng.random(3) * (around[1] - around[0])
            mesh = mesh.translated(float(at[0]), float(at[1]), float(at[2]))
        pieces.append(Part(mesh, shared if rng.random() < 0.4 else material()))
    return pieces


def _from_parts(
    rng: np.random.Generator, parts: Sequence[Part], material: MakeMaterial
) -> list[Part]:
    """Three to seven parts of anything, each stretched to a box of its own."""
    pieces: list[Part] = []
    for _ in range(int(rng.integers(3, 8))):
        part = parts[int(rng.integers(len(parts)))]
        lower = rng.uniform(-0.5, 0.3, 3)
        target = np.stack([lower, lower + np.exp(rng.uniform(-1.8, 0, 3))])
        pieces += fitted([part], target, material())
    return pieces


def _turned(rng: np.random.Generator) -> Mesh:
    """A body of revolution of any profile."""
    count = int(rng.integers(3, 8))
    radii, heights = rng.uniform(0.1, 0.5, count), np.linspace(0, 1, count)
    return lathe(list(zip(radii.tolist(), heights.tolist(), strict=True)), segments=12)


def _bent(rng: np.random.Generator) -> Mesh:
    """A tube along random points."""
    points = np.cumsum(rng.normal(0, 0.3, (int(rng.integers(3, 7)), 3)), axis=0)
    return tube(points, float(rng.uniform(0.02, 0.12)))


def _star(rng: np.random.Generator) -> Mesh:
    """An upright prism over an outline with corners at random distances."""
    count = int(rng.integers(3, 9))
    angle = np.linspace(0, 2 * np.pi, count, endpoint=False)
    radius = rng.uniform(0.25, 0.5, count)
    outline = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)
    return prism(outline - outline.mean(axis=0), 1.0)


BODIES: tuple[Callable[[np.random.Generator], Mesh], ...] = (
    lambda _: box((1, 1, 1)),
    lambda rng: rounded_box((1, 1, 1), radius=float(rng.uniform(0.05, 0.4))),
    lambda _: cylinder(0.5, 1.0, segments=16),
    lambda rng: cone((0.5, float(rng.uniform(0.02, 0.4))), 1.0),
    lambda _: ellipsoid((0.5, 0.5, 0.5), (0, 0, 0.5)),
    lambda rng: torus(0.4, float(rng.uniform(0.04, 0.15)), (0, 0, 0.15)),
    _turned,
    _bent,
    _star,
)
