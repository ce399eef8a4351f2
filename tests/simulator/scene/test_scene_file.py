from __future__ import annotations

from pathlib import Path

import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from onemap_simulator.scene.scene_file import category_of, check_file, read_scene_file
from tests.simulator.scene.files import write_two_materials


def test_bad_files_are_refused_with_the_reason(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="does not exist"):
        read_scene_file(tmp_path / "nowhere.glb")
    with pytest.raises(ValueError, match=r"suffix '\.stl'"):
        read_scene_file(tmp_path / "room.stl")
    (tmp_path / "broken.glb").write_bytes(b"not a scene at all")
    with pytest.raises(ValueError, match="cannot be read"):
        read_scene_file(tmp_path / "broken.glb")
    (tmp_path / "empty.obj").write_text("# nothing\n")
    with pytest.raises(ValueError, match=r"empty\.obj"):
        read_scene_file(tmp_path / "empty.obj")


def test_obj_groups_stand_for_objects(tmp_path: Path) -> None:
    corners = "".join(f"v {x} {y} 0\n" for x in (0, 4) for y in (0, 4))
    lamp = "v 1 1 .5\nv 2 1 .5\nv 1 2 1\ng lamp.001\nf 5 6 7\n"
    (tmp_path / "a.obj").write_text(corners + "g floor\nf 1 3 4\nf 1 4 2\n" + lamp)
    file = read_scene_file(tmp_path / "a.obj")
    assert {file.category(node.name) for node in file.nodes} == {"floor", "lamp"}


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


def test_a_check_reads_the_yaml_and_not_the_scene(tmp_path: Path) -> None:
    (tmp_path / "broken.glb").write_bytes(b"not a scene at all")
    (tmp_path / "broken.yaml").write_text("up: z")
    assert check_file(tmp_path / "broken.glb").up == "z"


@pytest.mark.parametrize(
    ("name", "category"),
    [
        ("sofa_2", "sofa"),
        ("sofa.003", "sofa"),
        ("Sofa-01", "sofa"),
        ("coffee_table_1", "coffee table"),
        ("CoffeeTable.001", "coffee table"),
        ("chair_1_2", "chair"),
        ("  potted  plant ", "potted plant"),
        ("chair_1_", "chair"),
        ("geometry_0", "object"),
        ("42", "object"),
        ("0.", "object"),
        ("", "object"),
    ],
)
def test_names_become_categories(name: str, category: str) -> None:
    assert category_of(name) == category


@given(st.text(max_size=40))
def test_any_name_gives_a_settled_category(name: str) -> None:
    category = category_of(name)
    assert category
    assert category_of(category) == category
