"""Openings on the ways of an episode: away from its start, with a way around each."""

from __future__ import annotations

from dataclasses import replace
from functools import cache, reduce
from math import isfinite

import numpy as np
import pytest

from onemap_simulator.config import SimulatorConfig
from onemap_simulator.generation.apartment import generate_apartment
from onemap_simulator.generation.stairwell import Opening, with_stairwell
from onemap_simulator.ground_truth.truth import SceneTruth
from onemap_simulator.parts import scene_truth
from onemap_simulator.physics.collision import CollisionMap
from onemap_simulator.scene.scene import Scene
from onemap_tools.bench.lockstep import SystemConfig
from onemap_tools.bench.navigation.choices import Features, Method
from onemap_tools.bench.navigation.episode_run import EpisodeSetup, run_episode
from onemap_tools.bench.navigation.episodes import NavigationEpisode, draw_episode
from onemap_tools.bench.navigation.stairwells import FROM_START_M, draw_openings

SEEDS = (2, 8, 26)


@cache
def drawn(seed: int) -> tuple[Scene, SceneTruth, NavigationEpisode, tuple[Opening, ...]]:
    config = SimulatorConfig(seed=seed)
    scene, robot = generate_apartment(seed), config.robot
    truth = scene_truth(scene, config)
    episode = draw_episode(
        scene, truth, seed=seed, objects=3, radius_m=robot.radius_m, height_m=robot.height_m
    )
    return scene, truth, episode, draw_openings(scene, truth, episode, config, 2)


@pytest.mark.slow
@pytest.mark.parametrize("seed", SEEDS)
def test_every_object_can_still_be_reached(seed: int) -> None:
    scene, truth, episode, openings = drawn(seed)
    assert openings
    opened = scene_truth(reduce(with_stairwell, openings, scene), SimulatorConfig(seed=seed))
    for name in episode.objects:
        before = truth.distances(name, *episode.start[:2]).path_m
        after = opened.distances(name, *episode.start[:2]).path_m
        assert isfinite(after)
        assert after >= before - 1e-6


@pytest.mark.slow
@pytest.mark.parametrize("seed", SEEDS)
def test_openings_are_on_bare_floor_away_from_the_start(seed: int) -> None:
    scene, _, episode, openings = drawn(seed)
    clearance = CollisionMap.of(scene, SimulatorConfig().robot.height_m)
    for x0, y0, x1, y1 in openings:
        corners = np.array([(x, y) for x in (x0, x1) for y in (y0, y1)])
        outside = np.maximum(np.maximum((x0, y0) - np.array(episode.start[:2]), 0), 0)
        beyond = np.maximum(np.array(episode.start[:2]) - (x1, y1), 0)
        assert np.hypot(*(outside + beyond)) >= FROM_START_M
        assert all(clearance.clearance_m(x, y) > 0 for x, y in corners)


@pytest.mark.slow
def test_the_same_seed_draws_the_same_openings() -> None:
    scene, truth, episode, openings = drawn(8)
    config = SimulatorConfig(seed=8)
    assert draw_openings(scene, truth, episode, config, 2) == openings
    assert draw_openings(scene, truth, episode, config, 1) == openings[:1]
    assert draw_openings(scene, truth, episode, config, 0) == ()


@pytest.mark.slow
def test_an_episode_records_its_stairwells() -> None:
    sections = SystemConfig.read(None, 2, "training")
    setup = EpisodeSetup(
        0, sections, Method.ORACLE, Features.SIMULATED, objects=3, limit_s=60.0, stairwells=2
    )
    record, plain = run_episode(setup), run_episode(replace(setup, stairwells=0))
    assert len(record.stairwells) == len(drawn(2)[3]) > 0
    assert (record.start, [item.name for item in record.objects]) == (
        plain.start,
        [item.name for item in plain.objects],
    )
    assert not plain.stairwells
    ways = [sum(item.path_length_m for item in each.objects) for each in (record, plain)]
    assert ways[0] > ways[1]
