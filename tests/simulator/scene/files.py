"""A small furnished room as a trimesh scene, to be written in any format."""

from __future__ import annotations

import numpy as np
import trimesh

RED = [200, 40, 40, 255]


def room_of(up: str) -> trimesh.Scene:
    """A 4 m floor half a metre above the origin, a sofa and a coffee table on it."""
    scene = trimesh.Scene()
    parts = {
        "floor": ((4.0, 4.0, 0.1), (0.0, 0.0, 0.45)),
        "Sofa-01": ((1.0, 0.5, 0.6), (1.0, 1.0, 0.8)),
        "coffee_table_1": ((0.4, 0.4, 0.4), (-1.4, -1.4, 0.7)),
    }
    for name, (size, at) in parts.items():
        mesh = trimesh.creation.box(size)
        mesh.apply_translation(at)
        mesh.visual.vertex_colors = RED
        if up == "y":
            mesh.apply_transform(trimesh.transformations.rotation_matrix(-np.pi / 2, (1, 0, 0)))
        scene.add_geometry(mesh, node_name=name, geom_name=name)
    return scene
