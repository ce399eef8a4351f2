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

# Names that exporters give to nodes without one.
_ANONYMOUS = frozenset({"", "geometry", "mesh", "node", "object", "scene", "world", "default"})
_CAMEL = re.compile(r"(?<=[a-z])(?=[A-Z])")
_COUNTER = re.compile(r"[\s_.\-]*\d+[\s_.\-]*$")
_SEPARATORS = re.compile(r"[\s_.\-]+")


@dataclass(frozen=True, slots=True)
class SceneFile:
    """A file as read: (node name, trimesh in the file's axes) pairs and the corrections."""

    path: Path
    named: list[tuple[str, Any]]
    corrections: Corrections

    @property
    def yaml(self) -> Path:
        """Path of the corrections, whether or not the file exists."""
        return self.path.with_suffix(".yaml")

    @property
    def up(self) -> str:
        """The axis that points up, y or z."""
        usual = "y" if self.path.suffix.lower() in Y_UP_SUFFIXES else "z"
        return self.corrections.up or usual

    @property
    def unknown_nodes(self) -> tuple[str, ...]:
        """Nodes that the YAML renames but the file does not contain."""
        return tuple(sorted(set(self.corrections.categories) - {name for name, _ in self.named}))

    def category(self, node: str) -> str:
        """Category of a node: the YAML's, else from its name."""
        return self.corrections.categories.get(node, category_of(node))


def category_of(name: str) -> str:
    """The category in a node's name: counters dropped, separators to spaces, lower case.

    ``sofa_2``, ``sofa.003`` and ``Sofa-01`` are "sofa", ``coffee_table_1`` and ``CoffeeTable``
    are "coffee table"; an exporter's default name such as ``geometry_0`` is "object".
    """
    text = _CAMEL.sub(" ", name.strip())
    while _COUNTER.search(text):
        text = _COUNTER.sub("", text)
    text = _SEPARATORS.sub(" ", text).strip().lower()
    return UNNAMED if text in _ANONYMOUS else text


def read_scene_file(path: Path) -> SceneFile:
    """Read a scene file and the YAML beside it; ValueError as ``load_scene``."""
    corrections = check_file(path)
    return SceneFile(path, _named_meshes(path), corrections)


def check_file(path: Path) -> Corrections:
    """Check suffix, existence and YAML of a scene without reading it; returns the corrections.

    ValueError: a missing or unsupported file, or a wrong YAML.
    """
    if path.suffix.lower() not in SUFFIXES:
        raise ValueError(
            f"scene {path}: suffix {path.suffix!r} is not one of {', '.join(SUFFIXES)}"
        )
    if not path.is_file():
        raise ValueError(f"scene {path} does not exist")
    return read_corrections(path.with_suffix(".yaml"))


def missing_node(file: SceneFile) -> str:
    """The error for the first node that the YAML renames but the file does not contain."""
    names = sorted({name for name, _ in file.named})
    return (
        f"{file.yaml}: no node is called {file.unknown_nodes[0]!r}; "
        f"the scene has {', '.join(names[:20])}"
    )


def _named_meshes(path: Path) -> list[tuple[str, Any]]:
    """(node name, trimesh in scene coordinates) of every node with triangles."""
    try:
        options = _obj_options(path) if path.suffix.lower() == ".obj" else {}
        loaded = trimesh.load(path, force="scene", process=False, **options)
    except Exception as error:  # trimesh lets any exception of its parsers and PIL through
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
    """Options of trimesh that split an OBJ by its objects, or by its groups if it has none."""
    lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
    objects = any(line.startswith("o ") for line in lines)
    return {"split_objects": objects, "split_groups": not objects, "group_material": False}
