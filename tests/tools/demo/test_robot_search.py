"""Several robots of a demo take the objects in turn."""

from __future__ import annotations

import io
import json
from math import inf
from pathlib import Path

import httpx
import numpy as np
import pytest
from rich.console import Console

from onemap import Client, OneMapError
from onemap_shared import keys
from onemap_shared.geometry import pose_2d
from onemap_shared.grid import GridSpec
from onemap_shared.messages import (
    MapRevision,
    Odometry,
    SearchView,
    SearchViewRequest,
    Truth,
    TruthRequest,
)
from onemap_tools.demo import run as module
from onemap_tools.demo.robot_search import RobotSearch, RunMonitor, separation_m
from onemap_tools.demo.robots import named_robots
from onemap_tools.demo.run import DemoTargets
from onemap_tools.demo.summary import DemoSummary
from onemap_tools.progress import LineView
from tests.memory_bus import MemoryRouter
from tests.tools.demo.test_run import RESULT, demo_of

R1, R2 = named_robots(2, "simulator")
NAMES = ("bed", "sofa", "desk")
TARGETS = DemoTargets(NAMES, {name: name for name in NAMES})


class FakeRobot:
    """A gateway whose every search ends after so many polls, in this state."""

    def __init__(self, polls: int, ends: str = "found") -> None:
        self.polls, self.ends = polls, ends
        self.sought: list[str] = []
        self._left = 0

    def handle(self, request: httpx.Request) -> httpx.Response:
        if request.url.path.endswith("/queries"):
            return httpx.Response(422, json={"detail": "'blorp' is no word that mini knows."})
        if request.method == "POST":
            self.sought += json.loads(request.content)["objects"]
            self._left = self.polls
        self._left -= request.method == "GET"
        ended = "cancelled" if request.method == "DELETE" else self.ends
        over = self._left <= 0 or request.method == "DELETE"
        name = self.sought[-1]
        document = {
            "id": f"s{len(self.sought)}",
            "state": ended if over else "exploring",
            "objects": [name],
            "target": name,
            "reason": "the map was lost" if ended == "failed" else "driving",
            "results": [{**RESULT, "name": name}] if over and ended == "found" else [],
            "elapsed_s": 10.0,
            "path_length_m": 2.5,
        }
        return httpx.Response(200, json=document)


@pytest.fixture(autouse=True)
def _no_pauses(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "POLL_S", 0.0)


def console() -> Console:
    return Console(file=io.StringIO(), width=200)


def searches_of(*fakes: FakeRobot) -> list[RobotSearch]:
    return [
        RobotSearch(
            robot,
            Client(transport=httpx.MockTransport(fake.handle)),
            RunMonitor(MemoryRouter().bus()),
        )
        for robot, fake in zip((R1, R2), fakes, strict=True)
    ]


def searched(folder: Path, *fakes: FakeRobot, time_limit_s: float = 60.0) -> DemoSummary:
    demo = demo_of(folder, time_limit_s=time_limit_s)
    return module._search(demo, searches_of(*fakes), TARGETS, LineView(console()))


def test_one_that_has_finished_takes_the_next(tmp_path: Path) -> None:
    quick, slow = FakeRobot(polls=1), FakeRobot(polls=9)
    summary = searched(tmp_path, quick, slow)
    assert (quick.sought, slow.sought) == (["bed", "desk"], ["sofa"])
    assert [item.name for item in summary.objects] == list(NAMES)
    assert summary.worked
    first, second = summary.robots
    assert (first.name, first.found) == ("r1", ("bed", "desk"))
    assert (first.path_length_m, first.search_s) == (5.0, 20.0)
    assert (second.name, second.found, second.path_length_m) == ("r2", ("sofa",), 2.5)


def test_one_that_fails_goes_on_with_the_next_and_is_named(tmp_path: Path) -> None:
    failing, sound = FakeRobot(polls=1, ends="failed"), FakeRobot(polls=9)
    summary = searched(tmp_path, failing, sound)
    assert failing.sought == ["bed", "desk"]
    assert summary.failure == "r1: the map was lost"
    assert summary.not_sought == ("bed", "desk")
    assert not summary.worked


def test_the_time_limit_ends_the_searches_of_all(tmp_path: Path) -> None:
    fakes = FakeRobot(polls=9), FakeRobot(polls=9)
    summary = searched(tmp_path, *fakes, time_limit_s=0.0)
    assert [fake.sought for fake in fakes] == [["bed"], ["sofa"]]
    assert summary.failure == "Cancelled after the time limit of 0 s."
    assert summary.not_sought == NAMES


def test_an_unknown_word_is_refused_before_any_robot_drives() -> None:
    searches = searches_of(FakeRobot(1), FakeRobot(1))
    with pytest.raises(OneMapError, match="no word that mini knows"):
        module._check_words(searches, TARGETS)
    module._check_words(searches[:1], TARGETS)  # the planner refuses the only search at once


def test_the_separation_is_between_the_two_that_are_nearest() -> None:
    searches = searches_of(FakeRobot(1), FakeRobot(1))
    assert separation_m(searches) == inf
    for search, x_m in zip(searches, (1.0, 4.0), strict=True):
        place = Odometry(1, 1, pose_2d(x_m, 2.0, 0.0), 0.0, 0.0)
        search.monitor.bus.publish(keys.ROBOT_ODOMETRY).put(place)
        search.monitor.update(0.0)
    assert np.isclose(separation_m(searches), 3.0)


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
