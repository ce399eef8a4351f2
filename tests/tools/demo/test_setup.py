"""What a demo starts, and with which configuration."""

from __future__ import annotations

import io
import socket
from datetime import datetime
from pathlib import Path

import pytest
import trimesh
import yaml
from rich.console import Console

from onemap_perception.encoders.mini import SHIPPED
from onemap_perception.text.vocabulary import load_vocabulary
from onemap_shared.config import PREFIX
from onemap_simulator.config import SimulatorConfig
from onemap_tools.demo.setup import (
    PREFERRED_OBJECTS,
    ROS2_ROBOT,
    SIMULATOR,
    DemoOptions,
    choose_objects,
    choose_port,
    demo_sections,
    parse_objects,
    run_folder,
    set_up,
)
from onemap_tools.demo.truth import vocabulary_names
from onemap_tools.errors import EXIT_USAGE_ERROR, CliError
from onemap_tools.processes.network import LOOPBACK
from onemap_tools.processes.services import CORE
from tests.structure import ROOT

KNOWN = vocabulary_names(load_vocabulary(SHIPPED))
NOON = datetime(2026, 1, 2, 12, 30, 45)


def options(folder: Path, *, scene: Path | None = None, ros2: bool = False) -> DemoOptions:
    return DemoOptions(
        seed=7,
        scene=scene,
        objects=(),
        headless=True,
        port=8123,
        folder=folder,
        time_limit_s=10.0,
        ros2=ros2,
    )


@pytest.mark.parametrize("objects", ["", ",", " , "])
def test_a_list_without_names_is_a_usage_error(objects: str) -> None:
    with pytest.raises(CliError, match="which names nothing") as error:
        parse_objects(objects)
    assert error.value.exit_code == EXIT_USAGE_ERROR
    assert parse_objects(None) == ()
    assert parse_objects("bed, teddy bear,") == ("bed", "teddy bear")


def test_a_scene_that_cannot_be_opened_starts_nothing(tmp_path: Path) -> None:
    scene = tmp_path / "flat.glb"
    trimesh.Scene({"cube": trimesh.creation.box((4, 4, 0.1))}).export(scene)
    scene.with_suffix(".yaml").write_text("categories: {ball: sofa}\n")
    with pytest.raises(CliError, match="no node is called 'ball'") as error:
        set_up(options(tmp_path / "run", scene=scene))
    assert error.value.exit_code == EXIT_USAGE_ERROR
    assert not (tmp_path / "run").exists()


def test_a_run_never_writes_over_another(tmp_path: Path) -> None:
    first = run_folder(tmp_path, NOON, 3)
    assert first == tmp_path / "20260102-123045-seed3"
    first.mkdir()
    assert run_folder(tmp_path, NOON, 3) == tmp_path / "20260102-123045-seed3-2"


def test_the_router_is_stopped_last_and_all_read_one_file(tmp_path: Path) -> None:
    setup = set_up(options(tmp_path / "run"))
    assert [spec.name for spec in setup.specs] == ["router", SIMULATOR, *CORE]
    assert [spec.name for spec in setup.specs if spec.last] == ["router"]
    assert all(str(setup.config_file) in spec.command for spec in setup.specs)
    sections = yaml.safe_load(setup.config_file.read_text())
    assert sections["bus"]["connect"] == [setup.endpoint]
    assert sections["gateway"]["port"] == 8123
    assert sections["simulator"]["seed"] == 7


def test_a_robot_of_ros_2_is_two_processes_on_the_same_router(tmp_path: Path) -> None:
    setup = set_up(options(tmp_path / "run", ros2=True))
    assert [spec.name for spec in setup.specs] == ["router", ROS2_ROBOT, "ros2", *CORE]
    sections = yaml.safe_load(setup.config_file.read_text())
    assert sections["ros2"]["connect"] == [setup.endpoint]
    assert setup.environment["ONEMAP_DEMO_ROUTER"] == setup.endpoint
    assert sections["simulator"]["seed"] == 7


def test_overrides_count_once_and_never_replace_fixed_values(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(f"{PREFIX}SIMULATOR__RGBD_HZ", "6")
    monkeypatch.setenv(f"{PREFIX}BUS__CONNECT", "[tcp/elsewhere:7447]")
    setup = set_up(options(tmp_path / "run"))
    sections = yaml.safe_load(setup.config_file.read_text())
    assert sections["simulator"]["rgbd_hz"] == 6
    assert sections["bus"]["connect"] == [setup.endpoint]
    assert not [name for name in setup.environment if name.startswith(PREFIX)]


def test_other_objects_of_the_scene_follow() -> None:
    assert choose_objects(("wall", "floor", "couch", "chair", "sofa"), KNOWN) == (
        ("sofa", "chair", "couch")
    )
    assert choose_objects((), KNOWN) == PREFERRED_OBJECTS[:3]
    assert (
        choose_objects(("floor", "object"), KNOWN) == PREFERRED_OBJECTS[:3]
    )  # a file that names nothing


def test_unknown_words_are_not_chosen() -> None:
    """The planner would reject the whole search."""
    assert choose_objects(("bed", "cube", "polysurface"), KNOWN) == ("bed",)
    assert choose_objects(("cube", "polysurface"), KNOWN) == PREFERRED_OBJECTS[:3]


def test_the_next_free_port_is_used_and_reported() -> None:
    console = Console(file=io.StringIO())
    with socket.socket() as taken:
        taken.bind((LOOPBACK, 0))
        taken.listen()
        wanted = taken.getsockname()[1]
        port = choose_port(wanted, headless=False, console=console)
    assert port > wanted
    assert isinstance(console.file, io.StringIO)
    assert f"Port {wanted} is taken" in console.file.getvalue()


def test_the_demo_runs_with_the_defaults_of_the_services(tmp_path: Path) -> None:
    sections = demo_sections({}, options(tmp_path), "tcp/127.0.0.1:1")
    assert {name: set(keys) for name, keys in sections.items()} == {
        "bus": {"connect", "namespace"},
        "gateway": {"host", "port"},
        "simulator": {"seed"},
        "mapper": {"map_folder"},
        "planner": {"state_dir"},
    }


def test_compose_simulates_the_same_apartment() -> None:
    config = ROOT / "deploy" / "config" / "demo.yaml"
    simulator = yaml.safe_load(config.read_text())["simulator"]
    assert SimulatorConfig(**simulator) == SimulatorConfig()
