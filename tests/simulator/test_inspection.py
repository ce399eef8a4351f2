"""What a scene file is understood as, and what speaks against a search in it."""

from __future__ import annotations

from pathlib import Path

import pytest
import trimesh

from onemap_simulator.inspection import SceneInspection, inspect_scene
from onemap_simulator.scene.loading import load_scene
from tests.simulator.scene_files import room_of


def inspected(path: Path) -> SceneInspection:
    return inspect_scene(path, radius_m=0.2, height_m=1.1)


def room(folder: Path, *, yaml: str = "", scale: float = 1.0) -> Path:
    path = folder / "room.glb"
    scene = room_of("y")
    scene.apply_scale(scale)
    path.write_bytes(scene.export(file_type="glb"))
    (folder / "room.yaml").write_text(yaml)
    return path


def test_a_good_room_is_interpreted_as_the_simulator_loads_it(tmp_path: Path) -> None:
    found = inspected(room(tmp_path, yaml="categories: {coffee_table_1: stool}"))
    loaded = load_scene(tmp_path / "room.glb")
    assert found.searchable
    assert found.warnings == ()
    assert found.start == found.scene.start == loaded.start
    assert found.scene.categories == loaded.categories == ("floor", "sofa", "stool")
    assert (found.up, found.up_reason) == ("y", "the glTF standard")
    assert found.floor_m == pytest.approx(0.5)
    low, high = found.extent_m
    assert high[0] - low[0] == pytest.approx(4.0)
    by_name = {node.name: node for node in found.nodes}
    assert by_name["coffee_table_1"].category == "stool"
    assert by_name["coffee_table_1"].from_yaml
    assert not by_name["Sofa-01"].from_yaml
    assert by_name["floor"].triangles == 12


def test_the_reachable_floor_is_the_room_less_the_robots_distance_to_objects(
    tmp_path: Path,
) -> None:
    floor = inspected(room(tmp_path)).floor
    assert floor is not None
    # 3.6 x 3.6 m less what is within 0.2 m of the sofa and of the table in the corner.
    corner = 1.8 - (1.2 - 0.2) + 0.0
    expected = 3.6**2 - (1.4 * 0.9) - corner**2
    assert floor.reachable_m2 == pytest.approx(expected, rel=0.06)


@pytest.mark.parametrize(("scale", "unit"), [(100.0, "centimetres"), (1000.0, "millimetres")])
def test_a_scene_in_another_unit_is_no_room_for_a_robot(
    tmp_path: Path, scale: float, unit: str
) -> None:
    found = inspected(room(tmp_path, scale=scale))
    assert not found.searchable
    assert found.floor is None
    assert unit in found.problems[0]
    with pytest.raises(ValueError, match=unit):
        load_scene(tmp_path / "room.glb")


@pytest.mark.parametrize("start", ["[1.0, 1.0, 0]", "[9, 9, 0]"])
def test_a_start_where_the_robot_does_not_fit_is_a_problem(tmp_path: Path, start: str) -> None:
    found = inspected(room(tmp_path, yaml=f"start: {start}"))
    assert not found.searchable
    assert "cannot stand at the start" in found.problems[0]
    assert found.start_from_yaml


def test_a_scene_without_floor_gets_a_plane_and_a_warning(tmp_path: Path) -> None:
    scene = trimesh.Scene()
    for name, x in (("wall_1", 0.0), ("wall_2", 4.0)):
        wall = trimesh.creation.box((0.1, 4.0, 2.0))
        wall.apply_translation((x, 0, 1.0))
        scene.add_geometry(wall, node_name=name, geom_name=name)
    scene.export(tmp_path / "walls.obj")
    found = inspected(tmp_path / "walls.obj")
    assert found.searchable
    assert "No floor was found" in found.warnings[0]


def test_nodes_without_a_name_are_counted(tmp_path: Path) -> None:
    scene = room_of("y")
    box = trimesh.creation.box((0.2, 0.2, 0.2))
    scene.add_geometry(box, node_name="geometry_7", geom_name="geometry_7")
    (tmp_path / "a.glb").write_bytes(scene.export(file_type="glb"))
    (warning,) = inspected(tmp_path / "a.glb").warnings
    assert warning.startswith("1 of 4 nodes have no name")
    assert "geometry_7" in warning
