"""Scenes from files: round trips through every format, corrections, and scenes without floor."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from onemap_simulator.generation.apartment import generate_apartment
from onemap_simulator.physics.missing_floor import MissingFloor
from onemap_simulator.scene.loading import assemble, floor_height, load_scene
from onemap_simulator.scene.scene import Scene
from onemap_simulator.scene.scene_file import read_scene_file
from tests.simulator.scene.files import RED, room_of, write_two_materials
from tests.simulator.scenes import object_vertices


def extent(scene: Scene, category: str) -> np.ndarray:
    index = next(i for i, obj in enumerate(scene.objects) if obj.category == category)
    points = object_vertices(scene, index)
    return np.stack([points.min(axis=0), points.max(axis=0)])


def check_room(scene: Scene) -> None:
    assert scene.categories == ("coffee table", "floor", "sofa")
    np.testing.assert_allclose(extent(scene, "sofa"), [[0.5, 0.75, 0], [1.5, 1.25, 0.6]], atol=1e-5)
    np.testing.assert_allclose(extent(scene, "floor")[1, 2], 0.0, atol=1e-5)
    x, y, _ = scene.start
    assert max(abs(x), abs(y)) < 1.7
    for category in ("sofa", "coffee table"):
        low, high = extent(scene, category)[:, :2]
        assert np.linalg.norm(np.maximum(np.maximum(low - (x, y), (x, y) - high), 0)) > 0.25
    assert scene.lights
    for texture in scene.textures:
        colours = texture.reshape(-1, 3)
        assert np.abs(colours.astype(int) - RED[:3]).max() <= 8


@pytest.mark.parametrize("suffix", ["glb", "GLB"])
def test_glb_is_turned_upright(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"room.{suffix}"
    path.write_bytes(room_of("y").export(file_type="glb"))
    check_room(load_scene(path))


def test_a_file_does_not_claim_to_name_everything(tmp_path: Path) -> None:
    (tmp_path / "room.glb").write_bytes(room_of("y").export(file_type="glb"))
    assert not load_scene(tmp_path / "room.glb").names_complete
    assert generate_apartment(1).names_complete


def test_gltf_with_separate_buffers(tmp_path: Path) -> None:
    for name, data in room_of("y").export(file_type="gltf").items():
        (tmp_path / name).write_bytes(data)
    check_room(load_scene(tmp_path / "model.gltf"))


def test_each_material_of_a_node_keeps_its_colour(tmp_path: Path) -> None:
    file = read_scene_file(write_two_materials(tmp_path, nodes=("Sofa-1", "Sofa-2")))
    scene, _ = assemble(file)
    assert [thing.category for thing in scene.objects] == ["sofa", "sofa"]
    for thing in (0, 1):
        used = np.unique(scene.face_texture[scene.face_object == thing])
        blue = sorted(bool(t[0, 0, 2] > t[0, 0, 0]) for t in (scene.textures[i] for i in used))
        assert blue == [False, True]


def test_obj_keeps_its_objects_and_z(tmp_path: Path) -> None:
    room_of("z").export(tmp_path / "room.obj")
    check_room(load_scene(str(tmp_path / "room.obj")))


def test_obj_turned_by_the_yaml(tmp_path: Path) -> None:
    room_of("y").export(tmp_path / "room.obj")
    (tmp_path / "room.yaml").write_text("up: y\n")
    check_room(load_scene(tmp_path / "room.obj"))


def test_ply_is_one_object_unless_renamed(tmp_path: Path) -> None:
    mesh = room_of("z").to_geometry()
    mesh.export(tmp_path / "room.ply")
    scene = load_scene(tmp_path / "room.ply")
    assert scene.categories == ("object",)
    used = scene.textures[0].reshape(-1, 3).max(axis=0).astype(int)
    assert np.abs(used - RED[:3]).max() <= 8
    (tmp_path / "room.yaml").write_text("categories: {object: living room}\n")
    assert load_scene(tmp_path / "room.ply").categories == ("living room",)


def test_corrections_rename_and_place(tmp_path: Path) -> None:
    (tmp_path / "room.glb").write_bytes(room_of("y").export(file_type="glb"))
    (tmp_path / "room.yaml").write_text("categories: {Sofa-01: bench}\nstart: [-1, 0.5, 1.57]\n")
    scene = load_scene(tmp_path / "room.glb")
    assert scene.categories == ("bench", "coffee table", "floor")
    assert scene.start == (-1.0, 0.5, 1.57)


def test_a_correction_of_a_node_that_does_not_exist_is_refused(tmp_path: Path) -> None:
    (tmp_path / "room.glb").write_bytes(room_of("y").export(file_type="glb"))
    (tmp_path / "room.yaml").write_text("categories: {divan: sofa}\n")
    with pytest.raises(ValueError, match="no node is called 'divan'"):
        load_scene(tmp_path / "room.glb")


def test_a_scene_without_free_floor_asks_for_a_start(tmp_path: Path) -> None:
    trimesh.creation.box((0.4, 0.4, 1.0)).export(tmp_path / "post.ply")
    with pytest.raises(ValueError, match="no free floor"):
        load_scene(tmp_path / "post.ply")
    (tmp_path / "post.yaml").write_text("start: [1, 1, 0]\n")
    scene = load_scene(tmp_path / "post.ply")
    assert scene.lights == ()
    assert scene.ambient[0] > 0


def test_the_floor_is_the_largest_low_level() -> None:
    slab = trimesh.creation.box((4, 4, 0.2))
    cellar = trimesh.creation.box((1, 1, 0.2))
    cellar.apply_translation((0, 0, -0.6))
    both = trimesh.util.concatenate([slab, cellar])
    top_or_bottom = floor_height(np.asarray(both.vertices), np.asarray(both.faces))
    assert top_or_bottom == pytest.approx(0.1)
    wedge = np.array([[0.0, 0, 3], [1, 0, 4], [0, 1, 4]])
    assert floor_height(wedge, np.array([[0, 1, 2]])) == 3.0


def test_the_yaml_names_the_floor_above_a_storey(tmp_path: Path) -> None:
    """A landing of 2 m over a hall of 6 m that lies 3 m lower."""
    landing, hall = trimesh.creation.box((2, 2, 0.2)), trimesh.creation.box((6, 6, 0.2))
    hall.apply_translation((0, 0, -3.0))
    trimesh.util.concatenate([landing, hall]).export(tmp_path / "house.ply")
    assert load_scene(tmp_path / "house.ply").vertices[:, 2].max() == pytest.approx(3.0)
    (tmp_path / "house.yaml").write_text("floor: 0.1\nstart: [0, 0, 0]\n")
    scene = load_scene(tmp_path / "house.ply")
    assert scene.vertices[:, 2].max() == pytest.approx(0.0, abs=1e-6)
    floor = MissingFloor.of(scene, 1.1)
    assert not floor.touches(0.0, 0.0, 0.2)
    assert floor.touches(0.9, 0.0, 0.2)
