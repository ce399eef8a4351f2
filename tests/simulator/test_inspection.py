"""What a scene file is understood as, and what speaks against a search in it."""

from __future__ import annotations

from pathlib import Path

import pytest
import trimesh

from onemap_shared.runner import StartError
from onemap_simulator.config import SimulatorConfig
from onemap_simulator.scene.loading import load_scene
from onemap_simulator.service import build
from tests.memory_bus import MemoryRouter
from tests.simulator.scene_files import room_of


def warnings(path: Path) -> tuple[str, ...]:
    return load_scene(path).warnings


def room(folder: Path, *, yaml: str = "", scale: float = 1.0) -> Path:
    path = folder / "room.glb"
    scene = room_of("y")
    scene.apply_scale(scale)
    path.write_bytes(scene.export(file_type="glb"))
    (folder / "room.yaml").write_text(yaml)
    return path


def test_a_good_room_has_no_warnings(tmp_path: Path) -> None:
    assert warnings(room(tmp_path, yaml="categories: {coffee_table_1: stool}")) == ()


@pytest.mark.parametrize(("scale", "unit"), [(100.0, "centimetres"), (1000.0, "millimetres")])
def test_a_scene_in_another_unit_is_no_room_for_a_robot(
    tmp_path: Path, scale: float, unit: str
) -> None:
    with pytest.raises(ValueError, match=unit):
        warnings(room(tmp_path, scale=scale))


@pytest.mark.parametrize("start", ["[1.0, 1.0, 0]", "[9, 9, 0]"])
def test_a_start_where_the_robot_does_not_fit_is_a_problem(tmp_path: Path, start: str) -> None:
    path = room(tmp_path, yaml=f"start: {start}")
    with pytest.raises(
        StartError, match=r"the start of scene .* \(set by room\.yaml\) .* needs 0\.2 m"
    ):
        build(MemoryRouter().bus("simulator"), SimulatorConfig(scene=str(path)))


def test_a_scene_without_floor_gets_a_plane_and_a_warning(tmp_path: Path) -> None:
    scene = trimesh.Scene()
    for name, x in (("wall_1", 0.0), ("wall_2", 4.0)):
        wall = trimesh.creation.box((0.1, 4.0, 2.0))
        wall.apply_translation((x, 0, 1.0))
        scene.add_geometry(wall, node_name=name, geom_name=name)
    scene.export(tmp_path / "walls.obj")
    assert "No floor was found" in warnings(tmp_path / "walls.obj")[0]


def test_nodes_without_a_name_are_counted(tmp_path: Path) -> None:
    scene = room_of("y")
    box = trimesh.creation.box((0.2, 0.2, 0.2))
    scene.add_geometry(box, node_name="geometry_7", geom_name="geometry_7")
    (tmp_path / "a.glb").write_bytes(scene.export(file_type="glb"))
    (warning,) = warnings(tmp_path / "a.glb")
    assert warning.startswith("1 of 4 nodes have no name")
    assert "geometry_7" in warning
