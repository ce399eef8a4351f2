"""Moments taken from the bus inside the process."""

from __future__ import annotations

import time

import numpy as np
import pytest

from onemap_shared import keys
from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import pose_2d
from onemap_shared.memory_bus import MemoryRouter
from onemap_shared.messages import (
    Detections,
    Odometry,
    RgbdFrame,
    SearchState,
    SearchStatus,
    SearchView,
    SearchViewRequest,
)
from onemap_tools.demo.film import recorder as module
from onemap_tools.demo.film.recorder import FilmRecorder
from tests.tools.demo.film.moments import FOUND_BED, map_view

START_NS = time.time_ns()


class FakeServices:
    """A robot, a planner and a mapper on a bus; the mapper notes what it is asked for."""

    def __init__(self) -> None:
        self.router = MemoryRouter()
        self.asked: list[str] = []
        bus = self.router.bus()
        self._rgbd = bus.publish(keys.ROBOT_RGBD)
        self._odometry = bus.publish(keys.ROBOT_ODOMETRY)
        self._search = bus.publish(keys.SEARCH_STATE)
        self._detections = bus.publish(keys.DETECTIONS)

    def serve_map(self) -> None:
        def reply(request: SearchViewRequest) -> SearchView:
            self.asked.append(request.text)
            return map_view()

        self.router.bus().serve(keys.MAP_SEARCH_VIEW, reply)

    def frame(self, sequence: int = 1) -> None:
        depth = np.zeros((6, 8), np.uint16)
        intrinsics = Intrinsics(8.0, 8.0, 4.0, 3.0)
        rgb = np.full((6, 8, 3), sequence, np.uint8)
        self._rgbd.put(RgbdFrame(sequence, 1, rgb, depth, intrinsics, np.eye(4)))
        self._odometry.put(Odometry(sequence, 1, pose_2d(0.1 * sequence, 0.0, 0.0), 0.0, 0.0))

    def detect(self, sequence: int) -> None:
        box, score = np.array([[1, 1, 5, 5]], np.float32), np.array([0.9], np.float32)
        points, owners = np.zeros((0, 3), np.float32), np.zeros(0, np.int32)
        self._detections.put(Detections(sequence, 1, "d", ("bed",), box, score, points, owners))

    def search(self, state: SearchState = SearchState.EXPLORING) -> None:
        results = (FOUND_BED,) if state is SearchState.FOUND else ()
        ended_ns = START_NS + 7 * 10**9
        self._search.put(
            SearchStatus("s1", state, ("bed",), len(results), "", results, START_NS, ended_ns, 1.0)
        )


@pytest.fixture
def services() -> FakeServices:
    return FakeServices()


def test_nothing_is_kept_before_search_camera_and_map_are_there(services: FakeServices) -> None:
    recorder = FilmRecorder(services.router.bus())
    recorder.update(0.0)
    services.frame()
    recorder.update(1.0)
    services.search()
    recorder.update(2.0)
    kept = len(recorder.moments)
    assert kept == 0
    services.serve_map()
    recorder.update(2.1)  # at once: nothing was kept so far
    assert len(recorder.moments) == 1
    assert services.asked == ["bed"]


def test_a_moment_holds_what_was_last_received(services: FakeServices) -> None:
    services.serve_map()
    recorder = FilmRecorder(services.router.bus())
    services.search()
    for sequence in (1, 2, 3):
        services.frame(sequence)
        recorder.update(10.0 * sequence)
    services.search(SearchState.FOUND)
    recorder.end(31.0)
    first, *_, last = recorder.moments
    assert first.camera[0, 0, 0] == 1
    assert last.camera[0, 0, 0] == 3
    assert last.overlay.robot == pytest.approx((0.3, 0.0, 0.0))
    assert last.overlay.found == (("bed", 4.5, 1.0),)
    assert len(last.overlay.trail_m) == 3
    assert last.status.state is SearchState.FOUND
    assert last.elapsed_s == 7.0  # by the planner's clock, however late it is asked
    assert services.asked[-1] == ""


def test_boxes_are_shown_in_their_own_image(services: FakeServices) -> None:
    services.serve_map()
    recorder = FilmRecorder(services.router.bus())
    services.search()
    for sequence in range(40, 45):
        services.frame(sequence)
    services.detect(42)
    recorder.update(0.0)
    services.detect(7)  # of a frame that is gone
    recorder.update(1.0)
    matched, unmatched = recorder.moments
    assert (matched.camera[0, 0, 0], unmatched.camera[0, 0, 0]) == (42, 44)
    assert matched.detections is not None
    assert unmatched.detections is None


def test_a_long_search_is_recorded_at_longer_intervals(
    services: FakeServices, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "MAX_MOMENTS", 8)
    services.serve_map()
    recorder = FilmRecorder(services.router.bus())
    services.search()
    for step in range(64):
        services.frame(step)
        recorder.update(0.25 * step)
        assert len(recorder.moments) < 8
    shades = [int(moment.camera[0, 0, 0]) for moment in recorder.moments]
    assert shades[0] == 0
    assert np.all(np.diff(shades)[:-1] == np.diff(shades)[0])
    assert shades[-1] >= 48
