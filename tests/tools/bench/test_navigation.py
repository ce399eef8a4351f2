"""The navigation benchmark: episodes, a run that goes on, comparisons, and what errors change."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from math import inf, isfinite
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from onemap_shared.geometry import pose_2d
from onemap_shared.messages import ObjectResult, SearchState
from onemap_simulator.config import SimulatorConfig
from onemap_simulator.generation.apartment import generate_apartment
from onemap_simulator.ground_truth.truth import SceneTruth
from onemap_simulator.physics.collision import CollisionMap
from onemap_simulator.physics.robot import RobotParams
from onemap_simulator.scene.occupancy_raster import occupied_cells
from onemap_simulator.scene.scene import Scene
from onemap_tools.bench.navigation import benchmark, drawing
from onemap_tools.bench.navigation.benchmark import run, setups
from onemap_tools.bench.navigation.episode import (
    EpisodeSetup,
    failure_of,
    oracle_objects,
    run_episode,
    true_results,
)
from onemap_tools.bench.navigation.results import Failure, table_lines
from onemap_tools.bench.navigation.search import SearchEnd
from onemap_tools.bench.options import MethodName, NavigationBench
from onemap_tools.judgement import ObjectSummary
from tests.simulator.scenes import WALL_SIDES, SceneBuilder
from tests.tools.processes.pickling_pool import PicklingPool

OPTIONS = NavigationBench(method="oracle", episodes=3, apartments="odd", objects_per_episode=2)
FOUND = ObjectSummary("bed", "found", "", (1.0, 2.0, 0.4), 10.0, 8.0, 4.0, 1.0, 0.0, "bed")
MISSED = replace(FOUND, outcome="not_found", goal_distance_m=inf)
LATE = replace(MISSED, outcome="failed", reason="not found within 300 s, the limit for one object")


APARTMENT = cache(generate_apartment)  # each takes two seconds, and nobody writes into one


CELLS: dict[tuple[int, tuple[float, ...]], tuple[Scene, Any]] = {}


def cells_once(scene: Scene, *sizes_m: float) -> Any:
    """As ``occupied_cells``, which takes most of an episode's time, but once of each scene."""
    key = (id(scene), sizes_m)
    if key not in CELLS:
        CELLS[key] = (scene, occupied_cells(scene, *sizes_m))  # kept with it: the id stays its own
    return CELLS[key][1]


@pytest.fixture(autouse=True)
def _apartments_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("onemap_tools.bench.navigation.episode.generate_apartment", APARTMENT)
    monkeypatch.setattr("onemap_simulator.physics.collision.occupied_cells", cells_once)


def setup(method: MethodName, limit_s: float = 20.0, **changes: Any) -> EpisodeSetup:
    options = replace(OPTIONS, method=method, limit=limit_s, seed=2, apartments="all", **changes)
    return setups(options)[0]


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


def test_the_options_name_every_episode() -> None:
    options = replace(OPTIONS, method="onemap", errors="people", stairwells=2)
    made = setups(options)
    assert [each.config.simulator.seed for each in made] == [1, 3, 5]
    assert [each.index for each in made] == [0, 1, 2]
    assert {each.config.simulator.errors for each in made} == {"people"}
    assert {each.options for each in made} == {options}
    assert drawing.apartment_seeds(3, 3, "all") == (3, 4, 5)
    assert drawing.apartment_seeds(3, 3, "even") == (4, 6, 8)
    assert drawing.apartment_seeds(4, 2, "odd") == (5, 7)


def test_objects_are_distinct_reachable_goals_and_the_start_is_free() -> None:
    scene = room()
    truth, collision = truth_of(scene), CollisionMap.of(scene, 1.1)

    def draw(seed: int, objects: int) -> drawing.NavigationEpisode:
        robot = RobotParams(radius_m=0.2)
        return drawing.draw_episode(scene, truth, SimulatorConfig(seed=seed, robot=robot), objects)

    drawn = [draw(seed, 2) for seed in range(6)]
    for each in drawn:
        assert "bed" in each.objects  # the toilet has no way to it
        assert set(each.objects) < {"bed", "desk", "chair"} < drawing.GOALS
        x, y, _ = each.start
        assert collision.clearance_m(x, y) > 0.2
        assert truth.path_m(each.objects[0], x, y) >= drawing.MIN_WAY_M
        assert truth.least_way_m(*each.objects) >= drawing.MIN_WAY_M
    assert len({each.start for each in drawn}) == 6
    assert drawn[0] == draw(0, 2)
    with pytest.raises(ValueError, match="has 2 kinds of object that can be reached one after"):
        draw(1, 4)


def test_the_oracle_drives_the_shortest_paths_one_after_the_other() -> None:
    drawn = drawing.NavigationEpisode(("desk", "bed", "toilet"), (4.0, 2.0, 0.0))
    (desk, bed, toilet), trajectory = oracle_objects(truth_of(room()), drawn, 0.5)
    assert (desk.success, desk.spl, bed.spl) == (True, 1.0, 1.0)
    assert 1.0 < desk.path_length_m < 2.5 < bed.path_length_m < 7.0
    assert desk.time_s == pytest.approx(desk.path_length_m / 0.5, abs=1e-3)
    assert trajectory[0] == (4.0, 2.0)
    assert min(x for x, _ in trajectory) < 3.0
    assert max(x for x, _ in trajectory) > 5.0
    assert (toilet.success, toilet.failure) == (False, Failure.NEVER_IN_VIEW)


