"""Habitat-Sim behind ``World``, with a stand-in that has its interface."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from onemap_tools.bench.habitat import habitat_world
from onemap_tools.bench.habitat.coordinates import habitat_rotation
from onemap_tools.bench.habitat.habitat_world import HabitatWorld
from onemap_tools.bench.habitat.params import HabitatRobotParams
from tests.simulator.scenes import box_room
from tests.tools.bench.habitat.fake_habitat_sim import FLOOR_Y_M, FakeHabitat

PARAMS = HabitatRobotParams(width=40, height=30)
START = (-1.0, FLOOR_Y_M, -1.0)  # of the room seen from above: 1 m from two walls


@pytest.fixture
def habitat(monkeypatch: pytest.MonkeyPatch) -> FakeHabitat:
    fake = FakeHabitat(box_room())
    monkeypatch.setattr(habitat_world, "habitat_sim", lambda: fake)
    return fake


@pytest.fixture
def files(tmp_path: Path) -> tuple[Path, Path]:
    scene, config = tmp_path / "a.basis.glb", tmp_path / "c.json"
    scene.touch()
    config.touch()
    return scene, config


@pytest.fixture
def world(habitat: FakeHabitat, files: tuple[Path, Path]) -> HabitatWorld:
    opened = HabitatWorld(PARAMS)
    opened.open(*files)
    opened.place(START, habitat_rotation(0.0))
    return opened


def test_without_habitat_it_is_said_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(name: str) -> Any:
        raise ImportError(f"No module named {name!r}")

    monkeypatch.setattr(importlib, "import_module", missing)
    with pytest.raises(ValueError, match=r"No module named 'habitat_sim'.*MIT licence.*Matterport"):
        HabitatWorld(PARAMS)
    monkeypatch.setattr(importlib, "import_module", lambda name: name)
    assert habitat_world.habitat_sim() == "habitat_sim"


def test_sensors_and_body_are_those_of_the_parameters(
    world: HabitatWorld, habitat: FakeHabitat, files: tuple[Path, Path]
) -> None:
    (simulator,) = habitat.made
    backend, (agent,) = simulator.configuration.backend, simulator.configuration.agents
    assert (backend.scene_id, backend.scene_dataset_config_file) == tuple(map(str, files))
    assert backend.allow_sliding is False
    assert (agent.radius, agent.height) == (0.18, 0.88)
    assert [(each.uuid, each.sensor_type) for each in agent.sensor_specifications] == [
        ("color", "c"),
        ("depth", "d"),
        ("semantic", "s"),
    ]
    assert agent.sensor_specifications[1].resolution == [30, 40]
    np.testing.assert_array_equal(agent.sensor_specifications[1].position, [0, 0.88, 0])


def test_a_scene_is_loaded_once_and_the_one_before_is_unloaded(
    world: HabitatWorld, habitat: FakeHabitat, files: tuple[Path, Path]
) -> None:
    world.open(*files)
    assert len(habitat.made) == 1
    other = files[0].with_name("b.basis.glb")
    other.touch()
    world.open(other, files[1])
    assert [each.closed for each in habitat.made] == [True, False]
    world.close()
    assert habitat.made[1].closed


def test_what_cannot_be_opened_is_said_in_a_sentence(
    habitat: FakeHabitat, files: tuple[Path, Path]
) -> None:
    world = HabitatWorld(PARAMS)
    with pytest.raises(ValueError, match=r"there is no .*absent\.glb, the scene: --scenes is"):
        world.open(files[0].with_name("absent.glb"), files[1])
    with pytest.raises(ValueError, match="the annotations of the scenes"):
        world.open(files[0], files[1].with_name("absent.json"))
    habitat.has_mesh = False
    with pytest.raises(ValueError, match="has no navigation mesh beside it"):
        world.open(*files)
    assert habitat.made[0].closed


def test_it_moves_as_far_as_the_floor_allows(world: HabitatWorld) -> None:
    ahead = (-1.0, FLOOR_Y_M, -1.4)
    assert world.move(ahead, habitat_rotation(0.7)) == pytest.approx(ahead)
    position, rotation = world.pose
    assert position == pytest.approx(ahead)
    assert rotation == pytest.approx(habitat_rotation(0.7))
    x, _, z = world.move((-1.0, FLOOR_Y_M, -9.0), habitat_rotation(0.0))
    assert -3.9 < z < -3.0
    assert x == pytest.approx(-1.0)


def test_it_sees_what_is_before_it(world: HabitatWorld) -> None:
    image = world.capture()
    assert image.rgb.shape == (30, 40, 3)
    assert image.rgb.dtype == np.uint8
    assert image.depth_m[15, 20] == pytest.approx(3.0, abs=0.1)  # the wall 3 m ahead
    sofa = np.argwhere(image.semantic_ids == 4)
    assert len(sofa)
    assert sofa[:, 1].mean() < 20  # left, as the scene has it


@pytest.mark.parametrize("methods", [True, False])
def test_boxes_have_y_up(habitat: FakeHabitat, files: tuple[Path, Path], *, methods: bool) -> None:
    habitat.methods = methods
    world = HabitatWorld(PARAMS)
    world.open(*files)
    (sofa,) = (box for box in world.boxes() if box.category == "sofa")
    assert sofa.semantic_id == 4
    np.testing.assert_allclose(sofa.lower, [-2.8, FLOOR_Y_M, -3.2], atol=1e-6)
    np.testing.assert_allclose(sofa.upper, [-2.0, FLOOR_Y_M + 0.8, -2.5], atol=1e-6)


def test_paths_lead_to_the_nearest_place_or_nowhere(world: HabitatWorld) -> None:
    places = np.array([[-1.0, FLOOR_Y_M, -3.0], [-1.0, FLOOR_Y_M, -1.5]])
    assert world.path_m(START, places) == pytest.approx(0.5)
    assert world.path_m(START, places + 1000) == float("inf")
