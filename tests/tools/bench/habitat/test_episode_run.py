"""An episode in a stand-in for Habitat, from the start to the verdict."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from onemap_perception.encoders.mini import SHIPPED
from onemap_shared.messages import SearchState
from onemap_tools.bench.habitat import habitat_world
from onemap_tools.bench.habitat.choices import SuccessRule
from onemap_tools.bench.habitat.coordinates import habitat_rotation
from onemap_tools.bench.habitat.episode_layout import CategoryGoals, HabitatEpisode
from onemap_tools.bench.habitat.episode_run import (
    EpisodeRun,
    FloorHeights,
    HabitatSetup,
    unjudged,
    word_of,
)
from onemap_tools.bench.habitat.habitat_world import HabitatWorld
from onemap_tools.bench.habitat.params import HabitatRobotParams
from onemap_tools.bench.lockstep import PerceptionPipeline, SystemConfig
from onemap_tools.bench.navigation.choices import Method
from onemap_tools.bench.navigation.episode_run import not_sought
from onemap_tools.bench.navigation.records import EpisodeRecord, Failure
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

CAMERA = HabitatRobotParams(width=80, height=80)
SCENE = "hm3d/val/00000-Room/Room.basis.glb"
# The sofa stands at x 2.5 to 3.2 and y 2.0 to 2.8 of the room; places before it, y up.
VIEW_POINTS = np.array([[-2.3, FLOOR_Y_M, -1.9], [-1.6, FLOOR_Y_M, -2.6]])


@pytest.fixture
def setup(tmp_path: Path) -> HabitatSetup:
    for name in (SCENE, "hm3d/annotations.json"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
    config = SystemConfig.read(None, 1, "training")
    return HabitatSetup(config, Method.ONEMAP, SuccessRule.PAPER, tmp_path, 40.0, CAMERA)


def run(
    setup: HabitatSetup, monkeypatch: pytest.MonkeyPatch, *objects: str, yaw: float = 0.0
) -> EpisodeRecord:
    scene = box_room()
    monkeypatch.setattr(habitat_world, "habitat_sim", lambda: FakeHabitat(scene))
    rng = np.random.default_rng(1)
    encoder = SimulatedEncoder(scene, SHIPPED, SimulatedFeatureParams(), rng)
    detector = SimulatedDetector(scene, SimulatedDetectorParams(stray=0.0), 1)
    perception = PerceptionPipeline(setup.config.perception, encoder=encoder, detector=detector)
    start = (-1.0, FLOOR_Y_M, -1.0)
    rotation = habitat_rotation(yaw)
    episode = HabitatEpisode(4, SCENE, "hm3d/annotations.json", start, rotation, objects)
    goals = {
        ("Room.basis.glb", name): CategoryGoals(frozenset({ids}), VIEW_POINTS)
        for name, ids in (("sofa", 4), ("tv_monitor", 5))
    }
    return EpisodeRun(episode, goals, HabitatWorld(CAMERA), setup, perception).run()


@pytest.mark.slow
@pytest.mark.parametrize("yaw", [0.0, 2.5])
def test_a_sofa_is_found_where_habitat_has_it(
    setup: HabitatSetup, monkeypatch: pytest.MonkeyPatch, yaw: float
) -> None:
    record = run(setup, monkeypatch, "sofa", yaw=yaw)
    assert record.start == pytest.approx((1.0, 1.0, yaw))
    assert (record.index, record.scene) == (4, "Room.basis episode 4")
    (sofa,) = record.objects
    assert (sofa.success, sofa.failure, sofa.goal_distance_m) == (True, Failure.NONE, 0.0)
    shortest = np.linalg.norm(VIEW_POINTS - [-1.0, FLOOR_Y_M, -1.0], axis=1).min()
    assert sofa.shortest_path_m == pytest.approx(shortest, abs=0.01)
    assert sofa.in_view >= sofa.detected > 0
    assert record.contacts == 0
    assert record.trajectory[0] == pytest.approx((1.0, 1.0))


@pytest.mark.slow
def test_an_episode_repeats_itself_and_ends_in_time(
    setup: HabitatSetup, monkeypatch: pytest.MonkeyPatch
) -> None:
    short = replace(setup, limit_s=4.0)
    first, second = (run(short, monkeypatch, "tv_monitor", "sofa") for _ in range(2))
    assert first == second
    assert [item.name for item in first.objects] == ["television", "sofa"]
    assert first.objects[0].timed_out
    assert first.simulated_s < 10.0


def test_categories_become_english_words() -> None:
    words = [word_of(name) for name in ("chair", "tv_monitor", "plant", "chest_of_drawers")]
    assert words == ["chair", "television", "potted plant", "chest of drawers"]


def test_what_was_not_sought_has_no_length() -> None:
    summary = unjudged(not_sought("bed"))
    assert (summary.outcome, summary.success) == (SearchState.NOT_FOUND.value, False)
    assert not np.isfinite([summary.shortest_path_m, summary.goal_distance_m]).any()


def test_heights_are_those_of_the_first_and_last_frame() -> None:
    heights = FloorHeights()
    for index, z_m in ((0, 0.0), (0, 0.1), (1, 0.2)):
        heights.add(index, z_m)
    assert (heights.first, heights.last) == ({0: 0.0, 1: 0.2}, {0: 0.1, 1: 0.2})


def test_the_system_has_the_frame_rate_and_the_method_s_planner(setup: HabitatSetup) -> None:
    system = replace(setup, method=Method.NEAREST_FRONTIER).system
    assert system.simulator.rgbd_hz == 4.0
    assert system.planner.explore.object_limit_s == 40.0
