"""Tiny scenes for the simulator's tests."""

from __future__ import annotations

import numpy as np

from onemap_shared.geometry import F32
from onemap_simulator.scene.scene import PointLight, Room, Scene, SceneObject

_CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
_SIDES = {
    "x-": (0, 1, 3, 2),
    "x+": (4, 6, 7, 5),
    "y-": (0, 4, 5, 1),
    "y+": (2, 3, 7, 6),
    "z-": (0, 2, 6, 4),
    "z+": (1, 5, 7, 3),
}
_QUAD_UV = np.array([[[0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1]]], np.float32)


class SceneBuilder:
    """Collects boxes and quads into a Scene."""

    def __init__(self) -> None:
        self.vertices: list[np.ndarray] = []
        self.faces: list[tuple[int, int, int]] = []
        self.face_object: list[int] = []
        self.objects: list[SceneObject] = []
        self.textures: list[np.ndarray] = []

    def add(
        self,
        category: str,
        lower: tuple[float, float, float],
        upper: tuple[float, float, float],
        *,
        sides: tuple[str, ...] = tuple(_SIDES),
        texture: np.ndarray | None = None,
    ) -> SceneBuilder:
        """An axis-aligned box, or some of its sides."""
        first = 8 * len(self.vertices)
        low, high = np.array(lower), np.array(upper)
        self.vertices.append(low + _CORNERS * (high - low))
        for side in sides:
            a, b, c, d = (first + k for k in _SIDES[side])
            self.faces += [(a, b, c), (a, c, d)]
            self.face_object += [len(self.objects)] * 2
        self.objects.append(SceneObject(category))
        grey = 60 + 37 * len(self.objects) % 180
        plain = np.full((2, 2, 3), (grey, 255 - grey, 140), np.uint8)
        self.textures.append(plain if texture is None else texture)
        return self

    def build(
        self,
        *,
        lights: tuple[PointLight, ...] = (PointLight((2.0, 1.5, 2.2), (1.0, 0.95, 0.9)),),
        start: tuple[float, float, float] = (1.0, 1.0, 0.0),
        rooms: tuple[Room, ...] = (),
    ) -> Scene:
        face_object = np.array(self.face_object, np.int32)
        return Scene(
            name="boxes",
            vertices=np.concatenate(self.vertices).astype(np.float32),
            faces=np.array(self.faces, np.int32),
            face_object=face_object,
            face_texture=face_object.copy(),
            face_uv=np.tile(_QUAD_UV, (len(self.faces) // 2, 1, 1)),
            textures=tuple(self.textures),
            objects=tuple(self.objects),
            lights=lights,
            ambient=(0.4, 0.4, 0.4),
            rooms=rooms,
            start=start,
        )


def object_vertices(scene: Scene, index: int) -> F32:
    """Vertices (N, 3) of an object's triangles, with repeats."""
    corners: F32 = scene.vertices[scene.faces[scene.face_object == index]].reshape(-1, 3)
    return corners


WALL_SIDES = ("x-", "x+", "y-", "y+")


def box_room() -> Scene:
    """A room of 4 x 3 x 2.5 m; seen along x, a red sofa is left and a green ball right."""
    red = np.full((2, 2, 3), (200, 30, 30), np.uint8)
    green = np.full((2, 2, 3), (30, 200, 30), np.uint8)
    builder = SceneBuilder()
    builder.add("floor", (0, 0, 0), (4, 3, 2.5), sides=("z-",))
    builder.add("ceiling", (0, 0, 0), (4, 3, 2.5), sides=("z+",))
    builder.add("wall", (0, 0, 0), (4, 3, 2.5), sides=WALL_SIDES)
    builder.add("sofa", (2.5, 2.0, 0), (3.2, 2.8, 0.8), texture=red)
    builder.add("ball", (2.6, 0.3, 0), (2.9, 0.6, 0.3), texture=green)
    return builder.build(rooms=(Room("living room", (0, 0, 4, 3)),))
