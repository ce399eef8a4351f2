"""The monitor of a demo run, on the bus inside the process."""

from __future__ import annotations

import time

import numpy as np
import pytest

from onemap_shared import keys
from onemap_shared.geometry import pose_2d
from onemap_shared.grid import GridSpec
from onemap_shared.memory_bus import MemoryRouter
from onemap_shared.messages import (
    Heartbeat,
    MapRevision,
    Odometry,
    SearchView,
    SearchViewRequest,
    Truth,
    TruthRequest,
)
from onemap_tools.demo.run_monitor import RunMonitor


def odometry(x: float, y: float = 0.0, yaw: float = 0.0) -> Odometry:
    return Odometry(1, 1, pose_2d(x, y, yaw), 0.0, 0.0)


def revision(frames: int, stamp_ns: int = 1) -> MapRevision:
    return MapRevision(2 * frames, frames, stamp_ns, "e", "t", frames, 10, 10, 1.0, 9.9)


def test_the_trail_leaves_out_a_standing_robot() -> None:
    router = MemoryRouter()
    monitor = RunMonitor(router.bus())
    robot = router.bus().publish(keys.ROBOT_ODOMETRY)
    for x in (0.0, 0.001, 0.1, 0.1, 0.2):
        robot.put(odometry(x, yaw=0.5))
    monitor.update(0.0)
    assert monitor.trail_m == ((0.0, 0.0), (0.1, 0.0), (0.2, 0.0))
    assert monitor.position_m == (0.2, 0.0)
    assert monitor.yaw_rad == pytest.approx(0.5)


def test_contacts_are_those_of_the_simulators_newest_heartbeat() -> None:
    router = MemoryRouter()
    monitor = RunMonitor(router.bus())
    simulator = router.bus().publish(keys.heartbeat("simulator"))
    monitor.update(0.0)
    assert monitor.contacts is None
    for metrics in ({"collisions": 1.0}, {"collisions": 3.0}, {"rgbd_hz": 8.0}):
        simulator.put(Heartbeat("simulator", "a", 1, 1, ready=True, metrics=metrics))
    monitor.update(0.1)
    assert monitor.contacts == 3


def test_the_mapper_compiles_until_a_heartbeat_says_otherwise() -> None:
    router = MemoryRouter()
    monitor = RunMonitor(router.bus())
    mapper = router.bus().publish(keys.heartbeat("mapper"))
    seen = [monitor.compiling]
    for metrics in ({"start_s": 2.0}, {"cells": 0.0}):
        mapper.put(Heartbeat("mapper", "a", 1, 1, ready=False, metrics=metrics))
        monitor.update(0.1)
        seen.append(monitor.compiling)
    assert seen == [False, True, False]


def test_the_map_rate_counts_frames_since_the_restart() -> None:
    router = MemoryRouter()
    monitor = RunMonitor(router.bus())
    mapper = router.bus().publish(keys.MAP_REVISION)
    assert np.isnan(monitor.map_rate_hz)
    for now_s, frames in ((0.0, 1), (50.0, 100), (51.0, 105), (60.0, 150)):
        mapper.put(revision(frames))
        if now_s == 50.0:
            monitor.restart(now_s)
        monitor.update(now_s)
    assert monitor.map_rate_hz == 5.0


def test_the_age_of_the_map_is_that_of_its_newest_frame() -> None:
    router = MemoryRouter()
    monitor = RunMonitor(router.bus())
    ages_s = [monitor.map_age_s]
    router.bus().publish(keys.MAP_REVISION).put(revision(1, time.time_ns() - 10**10))
    monitor.update(0.0)
    ages_s.append(monitor.map_age_s)
    assert ages_s[0] is None
    assert ages_s[1] is not None
    assert ages_s[1] >= 10


def test_without_replies_everything_is_none() -> None:
    monitor = RunMonitor(MemoryRouter().bus())
    assert monitor.truth("sofa", (0.0, 0.0)) is None
    assert monitor.map_view() is None
    assert monitor.position_m is None


def test_truth_and_map_are_requested() -> None:
    router = MemoryRouter()
    other = router.bus()
    asked: list[TruthRequest] = []

    def reply_truth(request: TruthRequest) -> Truth:
        asked.append(request)
        return Truth("apartment", 1, 0.5, 3.0, ("sofa",), "sofa", True)

    def view(request: SearchViewRequest) -> SearchView:
        cells = np.zeros((2, 3), np.uint8)
        nothing = np.zeros((0, 0), np.float32)
        return SearchView("", 1, 1, 1, GridSpec(0.1, (0, 0), (2, 3)), cells, cells, nothing)

    other.serve(keys.ROBOT_TRUTH, reply_truth)
    other.serve(keys.MAP_SEARCH_VIEW, view)
    monitor = RunMonitor(router.bus())
    truth = monitor.truth("sofa", (1.0, 2.0))
    assert truth is not None
    assert truth.categories == ("sofa",)
    assert asked == [TruthRequest("sofa", 1.0, 2.0)]
    assert monitor.map_view() is not None
