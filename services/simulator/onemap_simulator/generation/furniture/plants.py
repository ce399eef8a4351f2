"""Potted plants and vases."""

from __future__ import annotations

import numpy as np

from onemap_simulator.generation.mesh import Mesh, ellipsoid, from_faces, lathe, rod, tube
from onemap_simulator.generation.model import Material, Model, assemble
from onemap_simulator.generation.sampler import Pick


def floor_plant(pick: Pick) -> Model:
    """A large potted plant for the floor."""
    return _potted(pick, pick.size(0.15, 0.2), pick.size(0.8, 1.3))


def small_plant(pick: Pick) -> Model:
    """A potted plant for a table or sill."""
    return _potted(pick, pick.size(0.08, 0.11), pick.size(0.32, 0.48))


def _potted(pick: Pick, radius: float, height: float) -> Model:
    pot_h = radius * pick.size(1.4, 1.9)
    profile = [(radius * 0.7, 0), (radius * 0.95, pot_h * 0.85), (radius * 1.05, pot_h * 0.86)]
    profile += [(radius * 1.05, pot_h), (radius * 0.9, pot_h), (radius * 0.88, pot_h * 0.9)]
    pot = lathe([*profile, (0.0, pot_h * 0.9)])
    kind = pick.count(0, 2)
    green, stems = _foliage(pick, kind, (radius, pot_h, height))
    bark = pick.of("noise", 0.2, (0.35, 0.24, 0.15))
    ceramic = pick.ceramic() if pick.chance(0.5) else pick.plastic()
    return assemble("potted plant", (ceramic, [pot]), (pick.leafy(), green), (bark, stems))


def _foliage(
    pick: Pick, kind: int, size: tuple[float, float, float]
) -> tuple[list[Mesh], list[Mesh]]:
    """Leaves and stems above a pot: sword leaves, broad leaves on stems, or a bush."""
    radius, pot_h, height = size
    tall = height - pot_h
    leaves: list[Mesh] = []
    stems: list[Mesh] = []
    if kind == 0:
        for _ in range(pick.count(9, 14)):
            lean, turn = pick.between(8, 42), pick.between(0, 360)
            blade = leaf(radius * pick.between(0.35, 0.6), tall * pick.between(0.7, 1.05), 0.25)
            leaves.append(blade.turned("x", -lean).turned("z", turn).moved(0, 0, pot_h * 0.9))
    elif kind == 1:
        for _ in range(pick.count(7, 11)):
            angle, reach = pick.between(0, 2 * np.pi), radius * pick.between(0.6, 1.6)
            tip = (reach * np.cos(angle), reach * np.sin(angle), height * pick.between(0.6, 0.92))
            stems.append(
                tube(
                    [(0, 0, pot_h * 0.8), (tip[0] * 0.3, tip[1] * 0.3, tip[2] * 0.8), tip], 0.008, 5
                )
            )
            blade = leaf(radius * pick.between(0.9, 1.3), radius * pick.between(1.3, 2.0), 0.5)
            blade = blade.turned("x", -pick.between(50, 110)).turned(
                "z", float(np.degrees(angle)) + 90
            )
            leaves.append(blade.moved(*tip))
    else:
        stems.append(rod((0, 0, pot_h * 0.8), (0, 0, pot_h + tall * 0.5), 0.08 * radius + 0.006))
        for _ in range(pick.count(30, 45)):
            direction = pick.rng.normal(size=3)
            direction /= np.linalg.norm(direction)
            centre = np.array([0, 0, pot_h + tall * 0.55])
            at = centre + direction * (radius * 1.25, radius * 1.25, tall * 0.38)
            blade = leaf(radius * 0.55, radius * 0.9, 0.5).turned("x", pick.between(-120, 30))
            leaves.append(blade.turned("z", pick.between(0, 360)).moved(*at))
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


def vase(pick: Pick) -> Model:
    """A vase of a random profile, often with flowers."""
    height, radius = pick.size(0.24, 0.36), pick.size(0.075, 0.12)
    belly, neck = pick.between(0.25, 0.65), pick.between(0.3, 0.65)
    profile = [
        (radius * 0.55, 0.0),
        (radius * 0.9, height * belly * 0.5),
        (radius, height * belly),
        (radius * neck, height * 0.85),
        (radius * neck * pick.between(1.1, 1.6), height),
        (radius * neck * 0.9, height * 0.97),
        (0.0, height * 0.8),
    ]
    glaze = (
        pick.ceramic()
        if pick.chance(0.3)
        else pick.fabric()
        if pick.chance(0.4)
        else pick.plastic()
    )
    groups: list[tuple[Material, list[Mesh]]] = [(glaze, [lathe(profile, segments=18)])]
    if pick.chance(0.6):
        stems, petals = [], []
        for _ in range(pick.count(4, 8)):
            angle, spread = pick.between(0, 2 * np.pi), radius * pick.between(0.3, 1.6)
            top = height * pick.between(1.3, 1.75)
            tip = (spread * np.cos(angle), spread * np.sin(angle), top)
            stems.append(rod((0, 0, height * 0.8), tip, 0.006, 5))
            petals.append(ellipsoid((0.038, 0.038, 0.026), tip, 8))
        groups += [(pick.leafy(), stems), (pick.plastic(), petals)]
    return assemble("vase", *groups)
