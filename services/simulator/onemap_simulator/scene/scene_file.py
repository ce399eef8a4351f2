"""Scene files as they are read: named meshes in the file's axes, and their corrections."""
# Touches files: scenes and the YAML beside them.

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from onemap_simulator.scene.scene import UNNAMED

SUFFIXES = (".glb", ".gltf", ".obj", ".ply")
Y_UP_SUFFIXES = (".glb", ".gltf")  # by their standard; the other formats do not say

_KEYS = ("categories", "start", "up", "floor")  # of the YAML beside a scene

# Names that exporters give to nodes without one.
_ANONYMOUS = frozenset({"", "geometry", "mesh", "node", "object", "scene", "world", "default"})
_CAMEL = re.compile(r"(?<=[a-z])(?=[A-Z])")
_COUNTER = re.compile(r"[\s_.\-]*\d+[\s_.\-]*$")
_SEPARATORS = re.compile(r"[\s_.\-]+")


@dataclass(frozen=True, slots=True)
class Corrections:
    """Contents of ``<stem>.yaml``: node to category, start (x, y, yaw in the map), up axis.

    ``floor_m``: the floor's height along the up axis of the file.
    """

    categories: dict[str, str] = field(default_factory=dict)
    start: tuple[float, float, float] | None = None
    up: str | None = None
    floor_m: float | None = None


@dataclass(frozen=True, slots=True)
class FileNode:
    """A node with triangles: its name, and a trimesh in the file's axes for each material."""

    name: str
    meshes: tuple[Any, ...]

    @property
    def triangles(self) -> int:
        """Triangles of all its meshes."""
        return sum(len(mesh.faces) for mesh in self.meshes)


@dataclass(frozen=True, slots=True)
class SceneFile:
    """A file as read: its nodes with triangles and the corrections."""

    path: Path
    nodes: tuple[FileNode, ...]
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
        return tuple(sorted(set(self.corrections.categories) - {node.name for node in self.nodes}))

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
    return SceneFile(path, _read_nodes(path), corrections)


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


def read_corrections(path: Path) -> Corrections:
    """Read the YAML beside a scene; a missing file is empty. ValueError names the wrong key."""
    if not path.is_file():
        return Corrections()
    try:
        raw = yaml.safe_load(path.read_text(encoding="utf-8")) or {}
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise ValueError(f"{path} is not valid YAML: {' '.join(str(error).split())}") from error
    if not isinstance(raw, dict):
        raise ValueError(f"{path} must hold keys and values, not a {type(raw).__name__}")
    if unknown := set(raw) - set(_KEYS):
        raise ValueError(
            f"{path}: unknown key {min(map(str, unknown))!r}; known are {', '.join(_KEYS)}"
        )
    categories, start, up, floor = (raw.get(key) for key in _KEYS)
    categories = categories or {}
    if not isinstance(categories, dict) or not all(
        isinstance(text, str) for names in categories.items() for text in names
    ):
        raise ValueError(f"{path}: categories must map node names to category names")
    if start is not None:
        if not (isinstance(start, list) and len(start) == 3 and all(map(_is_number, start))):
            raise ValueError(f"{path}: start is {start!r}; it must be three numbers [x, y, yaw]")
        start = (float(start[0]), float(start[1]), float(start[2]))
    if up not in (None, "y", "z"):
        raise ValueError(f"{path}: up is {up!r}; it must be y or z")
    if floor is not None and not _is_number(floor):
        raise ValueError(f"{path}: floor is {floor!r}; it must be a height in metres")
    return Corrections(categories, start, up, floor)


def _is_number(value: Any) -> bool:
    number = isinstance(value, (int, float)) and not isinstance(value, bool)
    return number and bool(np.isfinite(value))


def missing_node(file: SceneFile) -> str:
    """The error for the first node that the YAML renames but the file does not contain."""
    names = sorted({node.name for node in file.nodes})
    return (
        f"{file.yaml}: no node is called {file.unknown_nodes[0]!r}; "
        f"the scene has {', '.join(names[:20])}"
    )


def _read_nodes(path: Path) -> tuple[FileNode, ...]:
    """Every node with triangles; its meshes are in scene coordinates."""
    import trimesh  # here: a second of a start that needs no file

    try:
        options = _obj_options(path) if path.suffix.lower() == ".obj" else {}
        loaded = trimesh.load(path, force="scene", process=False, **options)
    except Exception as error:  # trimesh lets any exception of its parsers and PIL through
        raise ValueError(f"scene {path} cannot be read: {' '.join(str(error).split())}") from error
    meshes: dict[str, list[Any]] = {}
    for node in loaded.graph.nodes_geometry:
        T_world_node, geometry = loaded.graph[node]
        mesh = loaded.geometry[geometry]
        if isinstance(mesh, trimesh.Trimesh) and len(mesh.faces):
            name = UNNAMED if path.suffix.lower() == ".ply" else _name_in_file(loaded, node, mesh)
            meshes.setdefault(name, []).append(mesh.copy().apply_transform(T_world_node))
    if not meshes:
        raise ValueError(f"scene {path} has no triangles")
    return tuple(FileNode(name, tuple(parts)) for name, parts in meshes.items())


def _name_in_file(loaded: Any, node: str, mesh: Any) -> str:
    """The name of the file's node: of one of several materials trimesh makes a node for each."""
    several = mesh.metadata.get("from_gltf_primitive", False)
    return str(loaded.graph.transforms.parents[node] if several else node)


def _obj_options(path: Path) -> dict[str, bool]:
    """Options of trimesh that split an OBJ by its objects, or by its groups if it has none."""
    lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
    objects = any(line.startswith("o ") for line in lines)
    return {"split_objects": objects, "split_groups": not objects, "group_material": False}
