"""Scene files as they are read: named meshes in the file's axes, and their corrections."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import trimesh

from onemap_simulator.scene.corrections import Corrections, read_corrections
from onemap_simulator.scene.scene import UNNAMED

SUFFIXES = (".glb", ".gltf", ".obj", ".ply")
Y_UP_SUFFIXES = (".glb", ".gltf")  # by their standard; the other formats do not say

# What exporters call things that nobody named.
_ANONYMOUS = frozenset({"", "geometry", "mesh", "node", "object", "scene", "world", "default"})
_CAMEL = re.compile(r"(?<=[a-z])(?=[A-Z])")
_COUNTER = re.compile(r"[\s_.\-]*\d+$")
_SEPARATORS = re.compile(r"[\s_.\-]+")


@dataclass(frozen=True, slots=True)
class SceneFile:
    """A file as it was read: (node name, trimesh in the file's axes) and the corrections."""

    path: Path
    named: list[tuple[str, Any]]
    corrections: Corrections

    @property
    def yaml(self) -> Path:
        """Where the corrections are, or would be."""
        return self.path.with_suffix(".yaml")

    @property
    def up(self) -> str:
        """The axis that points up, y or z."""
        usual = "y" if self.path.suffix.lower() in Y_UP_SUFFIXES else "z"
        return self.corrections.up or usual

    @property
    def unknown_nodes(self) -> tuple[str, ...]:
        """Nodes that the YAML renames and the file does not have."""
        return tuple(sorted(set(self.corrections.categories) - {name for name, _ in self.named}))

    def category(self, node: str) -> str:
        """What a node is taken for."""
        return self.corrections.categories.get(node, category_of(node))


def category_of(name: str) -> str:
    """The category in a node's name: counters dropped, separators to spaces, lower case.

    ``sofa_2``, ``sofa.003`` and ``Sofa-01`` are "sofa", ``coffee_table_1`` and ``CoffeeTable``
    are "coffee table"; a name that says nothing, as ``geometry_0``, is "object".
    """
    text = _CAMEL.sub(" ", name.strip())
    while _COUNTER.search(text):
        text = _COUNTER.sub("", text)
    text = _SEPARATORS.sub(" ", text).strip().lower()
    return UNNAMED if text in _ANONYMOUS else text


def read_scene_file(path: Path) -> SceneFile:
    """What a scene file and the YAML beside it hold; ValueError as ``load_scene``."""
    corrections = check_file(path)
    return SceneFile(path, _named_meshes(path), corrections)


def check_file(path: Path) -> Corrections:
    """What lies beside a scene, without opening it: a moment, where ``load_scene`` takes seconds.

    ValueError: a missing or unsupported file, or a YAML that is wrong.
    """
    if path.suffix.lower() not in SUFFIXES:
        raise ValueError(
            f"scene {path}: suffix {path.suffix!r} is not one of {', '.join(SUFFIXES)}"
        )
    if not path.is_file():
        raise ValueError(f"scene {path} does not exist")
    return read_corrections(path.with_suffix(".yaml"))


def missing_node(file: SceneFile) -> str:
    """One sentence about the first node that the YAML renames and the file does not have."""
    names = sorted({name for name, _ in file.named})
    return (
        f"{file.yaml}: no node is called {file.unknown_nodes[0]!r}; "
        f"the scene has {', '.join(names[:20])}"
    )


def _named_meshes(path: Path) -> list[tuple[str, Any]]:
    """(node name, trimesh in scene coordinates) of everything with triangles in the file."""
    try:
        options = _obj_options(path) if path.suffix.lower() == ".obj" else {}
        loaded = trimesh.load(path, force="scene", process=False, **options)
    except Exception as error:  # trimesh passes on whatever its parsers and PIL raise
        raise ValueError(f"scene {path} cannot be read: {' '.join(str(error).split())}") from error
    named = []
    for node in loaded.graph.nodes_geometry:
        T_world_node, geometry = loaded.graph[node]
        mesh = loaded.geometry[geometry]
        if isinstance(mesh, trimesh.Trimesh) and len(mesh.faces):
            name = UNNAMED if path.suffix.lower() == ".ply" else str(node)
            named.append((name, mesh.copy().apply_transform(T_world_node)))
    if not named:
        raise ValueError(f"scene {path} has no triangles")
    return named


def _obj_options(path: Path) -> dict[str, bool]:
    """Keep what the file names apart: its objects, or its groups if it has no objects."""
    lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
    objects = any(line.startswith("o ") for line in lines)
    return {"split_objects": objects, "split_groups": not objects, "group_material": False}
