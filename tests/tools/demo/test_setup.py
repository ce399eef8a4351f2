"""What a demo starts, and with which configuration."""

from __future__ import annotations

import io
import socket
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import Any

import pytest
import trimesh
import yaml
from rich.console import Console

from onemap_perception.config import SHIPPED
from onemap_perception.text.vocabulary import load_vocabulary
from onemap_shared.config import PREFIX
from onemap_simulator.config import SimulatorConfig
from onemap_tools.demo.run import names_of_classes
from onemap_tools.demo.setup import (
    PREFERRED_OBJECTS,
    SIMULATOR,
    DemoOptions,
    choose_objects,
    choose_port,
    parse_objects,
    run_folder,
    set_up,
)
from onemap_tools.errors import EXIT_USAGE_ERROR, CliError
from onemap_tools.processes.network import LOOPBACK
from onemap_tools.processes.services import CORE
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


def test_what_cannot_work_starts_nothing(tmp_path: Path) -> None:
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
    assert setup.url == "http://127.0.0.1:8123"


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
