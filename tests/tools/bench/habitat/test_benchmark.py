"""From files of episodes to the paper's tables, in a stand-in for Habitat."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from onemap_perception.encoders.mini import SHIPPED
from onemap_tools.bench.habitat import benchmark, habitat_world
from onemap_tools.bench.habitat.benchmark import HabitatOptions, about, run_habitat
from onemap_tools.bench.habitat.choices import SuccessRule
from onemap_tools.bench.habitat.episode_layout import HabitatEpisode
from onemap_tools.bench.habitat.params import HabitatRobotParams
from onemap_tools.bench.lockstep import PerceptionPipeline
from onemap_tools.bench.navigation.choices import Method
from onemap_tools.bench.navigation.records import EpisodeRecord
from onemap_tools.bench.navigation.simulated_detector import (
    SimulatedDetector,
    SimulatedDetectorParams,
)
from onemap_tools.bench.navigation.simulated_features import (
    SimulatedEncoder,
    SimulatedFeatureParams,
)
from tests.simulator.scenes import box_room
from tests.tools.bench.habitat.fake_habitat_sim import FLOOR_Y_M, FakeHabitat
from tests.tools.bench.habitat.fake_world import FakeWorld
from tests.tools.bench.habitat.files import SCENE_V1, multi_object, objectnav, write
from tests.tools.bench.navigation.records import episode, found

CONFIG = "hm3d/hm3d_annotated_basis.scene_dataset_config.json"


@pytest.fixture
def data(tmp_path: Path) -> Path:
    """A folder with episodes, their goals and the names of the scenes' files."""
    for name in (SCENE_V1, CONFIG):
        (tmp_path / "scenes" / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "scenes" / name).touch()
    single = objectnav(SCENE_V1, "sofa", "ball")
    for goals in single["goals_by_category"].values():
        for goal in goals:
            goal["object_id"] = 99  # instances are known by their names
            for view in goal["view_points"]:
                view["agent_state"]["position"] = [-2.3, FLOOR_Y_M, -1.9]
    sequence = multi_object(SCENE_V1, ["sofa", "ball"])
    for each in (*single["episodes"], *sequence["episodes"]):
        each["start_position"] = [-1.0, FLOOR_Y_M, -1.0]
    write(tmp_path / "val" / "content" / "TEEsavR23oF.json.gz", single)
    write(tmp_path / "multi" / "00800-TEEsavR23oF" / "TEEsavR23oF_episodes.json.gz", sequence)
    return tmp_path


class RunWithoutSearch:
    """In place of ``EpisodeRun``: finds everything at once."""

    ran: list[int] = []  # noqa: RUF012 (cleared by each test)

    def __init__(self, ours: HabitatEpisode, *_: Any) -> None:
        self._episode = ours

    def run(self) -> EpisodeRecord:
        self.ran.append(self._episode.index)
        objects = [found(name, 2.0, 4.0) for name in self._episode.objects]
        return replace(episode(self._episode.index, *objects), scene="a scene")


@pytest.fixture
def without_search(monkeypatch: pytest.MonkeyPatch) -> list[FakeWorld]:
    worlds: list[FakeWorld] = []

    def world(_: Any) -> FakeWorld:
        worlds.append(FakeWorld())
        return worlds[-1]

    RunWithoutSearch.ran.clear()
    monkeypatch.setattr(benchmark, "EpisodeRun", RunWithoutSearch)
    monkeypatch.setattr(benchmark, "HabitatWorld", world)
    monkeypatch.setattr(benchmark, "PerceptionPipeline", lambda _: None)
    return worlds


def test_a_killed_run_goes_on_and_writes_the_tables(
    data: Path, without_search: list[FakeWorld]
) -> None:
    options = HabitatOptions(data / "val", data / "scenes")
    out = data / "out"
    told: list[EpisodeRecord] = []
    first = run_habitat(options, out=out, report=told.append)
    assert (len(told), first["episodes"], first["objects_per_episode"]) == (2, 2, 1)
    assert first["features"] == "mini"
    assert first["metrics"]["spl"]["value"] == 0.5
    lines = (out / "episodes.jsonl").read_text().splitlines()
    (out / "episodes.jsonl").write_text(lines[1] + "\n" + lines[0][:40])
    again = run_habitat(options, out=out, report=told.append)
    assert RunWithoutSearch.ran == [0, 1, 0]
    assert {**again, "wall_s": 0} == {**first, "wall_s": 0}
    assert all(world.closed for world in without_search)
    run_habitat(options, out=out, report=told.append)
    assert len(without_search) == 2  # nothing was missing: Habitat was not needed
    table = (out / "tables.md").read_text()
    assert "| **onemap, mini** | 100.0 [100.0, 100.0] | 50.0 [50.0, 50.0] |" in table
    page = (out / "index.html").read_text()
    assert "2 episodes of val with up to 1 objects in Habitat" in page
    assert "a scene, 10 s: sofa found" in page
    assert "<img" not in page
    assert json.loads((out / "results.json").read_text())["benchmark"] == "habitat"


def test_other_options_need_another_folder(data: Path, without_search: list[FakeWorld]) -> None:
    options = HabitatOptions(data / "val", data / "scenes", count=1)
    run_habitat(options, out=data / "out", report=lambda _: None)
    other = replace(options, rule=SuccessRule.HABITAT)
    with pytest.raises(ValueError, match="success 'paper' instead of 'habitat'"):
        run_habitat(other, out=data / "out", report=lambda _: None)
    assert "at most 0.1 m of way" in about(other, 1, 1)


def test_a_method_that_needs_the_simulator_is_refused(data: Path) -> None:
    options = HabitatOptions(data / "val", data / "scenes", method=Method.ORACLE)
    with pytest.raises(ValueError, match="--method oracle runs in generated apartments"):
        run_habitat(options, out=data / "out", report=lambda _: None)


@pytest.mark.slow
def test_a_sequence_runs_from_its_files_to_the_tables(
    data: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = box_room()

    def simulated(config: Any) -> PerceptionPipeline:
        rng = np.random.default_rng(1)
        encoder = SimulatedEncoder(scene, SHIPPED, SimulatedFeatureParams(), rng)
        detector = SimulatedDetector(scene, SimulatedDetectorParams(stray=0.0), 1)
        return PerceptionPipeline(config, encoder=encoder, detector=detector)

    monkeypatch.setattr(habitat_world, "habitat_sim", lambda: FakeHabitat(scene))
    monkeypatch.setattr(benchmark, "PerceptionPipeline", simulated)
    whole, small = HabitatOptions.setup, HabitatRobotParams(width=80, height=80)
    monkeypatch.setattr(HabitatOptions, "setup", lambda asked: replace(whole(asked), robot=small))
    options = HabitatOptions(data / "multi", data / "scenes", goals=data / "val", limit_s=30.0)
    result = run_habitat(options, out=data / "out", report=lambda _: None)
    assert (result["episodes"], result["objects"]) == (1, 2)
    assert result["metrics"]["spl_1"]["value"] > 0.2
    assert "## SPL by position" in (data / "out" / "tables.md").read_text()
