"""Which apartments, and what is drawn in one."""

from __future__ import annotations

from dataclasses import replace

import pytest

from onemap_simulator.ground_truth.truth import SceneTruth
from onemap_simulator.physics.collision import CollisionMap
from onemap_simulator.scene.scene import Scene
from onemap_tools.bench.navigation.choices import Apartments
from onemap_tools.bench.navigation.episodes import (
    GOALS,
    MIN_WAY_M,
    NavigationEpisode,
    apartment_seeds,
    draw_episode,
)
from onemap_tools.bench.navigation.oracle import oracle_objects
from onemap_tools.bench.navigation.records import Failure
from tests.simulator.scenes import WALL_SIDES, SceneBuilder


def room() -> Scene:
    """8 x 4 m with a bed and a desk at opposite ends, a cup, and a toilet behind a wall."""
    builder = SceneBuilder().add("floor", (0, 0, 0), (10, 4, 2.5), sides=("z-", *WALL_SIDES))
    builder.add("wall", (7.9, 0, 0), (8.1, 4, 2.5))
    builder.add("bed", (0.2, 0.2, 0), (1.2, 2.0, 0.5))
    builder.add("desk", (7.0, 0.2, 0), (7.8, 1.2, 0.7))
    builder.add("chair", (6.2, 0.4, 0), (6.6, 0.8, 0.9))  # beside the desk: never after it
    builder.add("cup", (7.2, 0.4, 0.7), (7.3, 0.5, 0.8))
    builder.add("toilet", (9.2, 0.2, 0), (9.8, 0.8, 0.5))
    return replace(builder.build(), start=(4.0, 2.0, 0.0))


def truth_of(scene: Scene) -> SceneTruth:
    return SceneTruth(scene, radius_m=0.2, height_m=1.1, eye_height_m=1.0)


def draw(scene: Scene, seed: int, objects: int) -> NavigationEpisode:
    return draw_episode(
        scene, truth_of(scene), seed=seed, objects=objects, radius_m=0.2, height_m=1.1
    )


def test_even_and_odd_seeds_share_no_apartment() -> None:
    assert apartment_seeds(3, 3, Apartments.ALL) == (3, 4, 5)
    assert apartment_seeds(3, 3, Apartments.EVEN) == (4, 6, 8)
    assert apartment_seeds(3, 3, Apartments.ODD) == (3, 5, 7)
    assert apartment_seeds(4, 2, Apartments.ODD) == (5, 7)


def test_objects_are_distinct_reachable_goals_and_the_start_is_free() -> None:
    scene = room()
    truth, collision = truth_of(scene), CollisionMap.of(scene, 1.1)
    drawn = [draw(scene, seed, 2) for seed in range(6)]
    for episode in drawn:
        assert "bed" in episode.objects  # the toilet has no way to it
        assert set(episode.objects) < {"bed", "desk", "chair"} < GOALS
        x, y, _ = episode.start
        assert collision.clearance_m(x, y) > 0.2
        assert truth.distances(episode.objects[0], x, y).path_m >= MIN_WAY_M
        assert truth.least_way_m(*episode.objects) >= MIN_WAY_M
    assert len({episode.start for episode in drawn}) == 6
    assert drawn[0] == draw(scene, 0, 2)


def test_too_few_objects_are_said_in_a_sentence() -> None:
    with pytest.raises(
        ValueError, match="has 2 kinds of object that can be reached one after the other, not 4"
    ):
        draw(room(), 1, 4)


def test_the_oracle_drives_the_shortest_paths_one_after_the_other() -> None:
    truth = truth_of(room())
    episode = NavigationEpisode(1, ("desk", "bed", "toilet"), (4.0, 2.0, 0.0))
    (desk, bed, toilet), trajectory = oracle_objects(truth, episode, 0.5)
    assert (desk.success, desk.spl, bed.spl) == (True, 1.0, 1.0)
    assert 1.0 < desk.path_length_m < 2.5 < bed.path_length_m < 7.0
    assert desk.time_s == pytest.approx(desk.path_length_m / 0.5)
    assert trajectory[0] == (4.0, 2.0)
    assert min(x for x, _ in trajectory) < 3.0
    assert max(x for x, _ in trajectory) > 5.0
    assert (toilet.success, toilet.failure) == (False, Failure.NEVER_IN_VIEW)
