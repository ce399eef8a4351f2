"""The snapshot: what each message changes, and nothing else."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from onemap_gateway.bus.live_state import (
    HEARTBEAT_EXPIRY_S,
    MAX_LOGGED_STATUSES,
    MAX_METRICS,
    MAX_PROBLEM_CHARS,
    TRAIL_STEP_M,
    BusMessage,
    LiveState,
)
from onemap_shared.messages import SearchState
from onemap_shared.messages.search import FINAL_STATES
from tests.gateway import fakes

MESSAGES: dict[str, BusMessage] = {
    "frame": fakes.rgbd(),
    "odometry": fakes.odometry(1, 2),
    "detections": fakes.detections("sofa"),
    "revision": fakes.revision(3),
    "search": fakes.search(),
    "path": fakes.planned_path((0, 0), (1, 1)),
}


@pytest.mark.parametrize("name", MESSAGES)
def test_a_message_replaces_its_own_stream(name: str) -> None:
    before = LiveState()
    after = before.with_message(MESSAGES[name], 5.0)
    assert getattr(before, name) is None
    seen = getattr(after, name)
    assert seen.message is MESSAGES[name]
    assert seen.age_s(7.5) == 2.5
    for other in MESSAGES.keys() - {name}:
        assert getattr(after, other) is None


def test_a_latched_revision_is_no_progress() -> None:
    state = LiveState().with_message(fakes.revision(3), 1.0)
    assert state.last_fused_s is None


def test_progress_is_a_fused_frame_not_any_change() -> None:
    state = LiveState().with_message(fakes.revision(3), 1.0)
    assert state.with_message(fakes.revision(4), 2.0).last_fused_s == 2.0
    cleared = state.with_message(fakes.revision(5, frames_fused=0), 3.0)
    assert cleared.last_fused_s is None
    assert cleared.with_message(fakes.revision(6, frames_fused=1), 4.0).last_fused_s == 4.0


@given(st.lists(st.floats(0.01, 1.0), min_size=2, max_size=30))
def test_the_rate_lies_between_the_fastest_and_the_slowest_interval(gaps: list[float]) -> None:
    state, now_s = LiveState(), 0.0
    for gap in [0.0, *gaps]:
        now_s += gap
        state = state.with_message(fakes.odometry(0, 0), now_s)
    assert state.odometry is not None
    rate = state.odometry.rate_hz(now_s)
    assert 1 / max(gaps) - 1e-6 <= rate <= 1 / min(gaps) + 1e-6


def test_the_rate_falls_when_the_stream_stalls() -> None:
    state = LiveState()
    for index in range(11):
        state = state.with_message(fakes.odometry(0, 0), index / 10)
    assert state.odometry is not None
    assert state.odometry.rate_hz(1.0) == pytest.approx(10.0)
    assert 0 < state.odometry.rate_hz(3.0) < 5
    assert state.odometry.rate_hz(20.0) == 0


def test_one_message_has_no_rate() -> None:
    state = LiveState().with_message(fakes.odometry(0, 0), 10.0)
    assert state.odometry is not None
    assert state.odometry.rate_hz(10.0) == 0.0


@given(st.integers(0, 3 * MAX_LOGGED_STATUSES), st.integers(0, 3 * MAX_LOGGED_STATUSES))
def test_a_reader_gets_what_is_new_to_it_in_order(before: int, after: int) -> None:
    state = LiveState()
    for index in range(before + after):
        state = state.with_message(fakes.search(updated_ns=index), float(index))
    fresh = [status.updated_ns for status in state.statuses_since(before)]
    assert fresh == list(range(before, before + after))[-MAX_LOGGED_STATUSES:][: len(fresh)]
    assert len(fresh) == min(after, MAX_LOGGED_STATUSES)


def test_a_heartbeat_without_progress_does_not_count_as_one() -> None:
    state = LiveState().with_message(fakes.heartbeat("mapper", 1), 1.0)
    state = state.with_message(fakes.heartbeat("mapper", 1), 2.0)
    assert state.heartbeats["mapper"].advanced_s == 1.0
    state = state.with_message(fakes.heartbeat("mapper", 2), 3.0)
    assert state.heartbeats["mapper"].advanced_s == 3.0


def test_heartbeats_of_several_services_live_side_by_side() -> None:
    state = LiveState().with_message(fakes.heartbeat("mapper"), 1.0)
    state = state.with_message(fakes.heartbeat("planner"), 2.0)
    assert set(state.heartbeats) == {"mapper", "planner"}


def test_the_trail_grows_by_steps_and_starts_anew_after_a_jump() -> None:
    state = LiveState()
    for index in range(10):
        state = state.with_message(fakes.odometry(index * TRAIL_STEP_M * 0.51, 0), 0.0)
    assert len(state.trail_m) == 5
    state = state.with_message(fakes.odometry(50, 50), 0.0)
    assert state.trail_m == ((50.0, 50.0),)


def test_old_detections_and_paths_are_not_shown() -> None:
    state = LiveState().with_message(fakes.detections("sofa"), 0.0)
    state = state.with_message(fakes.planned_path((0, 0)), 0.0)
    assert state.detections_now(1.0) is not None
    assert state.detections_now(2.0) is None
    assert state.path_now(4.0) is not None
    assert state.path_now(6.0) is None
    assert LiveState().detections_now(0.0) is None
    assert LiveState().path_now(0.0) is None


def test_a_path_ends_with_its_search() -> None:
    path = fakes.planned_path((0, 0), (1, 1))
    for ended in FINAL_STATES:
        state = LiveState().with_message(fakes.search(), 1.0).with_message(path, 1.0)
        assert state.path_now(1.1) is not None
        state = state.with_message(fakes.search(state=ended), 1.2)
        assert state.path_now(1.3) is None
        started = replace(fakes.search("s2"), started_ns=path.stamp_ns + 1)
        assert state.with_message(started, 1.4).path_now(1.5) is None


def test_the_same_liveliness_is_the_same_state() -> None:
    state = LiveState().with_alive(frozenset({"mapper"}), 0.0)
    assert state.alive == {"mapper"}
    assert state.with_alive(frozenset({"mapper"}), 1.0) is state
    assert state.with_members(frozenset({("mapper", "a")}), 1.0) is state
    twice = state.with_members(frozenset({("mapper", "a"), ("mapper", "b")}), 1.0)
    assert twice.doubled == {"mapper": ("mapper a", "mapper b")}
    assert twice.alive == state.alive


def test_a_final_status_is_kept_like_any_other() -> None:
    state = LiveState().with_message(fakes.search(state=SearchState.FOUND), 1.0)
    assert state.search is not None
    assert not state.search.message.active


def test_heartbeats_of_names_that_are_no_service_are_not_kept() -> None:
    state = LiveState()
    for index in range(1000):
        state = state.with_message(fakes.heartbeat(f"forged{index}"), 1.0)
    state = state.with_alive(frozenset({"forged", "mapper"}), 1.0)
    assert not state.heartbeats
    assert state.alive == {"mapper"}


def test_a_heartbeat_is_kept_while_its_service_lives_and_for_a_while_after() -> None:
    state = LiveState().with_message(fakes.heartbeat("mapper"), 1.0)
    late_s = 2.0 + HEARTBEAT_EXPIRY_S
    assert "mapper" in state.with_alive(frozenset({"mapper"}), late_s).heartbeats
    assert "mapper" in state.with_alive(frozenset(), late_s - 1.5).heartbeats
    assert "mapper" not in state.with_alive(frozenset(), late_s).heartbeats


def test_of_a_heartbeat_little_is_kept() -> None:
    metrics = {f"m{index}": 1.0 for index in range(5000)}
    metrics = {"nan": float("nan"), "inf": float("inf"), "x" * 5000: 1.0, "good": 2.0, **metrics}
    message = replace(fakes.heartbeat("mapper", problem="p" * 9000), metrics=metrics)
    kept = LiveState().with_message(message, 1.0).heartbeats["mapper"].heartbeat
    assert len(kept.metrics) <= MAX_METRICS
    assert kept.metrics["good"] == 2.0
    assert all(math.isfinite(value) and len(name) < 200 for name, value in kept.metrics.items())
    assert len(kept.problem) == MAX_PROBLEM_CHARS
