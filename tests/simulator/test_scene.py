"""Scenes: read from files, corrected by YAML, and what is free in them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from onemap_shared.grid import GridSpec
from onemap_simulator.physics.collision import MissingFloor
from onemap_simulator.scene import loading
from onemap_simulator.scene.occupancy_raster import rasterise
from onemap_simulator.scene.scene import Scene
from onemap_simulator.scene.scene_file import category_of, read_corrections, read_scene_file
from tests.reference.occupancy_raster import touched_cells
from tests.simulator.scene_files import RED, room_of, write_two_materials
from tests.simulator.scenes import box_room, object_vertices


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
    check_room(loading.load_scene(path))


def test_obj_keeps_its_objects_and_z(tmp_path: Path) -> None:
    room_of("z").export(tmp_path / "room.obj")
    check_room(loading.load_scene(str(tmp_path / "room.obj")))


def test_ply_is_one_object_unless_renamed(tmp_path: Path) -> None:
    mesh = room_of("z").to_geometry()
    mesh.export(tmp_path / "room.ply")
    scene = loading.load_scene(tmp_path / "room.ply")
    assert scene.categories == ("object",)
    used = scene.textures[0].reshape(-1, 3).max(axis=0).astype(int)
    assert np.abs(used - RED[:3]).max() <= 8
    (tmp_path / "room.yaml").write_text("categories: {object: living room}\n")
    assert loading.load_scene(tmp_path / "room.ply").categories == ("living room",)


def test_corrections_rename_and_place(tmp_path: Path) -> None:
    (tmp_path / "room.glb").write_bytes(room_of("y").export(file_type="glb"))
    (tmp_path / "room.yaml").write_text("categories: {Sofa-01: bench}\nstart: [-1, 0.5, 1.57]\n")
    scene = loading.load_scene(tmp_path / "room.glb")
    assert scene.categories == ("bench", "coffee table", "floor")
    assert scene.start == (-1.0, 0.5, 1.57)


def test_a_scene_without_free_floor_asks_for_a_start(tmp_path: Path) -> None:
    trimesh.creation.box((0.4, 0.4, 1.0)).export(tmp_path / "post.ply")
    with pytest.raises(ValueError, match="no free floor"):
        loading.load_scene(tmp_path / "post.ply")
    (tmp_path / "post.yaml").write_text("start: [1, 1, 0]\n")
    scene = loading.load_scene(tmp_path / "post.ply")
    assert scene.lights == ()
    assert scene.ambient[0] > 0


def test_the_floor_is_the_largest_low_level() -> None:
    slab = trimesh.creation.box((4, 4, 0.2))
    cellar = trimesh.creation.box((1, 1, 0.2))
    cellar.apply_translation((0, 0, -0.6))
    both = trimesh.util.concatenate([slab, cellar])
    top_or_bottom = loading.floor_height(np.asarray(both.vertices), np.asarray(both.faces))
    assert top_or_bottom == pytest.approx(0.1)
    wedge = np.array([[0.0, 0, 3], [1, 0, 4], [0, 1, 4]])
    assert loading.floor_height(wedge, np.array([[0, 1, 2]])) == 3.0


def test_the_yaml_names_the_floor_above_a_storey(tmp_path: Path) -> None:
    """A landing of 2 m over a hall of 6 m that lies 3 m lower."""
    landing, hall = trimesh.creation.box((2, 2, 0.2)), trimesh.creation.box((6, 6, 0.2))
    hall.apply_translation((0, 0, -3.0))
    trimesh.util.concatenate([landing, hall]).export(tmp_path / "house.ply")
    assert loading.load_scene(tmp_path / "house.ply").vertices[:, 2].max() == pytest.approx(3.0)
    (tmp_path / "house.yaml").write_text("floor: 0.1\nstart: [0, 0, 0]\n")
    scene = loading.load_scene(tmp_path / "house.ply")
    assert scene.vertices[:, 2].max() == pytest.approx(0.0, abs=1e-6)
    floor = MissingFloor.of(scene, 1.1)
    assert not floor.touches(0.0, 0.0, 0.2)
    assert floor.touches(0.9, 0.0, 0.2)


def test_every_use_of_a_mesh_is_placed_where_the_file_puts_it(tmp_path: Path) -> None:
    scene = trimesh.Scene()
    for index, x in enumerate((0.0, 5.0)):
        shift = trimesh.transformations.translation_matrix((x, 0, 0))
        box = trimesh.creation.box((1, 1, 1))
        scene.add_geometry(box, node_name=f"chair_{index}", geom_name="chair", transform=shift)
    (tmp_path / "chairs.glb").write_bytes(scene.export(file_type="glb"))
    file = read_scene_file(tmp_path / "chairs.glb")
    meshes = [mesh for node in file.nodes for mesh in node.meshes]
    assert sorted(mesh.vertices[:, 0].mean().round(6) for mesh in meshes) == [0, 5]
    assert {file.category(node.name) for node in file.nodes} == {"chair"}


def test_a_node_of_several_materials_is_one_object(tmp_path: Path) -> None:
    write_two_materials(tmp_path, nodes=("Sofa", "Sofa.001"))
    (tmp_path / "model.yaml").write_text("categories: {Sofa: armchair}")
    file = read_scene_file(tmp_path / "model.gltf")
    found = {node.name: (len(node.meshes), node.triangles) for node in file.nodes}
    assert found == {"Sofa": (2, 24), "Sofa.001": (2, 24)}
    assert not file.unknown_nodes


@pytest.mark.parametrize(
    ("name", "yaml", "up"),
    [("a.glb", "", "y"), ("a.obj", "", "z"), ("a.obj", "up: y", "y"), ("a.glb", "up: z", "z")],
)
def test_the_yaml_overrules_the_up_axis_of_the_format(
    tmp_path: Path, name: str, yaml: str, up: str
) -> None:
    trimesh.creation.box((1, 1, 1)).export(tmp_path / name)
    (tmp_path / "a.yaml").write_text(yaml)
    assert read_scene_file(tmp_path / name).up == up


@pytest.mark.parametrize(
    ("name", "category"),
    [
        ("sofa_2", "sofa"),
        ("sofa.003", "sofa"),
        ("Sofa-01", "sofa"),
        ("coffee_table_1", "coffee table"),
        ("CoffeeTable.001", "coffee table"),
        ("  potted  plant ", "potted plant"),
        ("geometry_0", "object"),
        ("42", "object"),
        ("", "object"),
    ],
)
def test_names_become_categories(name: str, category: str) -> None:
    assert category_of(name) == category


PAGE = Path(__file__).parents[2] / "docs" / "scenes.md"


def test_the_example_in_the_documentation_is_read(tmp_path: Path) -> None:
    page = PAGE.read_text(encoding="utf-8")
    (tmp_path / "flat.yaml").write_text(page.partition("```yaml\n")[2].partition("```")[0])
    corrections = read_corrections(tmp_path / "flat.yaml")
    assert corrections.categories == {"geometry_12": "sofa", "Cube.004": "coffee table"}
    assert corrections.start == (1.5, 2.0, 0.0)
    assert corrections.up == "z"
    assert corrections.floor_m == 0.0


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("start: [1, 2", "not valid YAML"),
        ("- 1", "keys and values"),
        ("starts: [1, 2, 3]", "unknown key 'starts'"),
        ("start: [1, 2]", "three numbers"),
        ("start: [1, 2, .nan]", "three numbers"),
        ("up: x", "must be y or z"),
        ("floor: true", "height in metres"),
        ("categories: [sofa]", "must map"),
    ],
)
def test_a_wrong_yaml_is_refused_with_the_reason(tmp_path: Path, text: str, reason: str) -> None:
    (tmp_path / "room.yaml").write_text(text)
    with pytest.raises(ValueError, match=reason) as caught:
        read_corrections(tmp_path / "room.yaml")
    assert "\n" not in str(caught.value)


def test_textures_and_plain_materials(tmp_path: Path) -> None:
    pixels = np.array([[[255, 0, 0], [0, 255, 0]], [[0, 0, 255], [9, 9, 9]]], np.uint8)
    Image.fromarray(pixels).save(tmp_path / "t.png")
    (tmp_path / "a.mtl").write_text(
        "newmtl wood\nKd 1 1 1\nmap_Kd t.png\nnewmtl red\nKd 0.8 0.1 0.1\n"
    )
    corners = "".join(f"v {x} {y} 0\n" for x in (0, 4) for y in (0, 4))
    floor = "vt 0 0\nvt 0 1\nvt 1 0\nvt 1 1\no floor\nusemtl wood\nf 1/1 3/3 4/4\nf 1/1 4/4 2/2\n"
    chair = "v 1 1 .5\nv 2 1 .5\nv 1 2 1\no chair\nusemtl red\nf 5 6 7\n"
    (tmp_path / "a.obj").write_text("mtllib a.mtl\n" + corners + floor + chair)
    scene = loading.load_scene(tmp_path / "a.obj")
    by_name = {
        obj.category: scene.textures[scene.face_texture[scene.face_object == i][0]]
        for i, obj in enumerate(scene.objects)
    }
    np.testing.assert_array_equal(by_name["floor"], pixels)
    assert by_name["chair"][0, 0].tolist() == [204, 26, 26]
    owner = [obj.category for obj in scene.objects].index("floor")
    rows = scene.face_object == owner
    corner = scene.vertices[scene.faces[rows]]
    # The image's last row lies at the texture's v = 0 of the file, where y is 0.
    np.testing.assert_allclose(scene.face_uv[rows][..., 1], 1 - corner[..., 1] / 4, atol=1e-6)


CELL_SIZE_M = 0.1


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10_000), size=st.floats(0.02, 1.5))
def test_every_sampled_point_lies_in_an_occupied_cell(seed: int, size: float) -> None:
    rng = np.random.default_rng(seed)
    triangles = rng.uniform(-1, 1, (3, 1, 3)) + rng.uniform(-size, size, (3, 3, 3))
    spec = GridSpec.covering(CELL_SIZE_M, (-3.0, -3.0), (3.0, 3.0))
    z_range = (-0.4, 0.5)
    occupied = rasterise(triangles, spec, z_range)
    have = {
        (int(x) + spec.origin_cell[0], int(y) + spec.origin_cell[1])
        for x, y in np.argwhere(occupied)
    }
    sampled = touched_cells(triangles, CELL_SIZE_M, z_range, 0.04)
    assert sampled <= have
    # Tight: nothing is set more than a cell away from where a sample is.
    for x, y in have:
        near = {(x + i, y + j) for i in (-1, 0, 1) for j in (-1, 0, 1)}
        assert near & sampled or not sampled


def test_the_start_is_the_roomiest_place_and_faces_the_middle() -> None:
    grid, clearance, _ = loading.free_space(box_room())
    pose = loading.start_pose(grid, clearance)
    assert pose is not None
    cell = grid.cells(np.array(pose[:2]))
    assert clearance[tuple(cell)] == clearance.max()
    middle = grid.centres(np.argwhere(clearance > 0)).mean(axis=0)
    ahead = middle - pose[:2]
    np.testing.assert_allclose(ahead / np.linalg.norm(ahead), (np.cos(pose[2]), np.sin(pose[2])))
    assert loading.start_pose(grid, np.zeros_like(clearance)) is None
