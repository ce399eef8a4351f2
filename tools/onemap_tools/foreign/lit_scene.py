"""A scene with what the simulator's has no place for: smooth normals, finishes, area lights."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from onemap_shared.geometry import F32, F64
from onemap_simulator.scene.scene import Room, Scene, SceneObject
from onemap_tools.foreign.finish import Finish, FinishedPart
from onemap_tools.foreign.plain_mesh import PlainMesh

CREASE_COS = 0.6  # faces that meet at a sharper angle than 53 degrees keep their edge


@dataclass(frozen=True, slots=True)
class AreaLight:
    """A light of a size: middle (3,) metres, half its width (3,) along the axes, RGB strength.

    facing: unit normal (3,) of a light that shines to one side, None for all sides.
    """

    position_m: tuple[float, float, float]
    half_m: tuple[float, float, float]
    colour: tuple[float, float, float]
    facing: tuple[float, float, float] | None = None


@dataclass(frozen=True, slots=True, eq=False)
class PlacedObject:
    """Parts in map coordinates that belong to one object of a category in a kind of room."""

    category: str
    room: str
    parts: tuple[FinishedPart, ...]


@dataclass(frozen=True, slots=True, eq=False)
class LitScene:
    """scene: geometry, labels and textures; corner_normals (F, 3, 3) float32 unit.

    finishes: one per texture of the scene. ambient: linear RGB of light from everywhere.
    """

    scene: Scene
    corner_normals: F32
    finishes: tuple[Finish, ...]
    lights: tuple[AreaLight, ...]
    ambient: tuple[float, float, float]


def lit_scene(
    name: str,
    objects: Sequence[PlacedObject],
    lights: Sequence[AreaLight],
    *,
    ambient: tuple[float, float, float],
    rooms: tuple[Room, ...],
    start: tuple[float, float, float],
) -> LitScene:
    """All objects as one scene; each part keeps a texture of its own."""
    parts = [part for thing in objects for part in thing.parts]
    owners = [index for index, thing in enumerate(objects) for _ in thing.parts]
    counts = [len(part.mesh.faces) for part in parts]
    offsets = np.cumsum([0, *(len(part.mesh.vertices) for part in parts[:-1])])
    faces = [part.mesh.faces + offset for part, offset in zip(parts, offsets, strict=True)]
    scene = Scene(
        name=name,
        vertices=np.concatenate([part.mesh.vertices for part in parts]).astype(np.float32),
        faces=np.concatenate(faces).astype(np.int32),
        face_object=np.repeat(owners, counts).astype(np.int32),
        face_texture=np.repeat(np.arange(len(parts)), counts).astype(np.int32),
        face_uv=np.concatenate([part.uv for part in parts]).astype(np.float32),
        textures=tuple(part.finish.texture for part in parts),
        objects=tuple(SceneObject(thing.category, thing.room) for thing in objects),
        lights=(),
        ambient=(0.6, 0.6, 0.6),
        rooms=rooms,
        start=start,
    )
    normals = np.concatenate([corner_normals(part.mesh) for part in parts]).astype(np.float32)
    return LitScene(scene, normals, tuple(part.finish for part in parts), tuple(lights), ambient)


def corner_normals(mesh: PlainMesh) -> F64:
    """Unit normals (F, 3, 3): smooth over round surfaces, the face's own at creases."""
    corners = mesh.vertices[mesh.faces]
    weighted = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    total = np.zeros_like(mesh.vertices)
    for corner in range(3):
        np.add.at(total, mesh.faces[:, corner], weighted)
    smooth = _unit(total)[mesh.faces]
    flat = np.broadcast_to(_unit(weighted)[:, None], smooth.shape)
    crease = (smooth * flat).sum(axis=-1, keepdims=True) < CREASE_COS
    return np.where(crease, flat, smooth)


def _unit(vectors: F64) -> F64:
    unit: F64 = vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-12)
    return unit
