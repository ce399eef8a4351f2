"""What a demo starts, with which robots, and with which configuration of each."""

from __future__ import annotations

import io
import math
import socket
from dataclasses import replace
from datetime import datetime
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
import yaml
from rich.console import Console

from onemap_perception.config import SHIPPED
from onemap_perception.text.vocabulary import load_vocabulary
from onemap_shared.config import PREFIX, read, section
from onemap_simulator.config import SimulatorConfig
from onemap_simulator.physics.collision import CollisionMap
from onemap_simulator.physics.robot import RobotParams
from onemap_simulator.scene.loading import load_scene
from onemap_tools.cli.config_report import installed_models
from onemap_tools.demo.setup import (
    MARGIN_M,
    MAX_ROBOTS,
    MIN_APART_M,
    PREFERRED_OBJECTS,
    SHARED_RGBD_HZ,
    SIMULATOR,
    DemoOptions,
    DemoSetup,
    choose_objects,
    choose_port,
    further_starts,
    parse_objects,
    run_folder,
    set_up,
)
from onemap_tools.demo.summary import names_of_classes
from onemap_tools.errors import EXIT_USAGE_ERROR, CliError
from onemap_tools.processes.network import LOOPBACK
from onemap_tools.processes.services import CORE
from tests.simulator.test_inspection import room
from tests.structure import ROOT

NOON = datetime(2026, 1, 2, 12, 30, 45)


def options(folder: Path, **changes: Any) -> DemoOptions:
    return replace(DemoOptions(7, None, (), True, 8123, folder, 10.0), **changes)


def sections_of(file: Path) -> dict[str, Any]:
    sections: dict[str, Any] = yaml.safe_load(file.read_text(encoding="utf-8"))
    return sections


@pytest.mark.parametrize("objects", ["", ",", " , "])
def test_a_list_without_names_is_a_usage_error(objects: str) -> None:
    with pytest.raises(CliError, match="which names nothing") as error:
        parse_objects(objects)
    assert error.value.exit_code == EXIT_USAGE_ERROR
    assert parse_objects(None) == ()
    assert parse_objects("bed, teddy bear,") == ("bed", "teddy bear")
    described = "the lamp next to the bed, not in the hall"
    assert parse_objects(f"{described}, then bed") == (described, "bed")
    with pytest.raises(CliError, match="'then' before another object"):  # or not in the bed?
        parse_objects(f"{described}, bed")


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        *(({"robots": n}, rf"--robots is {n}, .* 1 to {MAX_ROBOTS}") for n in (0, MAX_ROBOTS + 1)),
        ({"robots": 2, "ros2": True}, r"--ros2 does not fit --robots 2: "),
        ({"robots": 2, "objects": ("bed",)}, r"--objects does not fit --robots 2: "),
        ({"scene": "flat.glb"}, r"no node is called 'ball'"),
        ({"robots": 2, "start": "[-50, -50, 0]"}, r"simulator\.start \(-50, -50\) is"),
    ],
    ids=str,
)
def test_what_cannot_work_starts_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, changes: dict[str, Any], sentence: str
) -> None:
    monkeypatch.setenv(f"{PREFIX}SIMULATOR__SCENE", str(room(tmp_path)))
    if start := changes.pop("start", None):
        monkeypatch.setenv(f"{PREFIX}SIMULATOR__START", start)
    if "scene" in changes:
        scene = changes["scene"] = tmp_path / changes["scene"]
        trimesh.Scene({"cube": trimesh.creation.box((4, 4, 0.1))}).export(scene)
        scene.with_suffix(".yaml").write_text("categories: {ball: sofa}\n")
    with pytest.raises(CliError, match=sentence) as error:
        set_up(options(tmp_path / "run", **changes))
    assert error.value.exit_code == EXIT_USAGE_ERROR
    assert not (tmp_path / "run").exists()


def test_a_run_never_writes_over_another(tmp_path: Path) -> None:
    first = run_folder(tmp_path, NOON, 3)
    assert first == tmp_path / "20260102-123045-seed3"
    first.mkdir()
    assert run_folder(tmp_path, NOON, 3) == tmp_path / "20260102-123045-seed3-2"


