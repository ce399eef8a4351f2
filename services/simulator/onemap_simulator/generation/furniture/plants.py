"""Potted plants and vases."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import Mesh, ellipsoid, from_faces, lathe, rod, tube
from onemap_simulator.generation.model import Material, Model, assemble
from onemap_simulator.generation.sampler import Sampler


def floor_plant(sampler: Sampler) -> Model:
    """A large potted plant for the floor."""
    return _potted(sampler, sampler.size(0.15, 0.2), sampler.size(0.8, 1.3))


def small_plant(sampler: Sampler) -> Model:
    """A potted plant for a table or sill."""
    return _potted(sampler, sampler.size(0.08, 0.11), sampler.size(0.32, 0.48))


def _potted(sampler: Sampler, radius: float, height: float) -> Model:
    pot_h = radius * sampler.size(1.4, 1.9)
    profile = [(radius * 0.7, 0), (radius * 0.95, pot_h * 0.85), (radius * 1.05, pot_h * 0.86)]
    profile += [(radius * 1.05, pot_h), (radius * 0.9, pot_h), (radius * 0.88, pot_h * 0.9)]
    pot = lathe([*profile, (0.0, pot_h * 0.9)])
    kind = sampler.integer(0, 2)
    green, stems = _foliage(sampler, kind, (radius, pot_h, height))
    bark = sampler.material("noise", 0.2, (0.35, 0.24, 0.15))
    ceramic = sampler.ceramic() if sampler.chance(0.5) else sampler.plastic()
    return assemble("potted plant", (ceramic, [pot]), (sampler.foliage(), green), (bark, stems))


def _foliage(
    sampler: Sampler, kind: int, size: tuple[float, float, float]
) -> tuple[list[Mesh], list[Mesh]]:
    """Leaves and stems above a pot: sword leaves, broad leaves on stems, or a bush."""
    radius, pot_h, height = size
    tall = height - pot_h
    leaves: list[Mesh] = []
    stems: list[Mesh] = []
    if kind == 0:
        for _ in range(sampler.integer(9, 14)):
            lean, turn = sampler.uniform(8, 42), sampler.uniform(0, 360)
            blade = leaf(
                radius * sampler.uniform(0.35, 0.6), tall * sampler.uniform(0.7, 1.05), 0.25
            )
            leaves.append(
                blade.rotated("x", -lean).rotated("z", turn).translated(0, 0, pot_h * 0.9)
            )
    elif kind == 1:
        for _ in range(sampler.integer(7, 11)):
            angle, reach = sampler.uniform(0, 2 * np.pi), radius * sampler.uniform(0.6, 1.6)
            tip = (
                reach * np.cos(angle),
                reach * np.sin(angle),
                height * sampler.uniform(0.6, 0.92),
            )
            stems.append(
                tube(
                    [(0, 0, pot_h * 0.8), (tip[0] * 0.3, tip[1] * 0.3, tip[2] * 0.8), tip], 0.008, 5
                )
            )
            blade = leaf(
                radius * sampler.uniform(0.9, 1.3), radius * sampler.uniform(1.3, 2.0), 0.5
            )
            blade = blade.rotated("x", -sampler.uniform(50, 110)).rotated(
                "z", float(np.degrees(angle)) + 90
            )
            leaves.append(blade.translated(*tip))
    else:
        stems.append(rod((0, 0, pot_h * 0.8), (0, 0, pot_h + tall * 0.5), 0.08 * radius + 0.006))
        for _ in range(sampler.integer(30, 45)):
            direction = sampler.rng.normal(size=3)
            direction /= np.linalg.norm(direction)
            centre = np.array([0, 0, pot_h + tall * 0.55])
            at = centre + direction * (radius * 1.25, radius * 1.25, tall * 0.38)
            blade = leaf(radius * 0.55, radius * 0.9, 0.5).rotated("x", sampler.uniform(-120, 30))
            leaves.append(blade.rotated("z", sampler.uniform(0, 360)).translated(*at))
        leaves.append(
            ellipsoid((radius * 0.9, radius * 0.9, tall * 0.3), (0, 0, pot_h + tall * 0.55), 10)
        )
    return leaves, stems


def leaf(width: float, length: float, widest: float) -> Mesh:
    """A pointed leaf that stands upright on the origin, folded along its midrib."""
    half, z = width / 2, length * widest
    points = [(0, 0, 0), (-half, -half * 0.4, z), (half, -half * 0.4, z), (0, 0, z), (0, 0, length)]
    faces = [(0, 3, 1), (0, 2, 3), (1, 3, 4), (3, 2, 4)]
    return from_faces(points, faces)


def vase(sampler: Sampler) -> Model:
    """A vase of a random profile, often with flowers."""
    height, radius = sampler.size(0.24, 0.36), sampler.size(0.075, 0.12)
    belly, neck = sampler.uniform(0.25, 0.65), sampler.uniform(0.3, 0.65)
    profile = [
        (radius * 0.55, 0.0),
        (radius * 0.9, height * belly * 0.5),
        (radius, height * belly),
        (radius * neck, height * 0.85),
        (radius * neck * sampler.uniform(1.1, 1.6), height),
        (radius * neck * 0.9, height * 0.97),
        (0.0, height * 0.8),
    ]
    glaze = (
        sampler.ceramic()
        if sampler.chance(0.3)
        else sampler.fabric()
        if sampler.chance(0.4)
        else sampler.plastic()
    )
    groups: list[tuple[Material, list[Mesh]]] = [(glaze, [lathe(profile, segments=18)])]
    if sampler.chance(0.6):
        stems, petals = [], []
        for _ in range(sampler.integer(4, 8)):
            angle, spread = sampler.uniform(0, 2 * np.pi), radius * sampler.uniform(0.3, 1.6)
            top = height * sampler.uniform(1.3, 1.75)
            tip = (spread * np.cos(angle), spread * np.sin(angle), top)
            stems.append(rod((0, 0, height * 0.8), tip, 0.006, 5))
            petals.append(ellipsoid((0.038, 0.038, 0.026), tip, 8))
        groups += [(sampler.foliage(), stems), (sampler.plastic(), petals)]
    return assemble("vase", *groups)
