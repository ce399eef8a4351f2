"""A scene from a user's file: glTF, GLB, OBJ or PLY, with a YAML beside it to correct it."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
import yaml

from onemap_shared.geometry import F64
from onemap_simulator.scene.mesh_texture import texture_and_uv
from onemap_simulator.scene.naming import UNNAMED, category_of
from onemap_simulator.scene.scene import Scene, SceneObject
from onemap_simulator.scene.spawn import ceiling_lamps, free_space, start_pose

SUFFIXES = (".glb", ".gltf", ".obj", ".ply")
Y_UP_SUFFIXES = (".glb", ".gltf")  # by their standard; the other formats do not say
AMBIENT = (0.6, 0.6, 0.6)  # bright: unknown rooms may have no place for a lamp
FLOOR_SEARCH_M = 1.0  # the floor lies within this height of the lowest point
FLOOR_BIN_M = 0.02
MAX_WIDTH_M = 200.0  # wider is no building in metres, and its floor plan would not fit in memory

# Z_FROM_Y_UP takes glTF's axes (y up) to the map's (z up).
Z_FROM_Y_UP: F64 = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])


@dataclass(frozen=True, slots=True)
class Corrections:
    """What ``<stem>.yaml`` says: node to category, start (x, y, yaw in the map), the up axis."""

    categories: dict[str, str] = field(default_factory=dict)
    start: tuple[float, float, float] | None = None
    up: str | None = None


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


def load_scene(path: Path | str) -> Scene:
    """The scene in a file, in metres with z up.

    glTF is turned from y-up; OBJ and PLY are taken as z-up unless the YAML says ``up: y``.
    Everything is shifted vertically so that the floor lies at z = 0: the level within the
    lowest metre with the largest horizontal area, else the lowest point. Node names become
    categories (see ``naming``), PLY is one "object"; the YAML's ``categories`` rename nodes.
    Without a ``start`` the robot stands at the roomiest place of the largest free floor.
    ValueError: a missing, unreadable, empty or unsupported file, one that is wider than 200 m,
    or a YAML that is wrong.
    """
    file = read_scene_file(Path(path))
    if file.unknown_nodes:
        raise ValueError(missing_node(file))
    scene, _ = assemble(file)
    if problem := size_problem(scene):
        raise ValueError(f"scene {path} {problem}")
    grid, clearance = free_space(scene)
    start = file.corrections.start or start_pose(grid, clearance)
    if start is None:
        raise ValueError(
            f"scene {path} has no free floor for a robot: give 'start: [x, y, yaw]' in "
            f"{file.yaml.name}"
        )
    return replace(scene, start=start, lights=ceiling_lamps(grid, clearance))


def read_scene_file(path: Path) -> SceneFile:
    """What a scene file and the YAML beside it hold; ValueError as ``load_scene``."""
    corrections = check_file(path)
    return SceneFile(path, _named_meshes(path), corrections)


def missing_node(file: SceneFile) -> str:
    """One sentence about the first node that the YAML renames and the file does not have."""
    names = sorted({name for name, _ in file.named})
    return (
        f"{file.yaml}: no node is called {file.unknown_nodes[0]!r}; "
        f"the scene has {', '.join(names[:20])}"
    )


def size_problem(scene: Scene) -> str:
    """Why a scene is too wide to be one in metres, empty if it is not."""
    width_m = float(np.ptp(scene.vertices[:, :2], axis=0).max())
    if width_m <= MAX_WIDTH_M:
        return ""
    unit, factor = ("centimetres", 0.01) if width_m <= 2500 else ("millimetres", 0.001)
    return (
        f"is {width_m:.0f} m wide, more than {MAX_WIDTH_M:.0f} m: its unit looks like {unit}; "
        f"export it in metres, that is scaled by {factor:g}"
    )


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


def read_corrections(path: Path) -> Corrections:
    """The YAML beside a scene; none is no correction. ValueError says which key is wrong."""
    if not path.is_file():
        return Corrections()
    try:
        raw = yaml.safe_load(path.read_text(encoding="utf-8")) or {}
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise ValueError(f"{path} is not valid YAML: {' '.join(str(error).split())}") from error
    if not isinstance(raw, dict):
        raise ValueError(f"{path} must hold keys and values, not a {type(raw).__name__}")
    unknown = set(raw) - {"categories", "start", "up"}
    if unknown:
        raise ValueError(
            f"{path}: unknown key {min(map(str, unknown))!r}; known are categories, start, up"
        )
    categories, start, up = raw.get("categories") or {}, raw.get("start"), raw.get("up")
    if not isinstance(categories, dict) or not all(
        isinstance(node, str) and isinstance(name, str) for node, name in categories.items()
    ):
        raise ValueError(f"{path}: categories must map node names to category names")
    if up not in (None, "y", "z"):
        raise ValueError(f"{path}: up is {up!r}; it must be y or z")
    return Corrections(dict(categories), _start_of(path, start), up)


def _start_of(path: Path, value: Any) -> tuple[float, float, float] | None:
    if value is None:
        return None
    numbers = isinstance(value, list) and all(
        isinstance(v, (int, float)) and not isinstance(v, bool) and np.isfinite(v) for v in value
    )
    if not numbers or len(value) != 3:
        raise ValueError(f"{path}: start is {value!r}; it must be three numbers [x, y, yaw]")
    return (float(value[0]), float(value[1]), float(value[2]))


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


def assemble(file: SceneFile) -> tuple[Scene, float]:
    """The scene without light and start, floor at z = 0, and how high the floor was, in metres."""
    name = file.path.stem
    R = Z_FROM_Y_UP if file.up == "y" else np.eye(3)
    vertices = [np.asarray(mesh.vertices, dtype=np.float64) @ R.T for _, mesh in file.named]
    offsets = np.cumsum([0, *(len(v) for v in vertices[:-1])])
    meshes = [mesh for _, mesh in file.named]
    faces = np.concatenate([mesh.faces + at for mesh, at in zip(meshes, offsets, strict=True)])
    owners = np.repeat(np.arange(len(meshes)), [len(mesh.faces) for mesh in meshes])
    looks = [texture_and_uv(mesh) for mesh in meshes]
    points = np.concatenate(vertices)
    if not np.isfinite(points).all():
        raise ValueError(f"scene {name} has vertices that are NaN or infinite")
    floor_m = floor_height(points, faces)
    points[:, 2] -= floor_m
    scene = Scene(
        name=name,
        vertices=points.astype(np.float32),
        faces=faces.astype(np.int32),
        face_object=owners.astype(np.int32),
        face_texture=owners.astype(np.int32),
        face_uv=np.concatenate([uv for _, uv in looks]).astype(np.float32),
        textures=tuple(image for image, _ in looks),
        objects=tuple(SceneObject(file.category(node)) for node, _ in file.named),
        lights=(),
        ambient=AMBIENT,
        rooms=(),
        start=(0.0, 0.0, 0.0),
        names_complete=False,
    )
    return scene, floor_m


def floor_height(vertices: F64, faces: np.ndarray) -> float:
    """Height in metres of the floor among triangles: vertices (V, 3), faces (F, 3)."""
    corners = vertices[faces]
    doubled = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(doubled, axis=1) / 2
    lowest = float(corners[..., 2].min())
    height = corners[..., 2].mean(axis=1)
    level = np.abs(doubled[:, 2]) > 0.98 * 2 * area
    low = level & (area > 0) & (height <= lowest + FLOOR_SEARCH_M)
    if not low.any():
        return lowest
    bins = np.floor((height[low] - lowest) / FLOOR_BIN_M).astype(int)
    areas = np.bincount(bins, weights=area[low])
    # A slab has the same area above and below: of nearly equal levels, the robot is on the upper.
    best = int(np.flatnonzero(areas >= 0.9 * areas.max()).max())
    members = bins == best
    return float(np.average(height[low][members], weights=area[low][members]))
