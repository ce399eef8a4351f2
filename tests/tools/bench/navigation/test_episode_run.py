"""Episodes in simulated time: they repeat themselves, and failures get their reason."""

from __future__ import annotations

from dataclasses import replace
from math import inf

import numpy as np
import pytest

from onemap_shared.geometry import pose_2d
from onemap_shared.messages import ObjectResult, SearchOrder, SearchState
from onemap_tools.bench.lockstep import SystemConfig
from onemap_tools.bench.navigation.choices import Errors, Features, Method
from onemap_tools.bench.navigation.episode_run import (
    SIMULATED_CAMERA_PX,
    EpisodeSetup,
    FrameCounts,
    failure_of,
    is_timeout,
    object_record,
    run_episode,
    system_config,
    true_results,
)
from onemap_tools.bench.navigation.errors import with_errors
from onemap_tools.bench.navigation.records import Failure
from onemap_tools.bench.simulated_robot import SearchEnd
from onemap_tools.demo.summary import ObjectSummary

FOUND = ObjectSummary(
    name="bed",
    outcome="found",
    reason="",
    position_m=(1.0, 2.0, 0.4),
    time_s=10.0,
    path_length_m=8.0,
    shortest_path_m=4.0,
    true_distance_m=1.0,
    goal_distance_m=0.0,
    nearest="bed",
)
MISSED = replace(FOUND, outcome="not_found", goal_distance_m=inf)
LATE = replace(MISSED, outcome="failed", reason="not found within 300 s, the limit for one object")


def setup(
    method: Method, features: Features = Features.SIMULATED, limit_s: float = 20.0
) -> EpisodeSetup:
    return EpisodeSetup(0, SystemConfig.read(None, 2, "training"), method, features, 2, limit_s)


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


def test_the_record_keeps_lengths_that_are_finite() -> None:
    record = object_record(LATE, FrameCounts((), in_view={"bed": 4}, detected={"bed": 1}))
    assert (record.in_view, record.detected, record.timed_out) == (4, 1, True)
    assert (record.goal_distance_m, record.shortest_path_m) == (None, 4.0)
    assert record.failure is Failure.NOT_ACCEPTED
    assert not is_timeout("searched everything")


def test_simulated_features_have_a_small_camera_and_mini_the_configured_one() -> None:
    small = system_config(setup(Method.ONEMAP)).simulator
    assert (small.camera.width, small.camera.height) == SIMULATED_CAMERA_PX
    mini = system_config(setup(Method.ONEMAP, Features.MINI)).simulator
    assert mini.camera == setup(Method.ONEMAP).config.simulator.camera
    assert small.rgbd_hz == mini.rgbd_hz == 4.0


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
    assert second.end_xy_m == pytest.approx((2.0, 3.0))
    assert second.position_m == ()


@pytest.mark.slow
def test_an_episode_with_every_error_repeats_itself_and_counts_them() -> None:
    plain = setup(Method.ONEMAP, limit_s=5.0)
    simulator = with_errors(plain.config.simulator, Errors.ALL)
    harsh = replace(plain, config=replace(plain.config, simulator=simulator))
    first, second = (run_episode(harsh) for _ in range(2))
    assert first == second
    assert first.frames_lost > 0
    assert first.pose_error_m > 0.001
    assert len(first.trajectory) < 4 * first.simulated_s


@pytest.mark.slow
def test_the_oracle_finds_everything_on_the_shortest_path() -> None:
    record = run_episode(setup(Method.ORACLE))
    assert [(item.success, item.spl) for item in record.objects] == [(True, 1.0)] * 2
    assert record.simulated_s > 0
    assert len(record.trajectory) > 2


@pytest.mark.slow
@pytest.mark.parametrize("method", [each for each in Method if each is not Method.ORACLE])
def test_every_method_runs_an_episode(method: Method) -> None:
    record = run_episode(setup(method, limit_s=4.0))
    assert len(record.objects) == 2
    assert record.simulated_s > 0
    assert len(record.trajectory) == pytest.approx(4 * record.simulated_s, abs=2)


@pytest.mark.slow
@pytest.mark.parametrize("features", [Features.UNCALIBRATED, Features.MINI])
def test_every_kind_of_features_runs_an_episode(features: Features) -> None:
    record = run_episode(setup(Method.ONEMAP, features, limit_s=3.0))
    assert record.trajectory[0] == pytest.approx(record.start[:2])


@pytest.mark.slow
def test_objects_in_any_order_are_recorded_in_the_order_in_which_they_ended() -> None:
    given = setup(Method.ONEMAP, limit_s=3.0)
    both = [run_episode(each) for each in (given, replace(given, order=SearchOrder.ANY))]
    names = [sorted(item.name for item in record.objects) for record in both]
    assert names[0] == names[1]
    assert both[1].simulated_s > 0


@pytest.mark.slow
def test_an_episode_repeats_itself() -> None:
    first, second = (run_episode(setup(Method.ONEMAP, limit_s=6.0)) for _ in range(2))
    assert first == second
    assert any(item.in_view for item in first.objects)
