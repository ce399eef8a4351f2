"""The robots of a demo: how many there may be, and what each is configured with."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from onemap_shared.config import PREFIX, read, section
from onemap_simulator.config import SimulatorConfig
from onemap_simulator.generation.apartment import generate_apartment
from onemap_simulator.generation.style import STYLES
from onemap_simulator.physics.collision import CollisionMap
from onemap_simulator.physics.robot import RobotParams
from onemap_simulator.scene.scene import Scene
from onemap_tools.cli.config_report import installed_models
from onemap_tools.demo.robots import (
    MARGIN_M,
    MAX_ROBOTS,
    MIN_APART_M,
    SHARED_RGBD_HZ,
    check_combination,
    further_starts,
)
from onemap_tools.demo.setup import DemoSetup, set_up
from onemap_tools.errors import EXIT_USAGE_ERROR, CliError
from tests.tools.demo.test_setup import options

Pair = tuple[Path, DemoSetup, list[dict[str, Any]]]


def two(folder: Path) -> tuple[DemoSetup, list[dict[str, Any]]]:
    """The setup of two robots, and the sections of their files."""
    setup = set_up(replace(options(folder), robots=2))
    files = [folder / f"{robot.name}-config.yaml" for robot in setup.robots]
    return setup, [yaml.safe_load(file.read_text(encoding="utf-8")) for file in files]


@pytest.fixture(scope="module")
def pair(tmp_path_factory: pytest.TempPathFactory) -> Pair:
    folder = tmp_path_factory.mktemp("pair") / "run"
    return folder, *two(folder)


@pytest.mark.parametrize("robots", [0, -1, MAX_ROBOTS + 1])
def test_a_number_out_of_range_is_refused(robots: int) -> None:
    with pytest.raises(CliError, match=f"--robots is {robots}, .* 1 to {MAX_ROBOTS}") as error:
        check_combination(robots, objects=(), ros2=False)
    assert error.value.exit_code == EXIT_USAGE_ERROR


@pytest.mark.parametrize(
    ("given", "option"),
    [({"ros2": True}, "--ros2"), ({"objects": ("bed",)}, "--objects")],
)
def test_what_is_for_one_robot_is_refused_with_two(given: dict[str, Any], option: str) -> None:
    plain: dict[str, Any] = {"objects": (), "ros2": False}
    with pytest.raises(CliError, match=f"{option} does not fit --robots 2: ") as error:
        check_combination(2, **{**plain, **given})
    assert error.value.exit_code == EXIT_USAGE_ERROR
    check_combination(1, **{**plain, **given})
    check_combination(2, **{**plain, "objects": ("bed", "sofa")})


def test_each_robot_has_its_own_services_and_all_share_the_mapper(pair: Pair) -> None:
    folder, setup, _ = pair
    files = {spec.name: Path(spec.command[-1]).name for spec in setup.specs}
    assert files == {
        "router": "r1-config.yaml",
        "r1-simulator": "r1-config.yaml",
        "r2-simulator": "r2-config.yaml",
        "r1-perception": "r1-config.yaml",
        "r2-perception": "r2-config.yaml",
        "mapper": "r1-config.yaml",
        "r1-planner": "r1-config.yaml",
        "r2-planner": "r2-config.yaml",
        "gateway": "r1-config.yaml",
    }
    assert [spec.name for spec in setup.specs if spec.last] == ["router"]
    assert setup.config_file == folder / "r1-config.yaml"
    assert [setup.url_of(robot) for robot in setup.robots] == [
        "http://127.0.0.1:8123/robots/r1",
        "http://127.0.0.1:8123/robots/r2",
    ]


def test_every_file_is_valid_and_names_the_same_robots(pair: Pair) -> None:
    folder, setup, files = pair
    namespaces = [robot.namespace for robot in setup.robots]
    for robot, sections in zip(setup.robots, files, strict=True):
        read_again = read(folder / f"{robot.name}-config.yaml", environment={})
        for name, model in installed_models().known.items():
            section(read_again, name, model)
        assert sections["bus"] == {"connect": [setup.endpoint], "namespace": robot.namespace}
        assert sections["mapper"]["robots"] == namespaces
        assert list(sections["gateway"]["robots"].values()) == namespaces
    assert files[0]["planner"]["state_dir"] != files[1]["planner"]["state_dir"]
    first, second = (SimulatorConfig(**sections["simulator"]) for sections in files)
    assert first.start != second.start
    assert replace_start(first) == replace_start(second)  # the same apartment


def replace_start(config: SimulatorConfig) -> SimulatorConfig:
    return config.model_copy(update={"start": None})


def test_several_robots_take_fewer_images_unless_told_otherwise(
    pair: Pair, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    _, _, files = pair
    assert {sections["simulator"]["rgbd_hz"] for sections in files} == {SHARED_RGBD_HZ}
    assert SimulatorConfig().rgbd_hz > SHARED_RGBD_HZ
    monkeypatch.setenv(f"{PREFIX}SIMULATOR__RGBD_HZ", "6")
    _, files = two(tmp_path / "told")
    assert {sections["simulator"]["rgbd_hz"] for sections in files} == {6}


def test_a_start_that_is_no_floor_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(f"{PREFIX}SIMULATOR__START", "[-50, -50, 0]")
    with pytest.raises(CliError, match=r"--robots 2 cannot start: simulator\.start") as error:
        two(tmp_path / "run")
    assert error.value.exit_code == EXIT_USAGE_ERROR
    assert not (tmp_path / "run").exists()


ROBOT = RobotParams()


@pytest.fixture(scope="module")
def scene() -> Scene:
    return generate_apartment(2, STYLES["training"])


def test_all_start_apart_on_floor_that_they_can_reach(scene: Scene) -> None:
    starts = (scene.start, *further_starts(scene, ROBOT, MAX_ROBOTS - 1))
    assert len(starts) == MAX_ROBOTS
    for one, other in combinations(starts, 2):
        assert math.dist(one[:2], other[:2]) >= MIN_APART_M
    collision = CollisionMap.of(scene, ROBOT.height_m)
    reachable = collision.reachable_cells(*scene.start[:2], ROBOT.radius_m)
    places = collision.grid.centres(np.argwhere(reachable))
    for x_m, y_m, _ in starts:
        assert collision.clearance_m(x_m, y_m) >= ROBOT.radius_m + MARGIN_M
        assert np.linalg.norm(places - (x_m, y_m), axis=1).min() < collision.grid.cell_size_m


def test_the_second_is_farther_away_than_the_third(scene: Scene) -> None:
    second, third = further_starts(scene, ROBOT, 2)
    here = scene.start[:2]
    assert math.dist(second[:2], here) >= math.dist(third[:2], here)
    assert further_starts(scene, ROBOT, 1) == (second,)


def test_a_floor_that_is_too_small_is_refused(scene: Scene) -> None:
    with pytest.raises(ValueError, match=r"room for \d+ robots that start 1 m apart, not for 501"):
        further_starts(scene, ROBOT, 500)
    walled = replace(scene, start=(-50.0, -50.0, 0.0))  # outside of the apartment
    with pytest.raises(ValueError, match="room for 1 robots"):
        further_starts(walled, ROBOT, 1)
