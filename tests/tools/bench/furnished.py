"""A furnished room that no generator of this repository made, written as a scene file.

Plain boxes of one colour each with proportions of their own: ``python -m
tests.tools.bench.furnished room.glb`` writes it.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TypeAlias

import numpy as np
import trimesh

Box: TypeAlias = tuple[tuple[float, float, float], tuple[float, float, float]]  # size, lower corner
Colour: TypeAlias = tuple[int, int, int]

WALL, WOOD, FABRIC, WHITE, BLACK = (
    (225, 220, 205), (140, 95, 55), (70, 90, 120), (235, 235, 235), (25, 25, 28),
)  # fmt: skip
# Each node's boxes, in metres with z up; the room is 6.4 x 5.2 m.
NODES: dict[str, tuple[Colour, tuple[Box, ...]]] = {
    "floor": ((150, 130, 105), (((6.4, 5.2, 0.1), (0.0, 0.0, -0.1)),)),
    "wall": (
        WALL,
        (
            ((6.4, 0.1, 2.5), (0.0, -0.1, 0.0)),
            ((6.4, 0.1, 2.5), (0.0, 5.2, 0.0)),
            ((0.1, 5.2, 2.5), (-0.1, 0.0, 0.0)),
            ((0.1, 5.2, 2.5), (6.4, 0.0, 0.0)),
        ),
    ),
    "Bed": (
        (190, 190, 205),
        (
            ((2.1, 1.7, 0.35), (0.1, 3.3, 0.0)),
            ((2.0, 1.6, 0.2), (0.15, 3.35, 0.35)),
            ((0.08, 1.7, 1.0), (0.02, 3.3, 0.0)),
        ),
    ),
    "Sofa": (
        FABRIC,
        (
            ((1.9, 0.85, 0.42), (3.6, 0.15, 0.0)),
            ((1.9, 0.2, 0.8), (3.6, 0.05, 0.0)),
            ((0.2, 0.85, 0.6), (3.45, 0.1, 0.0)),
            ((0.2, 0.85, 0.6), (5.45, 0.1, 0.0)),
        ),
    ),
    "Table": (
        WOOD,
        (
            ((1.5, 0.9, 0.05), (3.4, 3.2, 0.7)),
            *(((0.06, 0.06, 0.7), (x, y, 0.0)) for x in (3.45, 4.8) for y in (3.25, 4.0)),
        ),
    ),
    "Chair": (
        (120, 60, 45),
        (
            ((0.42, 0.42, 0.04), (3.9, 2.6, 0.45)),
            ((0.42, 0.04, 0.5), (3.9, 2.56, 0.45)),
            *(((0.04, 0.04, 0.45), (x, y, 0.0)) for x in (3.9, 4.28) for y in (2.6, 2.98)),
        ),
    ),
    "Bookcase": (
        WOOD,
        (
            ((0.9, 0.03, 1.9), (0.3, 0.02, 0.0)),
            *(((0.03, 0.3, 1.9), (x, 0.05, 0.0)) for x in (0.3, 1.17)),
            *(((0.9, 0.3, 0.03), (0.3, 0.05, z)) for z in (0.1, 0.5, 0.9, 1.3, 1.85)),
        ),
    ),
    "Refrigerator": (
        WHITE,
        (((0.65, 0.65, 1.75), (5.7, 4.5, 0.0)), ((0.03, 0.03, 0.5), (5.66, 4.55, 0.9))),
    ),
    "Television": (
        BLACK,
        (((0.06, 1.1, 0.65), (6.3, 2.0, 0.8)), ((0.05, 0.2, 0.8), (6.33, 2.45, 0.0))),
    ),
}


def write_room(path: Path) -> Path:
    """Write the room as GLB, OBJ or PLY."""
    scene = trimesh.Scene()
    for name, (colour, boxes) in NODES.items():
        parts = []
        for size, corner in boxes:
            part = trimesh.creation.box(size)
            part.apply_translation(np.add(corner, np.divide(size, 2)))
            parts.append(part)
        mesh = trimesh.util.concatenate(parts)
        mesh.visual.vertex_colors = [*colour, 255]
        if path.suffix == ".glb":
            mesh.apply_transform(trimesh.transformations.rotation_matrix(-np.pi / 2, (1, 0, 0)))
        scene.add_geometry(mesh, node_name=name, geom_name=name)
    scene.export(path)
    return path


if __name__ == "__main__":
    write_room(Path(sys.argv[1]))
