"""A scene: textured triangles that belong to named objects, and lights.

Made by the generator or a file loader, read by the renderer and the collision
map. Frame: map, z up, metres, the floor at z = 0.
"""

from __future__ import annotations

from dataclasses import dataclass

from onemap_shared.geometry import F32, I32, U8

STRUCTURE = frozenset({"floor", "wall", "ceiling", "door", "window"})
UNNAMED = "object"  # category of nodes whose name describes nothing


@dataclass(frozen=True, slots=True)
class SceneObject:
    """A named object. ``room`` is the kind of its room, empty in a scene without rooms."""

    category: str
    room: str = ""


@dataclass(frozen=True, slots=True)
class Room:
    """An axis-aligned room: kind (kitchen, ...) and x_min, y_min, x_max, y_max in metres."""

    kind: str
    bounds_m: tuple[float, float, float, float]


@dataclass(frozen=True, slots=True)
class PointLight:
    """A point light: position (3,) in metres, RGB intensity (3,)."""

    position_m: tuple[float, float, float]
    colour: tuple[float, float, float]


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """All triangles of a scene.

    vertices (V, 3) float32 metres; faces (F, 3) int32; face_object (F,) int32 index into
    ``objects``; face_texture (F,) int32 index into ``textures``; face_uv (F, 3, 2) float32
    texture coordinates of the corners, repeating outside [0, 1), v = 0 at the image's first
    row. textures: (h, w, 3) uint8 RGB each, albedo. ``start`` is x, y, yaw of the robot.
    ``names_complete``: whether every object is named, so that an absent name is an absent object.
    ``warnings``: what may be wrong with a user's file although a robot can drive in it.
    """

    name: str
    vertices: F32
    faces: I32
    face_object: I32
    face_texture: I32
    face_uv: F32
    textures: tuple[U8, ...]
    objects: tuple[SceneObject, ...]
    lights: tuple[PointLight, ...]
    ambient: tuple[float, float, float]
    rooms: tuple[Room, ...]
    start: tuple[float, float, float]
    names_complete: bool = True
    warnings: tuple[str, ...] = ()

    @property
    def categories(self) -> tuple[str, ...]:
        """All category names in the scene, sorted."""
        return tuple(sorted({obj.category for obj in self.objects}))
