"""Make a scene from a user's file: axes, floor, categories, textures, start and lamps."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from onemap_shared.geometry import F64
from onemap_simulator.scene.mesh_texture import texture_and_uv
from onemap_simulator.scene.scene import Scene, SceneObject
from onemap_simulator.scene.scene_file import SceneFile, missing_node, read_scene_file
from onemap_simulator.scene.spawn import ceiling_lamps, free_space, start_pose

AMBIENT = (0.6, 0.6, 0.6)  # bright: unknown rooms may have no place for a lamp
FLOOR_SEARCH_M = 1.0  # the floor lies within this height of the lowest point
FLOOR_BIN_M = 0.02
MAX_WIDTH_M = 200.0  # wider is not in metres, and its floor grid would not fit in memory

# Rotation from glTF's axes (y up) to the map's (z up).
Z_FROM_Y_UP: F64 = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])


def load_scene(path: Path | str) -> Scene:
    """The scene in a file, in metres with z up.

    glTF is turned from y-up; OBJ and PLY are taken as z-up unless the YAML says ``up: y``.
    Everything is shifted vertically so that the floor lies at z = 0: the level within the
    lowest metre with the largest horizontal area, else the lowest point; the YAML's ``floor``
    names it in a scene with a storey below. Node names become
    categories (see ``scene_file``), PLY is one "object"; the YAML's ``categories`` rename nodes.
    Without a ``start`` the robot starts where the largest free floor has most clearance.
    ValueError: a missing, unreadable, empty or unsupported file, one that is wider than 200 m,
    or a wrong YAML.
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


def size_problem(scene: Scene) -> str:
    """Why a scene cannot be in metres, by its width; empty if it can."""
    width_m = float(np.ptp(scene.vertices[:, :2], axis=0).max())
    if width_m <= MAX_WIDTH_M:
        return ""
    unit, factor = ("centimetres", 0.01) if width_m <= 2500 else ("millimetres", 0.001)
    return (
        f"is {width_m:.0f} m wide, more than {MAX_WIDTH_M:.0f} m: its unit looks like {unit}; "
        f"export it in metres, that is scaled by {factor:g}"
    )


def assemble(file: SceneFile) -> tuple[Scene, float]:
    """The scene without lights and start, floor at z = 0; and the floor's height in the file."""
    name = file.path.stem
    R = Z_FROM_Y_UP if file.up == "y" else np.eye(3)
    meshes = [mesh for node in file.nodes for mesh in node.meshes]
    vertices = [np.asarray(mesh.vertices, dtype=np.float64) @ R.T for mesh in meshes]
    offsets = np.cumsum([0, *(len(v) for v in vertices[:-1])])
    faces = np.concatenate([mesh.faces + at for mesh, at in zip(meshes, offsets, strict=True)])
    owners = np.repeat(np.arange(len(file.nodes)), [node.triangles for node in file.nodes])
    materials = np.repeat(np.arange(len(meshes)), [len(mesh.faces) for mesh in meshes])
    looks = [texture_and_uv(mesh) for mesh in meshes]
    points = np.concatenate(vertices)
    if not np.isfinite(points).all():
        raise ValueError(f"scene {name} has vertices that are NaN or infinite")
    given = file.corrections.floor_m
    floor_m = floor_height(points, faces) if given is None else given
    points[:, 2] -= floor_m
    scene = Scene(
        name=name,
        vertices=points.astype(np.float32),
        faces=faces.astype(np.int32),
        face_object=owners.astype(np.int32),
        face_texture=materials.astype(np.int32),
        face_uv=np.concatenate([uv for _, uv in looks]).astype(np.float32),
        textures=tuple(image for image, _ in looks),
        objects=tuple(SceneObject(file.category(node.name)) for node in file.nodes),
        lights=(),
        ambient=AMBIENT,
        rooms=(),
        start=(0.0, 0.0, 0.0),
        names_complete=False,
    )
    return scene, floor_m


def floor_height(vertices: F64, faces: np.ndarray) -> float:
    """Height in metres of the floor of a mesh: vertices (V, 3), faces (F, 3).

    The level with the largest horizontal area within FLOOR_SEARCH_M of the lowest point, else
    the lowest point.
    """
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
    # The top and bottom of a slab have equal areas: of nearly equal levels take the highest.
    best = int(np.flatnonzero(areas >= 0.9 * areas.max()).max())
    members = bins == best
    return float(np.average(height[low][members], weights=area[low][members]))
