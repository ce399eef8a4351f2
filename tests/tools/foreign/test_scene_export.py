"""An exported scene is what the simulator loads again."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from onemap_shared.geometry import F32
from onemap_simulator.scene.loading import load_scene
from onemap_simulator.scene.scene import Scene
from onemap_tools.foreign.finish import Finish, finished
from onemap_tools.foreign.lit_scene import LitScene, PlacedObject, lit_scene
from onemap_tools.foreign.plain_mesh import block
from onemap_tools.foreign.scene_export import glb
from tests.simulator.scenes import object_vertices

RED, BLUE, GREY = (
    Finish(np.full((8, 8, 3), colour, np.uint8))
    for colour in ((200, 30, 30), (30, 30, 200), (120, 120, 120))
)


def room() -> LitScene:
    """A floor, and a coffee table with a red board on a blue foot."""
    floor = finished(block(4, 4, 0.1, 0.0).at(z=-0.1), GREY)
    foot = finished(block(0.1, 0.1, 0.4, 0.0).at(x=1, y=-1), BLUE)
    board = finished(block(0.6, 0.8, 0.05, 0.0).at(x=1, y=-1, z=0.4), RED)
    objects = [
        PlacedObject("floor", "", (floor,)),
        PlacedObject("coffee table", "", (foot, board)),
    ]
    return lit_scene("s", objects, (), ambient=(0.2, 0.2, 0.2), rooms=(), start=(0, 0, 0))


def test_objects_places_and_colours_come_back(tmp_path: Path) -> None:
    (tmp_path / "room.glb").write_bytes(glb(room()))
    scene = load_scene(tmp_path / "room.glb")
    assert sorted(thing.category for thing in scene.objects) == ["coffee table", "floor"]
    table = [thing.category for thing in scene.objects].index("coffee table")
    points = object_vertices(scene, table)
    np.testing.assert_allclose(points.min(axis=0), [0.7, -1.4, 0.0], atol=1e-5)
    np.testing.assert_allclose(points.max(axis=0), [1.3, -0.6, 0.45], atol=1e-5)
    for z, colour in ((0.0, BLUE.texture[0, 0]), (0.45, RED.texture[0, 0])):
        at = np.isclose(scene.vertices[scene.faces][..., 2], z, atol=1e-5).all(axis=1)
        faces = np.flatnonzero(at & (scene.face_object == table))
        shown = scene.textures[scene.face_texture[faces[0]]].reshape(-1, 3)
        assert np.abs(shown.astype(int) - colour).max() < 12


def corner_places(scene: Scene) -> F32:
    """The texture coordinates (3 F, 2) of all corners, faces ordered by where they lie."""
    order = np.lexsort(scene.vertices[scene.faces].mean(axis=1).round(3).T)
    places: F32 = scene.face_uv[order].reshape(-1, 2)
    return places


def test_each_corner_keeps_its_place_in_the_texture(tmp_path: Path) -> None:
    lit = room()
    (tmp_path / "room.glb").write_bytes(glb(lit))
    loaded = load_scene(tmp_path / "room.glb")
    np.testing.assert_allclose(corner_places(loaded), corner_places(lit.scene), atol=1e-4)