def test_one_robot_runs_with_the_defaults_of_the_services(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Overrides of the environment count once, and never replace what the demo fixes."""
    monkeypatch.setenv(f"{PREFIX}SIMULATOR__RGBD_HZ", "6")
    monkeypatch.setenv(f"{PREFIX}BUS__CONNECT", "[tcp/elsewhere:7447]")
    setup = set_up(options(tmp_path / "run"))
    assert [spec.name for spec in setup.specs] == ["router", SIMULATOR, *CORE]
    assert [spec.name for spec in setup.specs if spec.last] == ["router"]
    assert all(str(setup.config_file) in spec.command for spec in setup.specs)
    assert not [name for name in setup.environment if name.startswith(PREFIX)]
    assert sections_of(setup.config_file) == {
        "simulator": {"rgbd_hz": 6, "seed": 7},
        "bus": {"connect": [setup.endpoint], "namespace": ""},
        "gateway": {"host": LOOPBACK, "port": 8123},
        "mapper": {"map_folder": str(tmp_path / "run/maps")},
        "planner": {"state_dir": str(tmp_path / "run/planner")},
    }
    assert setup.pages == "Live page: http://127.0.0.1:8123"


def two(folder: Path, scene: Path) -> tuple[DemoSetup, list[dict[str, Any]]]:
    """The setup of two robots, and the sections of their files."""
    setup = set_up(options(folder, robots=2, scene=scene))
    return setup, [sections_of(folder / f"{robot.name}-config.yaml") for robot in setup.robots]


def test_each_of_two_robots_has_its_own_services_and_both_share_the_mapper(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "run"
    setup, files = two(folder, room(tmp_path))
    own = {f"{robot}-{name}": f"{robot}-config.yaml" for robot in ("r1", "r2") for name in (
        SIMULATOR, "perception", "planner"
    )}  # fmt: skip
    shared = dict.fromkeys(("router", "mapper", "gateway"), "r1-config.yaml")
    assert {s.name: Path(s.command[-1]).name for s in setup.specs} == own | shared
    assert [spec.name for spec in setup.specs if spec.last] == ["router"]
    assert setup.config_file == folder / "r1-config.yaml"
    url = "http://127.0.0.1:8123/robots"
    assert setup.pages == f"Live pages: r1 {url}/r1/, r2 {url}/r2/"
    namespaces = [robot.namespace for robot in setup.robots]
    for robot, sections in zip(setup.robots, files, strict=True):
        read_again = read(folder / f"{robot.name}-config.yaml", environment={})
        for name, model in installed_models().known.items():
            section(read_again, name, model)
        assert sections["bus"] == {"connect": [setup.endpoint], "namespace": robot.namespace}
        assert sections["mapper"]["robots"] == namespaces
        assert sections["gateway"]["robots"] == dict(zip(("r1", "r2"), namespaces, strict=True))
    assert files[0]["planner"]["state_dir"] != files[1]["planner"]["state_dir"]
    first, second = (SimulatorConfig(**sections["simulator"]) for sections in files)
    assert first.start != second.start
    assert first == second.model_copy(update={"start": first.start})  # the same apartment
    assert first.rgbd_hz == SHARED_RGBD_HZ < SimulatorConfig().rgbd_hz
    monkeypatch.setenv(f"{PREFIX}SIMULATOR__RGBD_HZ", "6")
    _, files = two(tmp_path / "told", tmp_path / "room.glb")
    assert {sections["simulator"]["rgbd_hz"] for sections in files} == {6}


def test_all_start_apart_on_floor_that_they_can_reach(tmp_path: Path) -> None:
    scene, robot = load_scene(room(tmp_path)), RobotParams()
    starts = (scene.start, *further_starts(scene, robot, 2))
    for one, other in combinations(starts, 2):
        assert math.dist(one[:2], other[:2]) >= MIN_APART_M
    collision = CollisionMap.of(scene, robot.height_m)
    reachable = collision.reachable_cells(*scene.start[:2], robot.radius_m)
    places = collision.grid.centres(np.argwhere(reachable))
    for x_m, y_m, _ in starts:
        assert collision.clearance_m(x_m, y_m) >= robot.radius_m + MARGIN_M
        assert np.linalg.norm(places - (x_m, y_m), axis=1).min() < collision.grid.cell_size_m
    first, second, third = (start[:2] for start in starts)
    assert math.dist(second, first) >= math.dist(third, first)
    with pytest.raises(ValueError, match=r"room for \d+ robots that start 1 m apart, not for 501"):
        further_starts(scene, robot, 500)
    walled = replace(scene, start=(-50.0, -50.0, 0.0))  # outside of the room
    with pytest.raises(ValueError, match="room for 1 robots"):
        further_starts(walled, robot, 1)


@pytest.mark.parametrize(
    ("categories", "chosen"),
    [
        (("wall", "floor", "couch", "chair", "sofa"), ("sofa", "chair", "couch")),
        (("floor", "object"), PREFERRED_OBJECTS[:3]),  # a file that names nothing
        (("bed", "cube", "polysurface"), ("bed",)),  # unknown words: the search would be refused
        (("cube", "polysurface"), PREFERRED_OBJECTS[:3]),
        ((), PREFERRED_OBJECTS[:3]),
    ],
)
def test_objects_are_chosen_that_the_scene_has_and_mini_knows(
    categories: tuple[str, ...], chosen: tuple[str, ...]
) -> None:
    known = {name for names in names_of_classes(load_vocabulary(SHIPPED)) for name in names}
    assert choose_objects(categories, known) == chosen


def test_the_next_free_port_is_used_and_reported() -> None:
    console = Console(file=(output := io.StringIO()))
    with socket.create_server((LOOPBACK, 0)) as taken:
        wanted = taken.getsockname()[1]
        port = choose_port(wanted, headless=False, console=console)
    assert port > wanted
    assert f"Port {wanted} is taken" in output.getvalue()


def test_compose_simulates_the_same_apartment() -> None:
    simulator = sections_of(ROOT / "deploy" / "config" / "demo.yaml")["simulator"]
    assert SimulatorConfig(**simulator) == SimulatorConfig()
