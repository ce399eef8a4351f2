"""A small furnished room as a trimesh scene, to be written in any format."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import trimesh

RED = [200, 40, 40, 255]
BLUE = [40, 40, 200, 255]


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


def write_two_materials(folder: Path, nodes: Sequence[str]) -> Path:
    """A glTF in a folder: nodes 3 m apart that share one mesh of a red and a blue box."""
    boxes = trimesh.Scene()
    for name, colour, height_m in (("seat", RED, 0.2), ("back", BLUE, 0.6)):
        box = trimesh.creation.box((1, 0.4, 1))
        box.apply_translation((0, height_m, 0))
        box.visual.vertex_colors = colour
        boxes.add_geometry(box, node_name=name, geom_name=name)
    files = boxes.export(file_type="gltf")
    gltf = json.loads(files["model.gltf"])
    seat, back = gltf["meshes"]
    gltf["meshes"] = [{"name": "mesh", "primitives": seat["primitives"] + back["primitives"]}]
    gltf["nodes"] = [
        {"name": name, "mesh": 0, "translation": [3.0 * index, 0, 0]}
        for index, name in enumerate(nodes)
    ]
    gltf["scenes"] = [{"nodes": list(range(len(nodes)))}]
    for name, data in files.items():
        (folder / name).write_bytes(data)
    path = folder / "model.gltf"
    path.write_text(json.dumps(gltf), encoding="utf-8")
    return path