@pytest.mark.parametrize(
    ("judged", "in_view", "detected", "failure"),
    [
        (FOUND, 5, 5, Failure.NONE),
        (replace(FOUND, goal_distance_m=0.5), 5, 5, Failure.STOPPED_SHORT),
        (replace(FOUND, goal_distance_m=5.0, nearest="sofa"), 5, 5, Failure.WRONG_OBJECT),
        (replace(MISSED, outcome="failed", reason="the robot is stuck"), 5, 5, Failure.STUCK),
        (LATE, 0, 0, Failure.NEVER_IN_VIEW),
        (MISSED, 5, 0, Failure.NOT_DETECTED),
        (MISSED, 5, 2, Failure.NOT_ACCEPTED),
    ],
)
def test_a_failure_has_one_reason(
    judged: ObjectSummary, in_view: int, detected: int, failure: Failure
) -> None:
    assert failure_of(judged, in_view, detected) is failure


def test_results_are_judged_at_true_places() -> None:
    bed = ObjectResult(
        "bed", SearchState.FOUND, "", (3.0, 1.0, 0.4), 0.5, 9.0, 4.0, (1.0, 1.0), (2.0, 1.0)
    )
    sofa = replace(bed, name="sofa", start_xy_m=(2.0, 1.0), end_xy_m=(2.0, 3.0), position_m=())
    ends = [
        SearchEnd(pose_2d(2.0, 1.0, 0.0), pose_2d(2.5, 1.0, 0.0)),
        SearchEnd(pose_2d(2.0, 3.0, 0.0), pose_2d(2.0, 3.0, np.pi / 2)),
    ]
    first, second = true_results((bed, sofa), ends)
    assert first.start_xy_m == (1.0, 1.0)
    assert first.end_xy_m == pytest.approx((2.5, 1.0))
    assert first.position_m == pytest.approx((3.5, 1.0, 0.4))
    assert second.start_xy_m == pytest.approx((2.5, 1.0))  # where the first ended
    assert second.position_m == ()


@pytest.mark.slow
def test_a_run_goes_on_where_it_was_killed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(benchmark, "worker_pool", PicklingPool)  # starts at once
    told: list[str] = []
    options = replace(OPTIONS, episodes=2, objects_per_episode=1, out=tmp_path)
    first = run(options, told.append)
    assert [len(told), first["episodes"], first["metrics"]["spl"]["value"]] == [2, 2, 1.0]
    file = tmp_path / "episodes.jsonl"
    file.write_text(file.read_text()[:-40])
    second = run(options, told.append)
    assert len(told) == 3  # the other was finished
    assert "found, SPL 1.00" in told[-1]
    for result in (first, second):
        del result["wall_s"]
        for each in result["results"]:
            del each["wall_s"]
    assert first == second
    assert json.loads((tmp_path / "results.json").read_text())["episodes"] == 2
    with pytest.raises(ValueError, match="episodes 2 instead of 4"):
        run(replace(options, episodes=4), told.append)
    same = run(replace(options, beside=[tmp_path]), told.append)
    compared = same["compared_with"]["oracle"]["compared"]["spl"]
    assert compared == {"value": 1.0, "low": 1.0, "high": 1.0}
    assert any(line.startswith("spl over that of oracle ") for line in table_lines(same))


@pytest.mark.slow
def test_an_episode_with_every_error_repeats_itself_and_counts_them() -> None:
    first, second = (run_episode(setup("onemap", 3.0, errors="all")) for _ in range(2))
    assert 0 < first.planning_p50_ms <= first.planning_p95_ms
    first, second = (replace(e, planning_p50_ms=0, planning_p95_ms=0) for e in (first, second))
    assert first == second
    assert first.frames_lost > 0
    assert first.pose_error_m > 0  # rounded to millimetres
    assert len(first.trajectory) < 4 * first.simulated_s


@pytest.mark.slow
@pytest.mark.parametrize(
    ("method", "changes"),
    [
        ("onemap", {"features": "mini"}),
        ("onemap_reset", {}),
        ("onemap_no_consensus", {"features": "uncalibrated"}),
        ("vlfm", {}),
        ("nearest_frontier", {}),
    ],
)
def test_every_method_and_kind_of_features_runs_an_episode(
    method: MethodName, changes: dict[str, Any]
) -> None:
    record = run_episode(setup(method, 2.0, **changes))
    assert len(record.objects) == 2
    assert len(record.trajectory) == pytest.approx(4 * record.simulated_s, abs=2)
    assert record.trajectory[0] == pytest.approx(record.start[:2], abs=0.01)
    assert all(0 < iou <= 1 for iou in record.room_ious)


@pytest.mark.slow
def test_stairwells_are_away_from_the_start_and_leave_a_way_to_every_object() -> None:
    opened, plain = (run_episode(setup("oracle", stairwells=wells)) for wells in (2, 0))
    assert len(opened.stairwells) > len(plain.stairwells) == 0
    assert opened.start == plain.start
    before, after = (
        [item.shortest_path_m or inf for item in each.objects] for each in (plain, opened)
    )
    assert isfinite(sum(after))
    assert after[0] >= before[0] - 1e-6
    assert sum(after) > sum(before)
    floor = CollisionMap.of(APARTMENT(opened.seed), 1.1)
    for x0, y0, x1, y1 in opened.stairwells:
        x, y, _ = opened.start
        outside = (max(x0 - x, x - x1, 0), max(y0 - y, y - y1, 0))
        assert np.hypot(*outside) >= drawing.FROM_START_M
        assert all(floor.clearance_m(x, y) > 0 for x in (x0, x1) for y in (y0, y1))


@pytest.mark.slow
def test_zones_are_away_from_the_start_and_leave_a_way_to_every_object() -> None:
    record = run_episode(setup("oracle", zones=2))
    assert len(record.zones) == 2
    assert all(isfinite(item.shortest_path_m or inf) for item in record.objects)
    assert drawing.deepest_m([record.start[:2]], record.zones, drawing.FROM_START_M) <= 0
