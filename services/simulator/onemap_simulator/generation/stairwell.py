"""Stairwells: openings in the floor of a finished scene, with the shaft below them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from onemap_shared.geometry import F64, I64
from onemap_simulator.generation.mesh import Mesh, box_between
from onemap_simulator.scene.scene import Scene

DEPTH_M = 3.0  # to the floor below: a storey
SLAB_M = 0.02  # of floors and of the shaft's walls

Opening = tuple[float, float, float, float]  # x_min, y_min, x_max, y_max in metres


def with_stairwell(scene: Scene, opening_m: Opening) -> Scene:
    """The scene with an opening in its floor, walls below its edges and a floor 3 m lower.

    Raises ValueError if no floor holds the opening; floors are boxes whose top is at z = 0.
    """
    index = floor_around(scene, opening_m)
    if index is None:
        raise ValueError(f"scene {scene.name} has no floor around the opening {opening_m}")
    keep = scene.face_object != index
    meshes = _slabs(_corners(scene, index), opening_m)
    counts = np.cumsum([len(scene.vertices), *(len(mesh.vertices) for mesh in meshes)])
    faces = [mesh.faces + first for mesh, first in zip(meshes, counts[:-1], strict=True)]
    count = sum(map(len, faces))
    texture = scene.face_texture[~keep][0]
    uv = np.concatenate([mesh.uv for mesh in meshes]) * _texture_scale(scene, index)
    vertices = np.concatenate([scene.vertices, *(mesh.vertices for mesh in meshes)])
    return replace(
        scene,
        vertices=vertices.astype(np.float32),
        faces=np.concatenate([scene.faces[keep], *faces]).astype(np.int32),
        face_object=np.append(scene.face_object[keep], np.full(count, index)).astype(np.int32),
        face_texture=np.append(scene.face_texture[keep], np.full(count, texture)).astype(np.int32),
        face_uv=np.concatenate([scene.face_uv[keep], uv]).astype(np.float32),
    )


def floor_around(scene: Scene, opening_m: Opening, margin_m: float = 0.0) -> int | None:
    """Index of the whole floor that holds the opening and a margin; None without one."""
    lower, upper = np.array(opening_m[:2]) - margin_m, np.array(opening_m[2:]) + margin_m
    for index, thing in enumerate(scene.objects):
        if thing.category != "floor":
            continue
        corners = _corners(scene, index)
        low, high = corners.min(axis=0), corners.max(axis=0)
        whole = low[2] > -DEPTH_M  # has no stairwell yet
        if whole and (low[:2] < lower).all() and (upper < high[:2]).all():
            return index
    return None


def _corners(scene: Scene, index: int) -> F64:
    """Corners (N, 3) in metres of an object's triangles."""
    faces: I64 = scene.faces[scene.face_object == index]
    return scene.vertices[faces].reshape(-1, 3).astype(np.float64)


def _slabs(floor: F64, opening_m: Opening) -> list[Mesh]:
    """What is left of the floor around the opening, the walls of the shaft, and its bottom."""
    (x_low, y_low, _), (x_high, y_high, _) = floor.min(axis=0).tolist(), floor.max(axis=0).tolist()
    x0, y0, x1, y1 = opening_m
    left, right, front, back = x0 - SLAB_M, x1 + SLAB_M, y0 - SLAB_M, y1 + SLAB_M
    top, bottom = -SLAB_M, -DEPTH_M
    return [
        box_between((x_low, y_low, top), (x0, y_high, 0.0)),
        box_between((x1, y_low, top), (x_high, y_high, 0.0)),
        box_between((x0, y_low, top), (x1, y0, 0.0)),
        box_between((x0, y1, top), (x1, y_high, 0.0)),
        box_between((left, front, bottom), (x0, back, top)),
        box_between((x1, front, bottom), (right, back, top)),
        box_between((x0, front, bottom), (x1, y0, top)),
        box_between((x0, y1, bottom), (x1, back, top)),
        box_between((left, front, bottom - SLAB_M), (right, back, bottom)),
    ]


def _texture_scale(scene: Scene, index: int) -> float:
    """Texture coordinates per metre of an object that is a box."""
    mine = scene.face_object == index
    texture = np.ptp(scene.face_uv[mine].reshape(-1, 2), axis=0).max()
    return float(texture / np.ptp(_corners(scene, index)[:, :2], axis=0).max())
