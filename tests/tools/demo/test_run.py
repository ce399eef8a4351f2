"""Demo runs from their start to their summary, with processes and gateways in memory."""

from __future__ import annotations

import io
import json
import os
import sys
import threading
import time
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import httpx
import numpy as np
import pytest
from rich.console import Console

from onemap import Client, OneMapError
from onemap_shared import keys
from onemap_shared import messages as m
from onemap_shared.geometry import pose_2d
from onemap_tools.demo import run as module
from onemap_tools.demo import start
from onemap_tools.demo.run import DemoRun, DemoTargets, RobotSearch
from onemap_tools.demo.setup import DemoRobot, DemoSetup
from onemap_tools.demo.summary import DemoSummary
from onemap_tools.errors import EXIT_FAILED, CliError
from onemap_tools.processes.launch import ProcessExit, ProcessSpec
from onemap_tools.progress import ProgressLines
from tests.memory_bus import MemoryRouter
from tests.shared.test_bus import Router, router
from tests.tools.demo.test_setup import options
from tests.tools.fake_gateway import Routes, fake_gateway

__all__ = ["router"]  # the fixture

NAMES = ("bed", "sofa", "desk")
TARGETS = DemoTargets(NAMES, {name: name for name in NAMES})
RESULT = {
    "name": "sofa",
    "outcome": "found",
    "reason": "confirmed",
    "position_m": [1.0, 2.0, 0.4],
    "duration_s": 30.0,
    "path_length_m": 7.5,
    "start_xy_m": [0.0, 0.0],
    "end_xy_m": [1.0, 1.2],
}


@pytest.fixture(autouse=True)
def _no_pauses(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "POLL_S", 0.0)


def console() -> Console:
    return Console(file=io.StringIO(), width=200)


class FakeRobot:
    """A robot on a bus of its own, and a gateway whose searches end after so many polls."""

    def __init__(self, polls: int = 1, ends: str = "found", missing: tuple[str, ...] = ()) -> None:
        self.polls, self.ends = polls, ends
        self.sought: list[list[str]] = []
        self.named: dict[str, Any] = {}
        self.router = MemoryRouter()
        self._missing = list(missing)
        self._left = 0

    def handle(self, request: httpx.Request) -> httpx.Response:
        if request.url.path == "/readyz":
            missing = self._missing.pop(0) if self._missing else ""
            return httpx.Response(503 if missing else 200, json={"detail": missing})
        if request.url.path.endswith("/queries"):
            return httpx.Response(422, json={"detail": "'blorp' is no word that mini knows."})
        if request.method == "PUT":
            name, place = request.url.path.rpartition("/")[2], json.loads(request.content)
            self.named[name] = place
            return httpx.Response(
                200, json={"name": name, "outlines_m": [], "area_m2": 4.0, **place}
            )
        if request.method == "POST":
            self.sought.append(json.loads(request.content)["objects"])
            self._left = self.polls
        self._left -= request.method == "GET"
        cancelled = request.method == "DELETE"
        state = "cancelled" if cancelled else "exploring" if self._left > 0 else self.ends
        names = self.sought[-1]
        document = {
            "id": f"s{len(self.sought)}",
            "state": state,
            "objects": names,
            "target": names[0],
            "reason": "the map was lost" if state == "failed" else "driving",
            "results": [{**RESULT, "name": name} for name in names] if state == "found" else [],
            "elapsed_s": 10.0,
            "path_length_m": 2.5,
        }
        return httpx.Response(200, json=document)

    def search(self, name: str = "") -> RobotSearch:
        client = Client(transport=httpx.MockTransport(self.handle))
        return RobotSearch(DemoRobot(name), client, self.router.bus())


def demo_of(
    folder: Path, *fakes: FakeRobot, exits: tuple[ProcessExit, ...] = (), limit_s: float = 60.0
) -> DemoRun:
    """A run of these robots, whose processes exit like this."""
    processes: Any = SimpleNamespace(collect=lambda _: list(exits), folder=folder / "logs")
    names = [f"r{n}" for n in range(1, len(fakes) + 1)] if len(fakes) > 1 else [""]
    robots = tuple(DemoRobot(name) for name in names)
    setup = DemoSetup("tcp/127.0.0.1:1", "http://127.0.0.1:1", folder / "c.yaml", (), {}, robots)
    given = options(folder, time_limit_s=limit_s)
    began_s = time.monotonic() - 100.0  # the demo's imports took so long
    demo = DemoRun(given, setup, processes, threading.Event(), began_s)
    demo.searches = [fake.search(name) for fake, name in zip(fakes, names, strict=False)]
    return demo


def searched(demo: DemoRun) -> DemoSummary:
    return demo.search(TARGETS, ProgressLines(console()))


def ended(folder: Path) -> ProcessExit:
    return ProcessExit("mapper", 1, folder / "mapper.log", "out of memory")


def test_a_process_that_ends_ends_the_run(tmp_path: Path) -> None:
    demo = demo_of(tmp_path, exits=(ended(tmp_path),))
    for wait in (demo.pause, lambda: demo.stay_up(console())):
        with pytest.raises(CliError, match=r"mapper ended with code 1.*\nout of memory") as error:
            wait()
        assert error.value.exit_code == EXIT_FAILED
    demo.stop.set()
    demo.stay_up(out := console())  # until Ctrl-C
    assert isinstance(out.file, io.StringIO)
    for hint in ("onemap query sofa --url http://127.0.0.1:1\n", "doctor --config"):
        assert hint in out.file.getvalue()


def test_a_start_that_takes_too_long_names_the_missing_stage(tmp_path: Path) -> None:
    missing = "The mapper is starting."
    demo = demo_of(tmp_path, FakeRobot(), FakeRobot(missing=(missing,) * 9), limit_s=0.0)
    told = r"Not ready after 0 s\. r2: The mapper is starting\. The logs are in"
    with pytest.raises(CliError, match=told):
        demo.wait_until_ready(ProgressLines(console()))


def test_a_start_that_compiles_is_shown_and_waited_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    compiling = "Compiling kernels, once; cached in /tmp."
    robot = FakeRobot(missing=(compiling,))
    demo = demo_of(tmp_path, robot)
    metrics = {"start_s": 400.0}
    beat = m.Heartbeat("mapper", "a", 1, 1, ready=False, problem=compiling, metrics=metrics)
    robot.router.bus().publish(keys.heartbeat("mapper")).put(beat)
    now_s = time.monotonic() + 400.0  # longer than the limit
    monkeypatch.setattr(f"{module.__name__}.time", SimpleNamespace(monotonic=lambda: now_s))
    assert demo.overdue
    out = console()
    demo.wait_until_ready(ProgressLines(out))
    assert isinstance(out.file, io.StringIO)
    assert compiling in out.file.getvalue()
    assert not demo.overdue


def test_one_robot_searches_for_all_and_several_take_them_in_turn(tmp_path: Path) -> None:
    alone = FakeRobot(polls=2)
    summary = searched(demo_of(tmp_path, alone))
    assert alone.sought == [list(NAMES)]
    assert (summary.found, summary.judged, summary.failure) == (3, 0, "")
    assert 100.0 < summary.first_metre_s <= summary.duration_s
    assert summary.map_rate_hz != summary.map_rate_hz  # NaN: no map was published
    quick, slow = FakeRobot(polls=1), FakeRobot(polls=9)
    summary = searched(demo_of(tmp_path, quick, slow))
    assert (quick.sought, slow.sought) == ([["bed"], ["desk"]], [["sofa"]])
    assert [item.name for item in summary.objects] == list(NAMES)
    assert summary.worked
    first, second = summary.robots
    assert (first.name, first.found) == ("r1", ("bed", "desk"))
    assert (first.path_length_m, first.search_s) == (5.0, 20.0)
    assert (second.name, second.found, second.path_length_m) == ("r2", ("sofa",), 2.5)


def test_the_time_limit_ends_the_searches_of_all(tmp_path: Path) -> None:
    fakes = FakeRobot(polls=9), FakeRobot(polls=9)
    summary = searched(demo_of(tmp_path, *fakes, limit_s=0.0))
    assert [fake.sought for fake in fakes] == [[["bed"]], [["sofa"]]]
    assert summary.failure == "Cancelled after the time limit of 0 s."
    assert summary.not_sought == NAMES
    assert not summary.worked


def test_without_objects_the_demo_chooses_from_the_scene(tmp_path: Path) -> None:
    alone, other = FakeRobot(), FakeRobot()
    asked: list[m.TruthRequest] = []

    def truth(request: m.TruthRequest) -> m.Truth:
        asked.append(request)
        return m.Truth("flat", 1, 1.0, 1.0, ("bed", "sofa", "wall"), "bed", names_complete=True)

    alone.router.bus().serve(keys.ROBOT_TRUTH, truth)
    demo, out = demo_of(tmp_path, alone), console()
    assert demo.choose_targets(out) == DemoTargets(("bed", "sofa"), {"bed": "bed", "sofa": "sofa"})
    assert demo.searches[0].truth("sofa", (1.0, 2.0)) is not None
    assert asked == [m.TruthRequest("", 0.0, 0.0), m.TruthRequest("sofa", 1.0, 2.0)]
    demo.options = replace(demo.options, objects=("Elephant",))
    assert demo.choose_targets(out).objects == ("Elephant",)
    assert isinstance(out.file, io.StringIO)
    assert "flat has nothing that is called 'Elephant'" in out.file.getvalue()
    demo.options = replace(demo.options, objects=("the bed next to the sofa",))
    assert demo.choose_targets(out) == DemoTargets(("the bed next to the sofa",), {"bed": "bed"})
    assert "any object of that name counts" in out.file.getvalue()
    assert not alone.named
    demo.setup.config_file.write_text("simulator: {seed: 3}\n")
    demo.options = replace(demo.options, objects=("the bed, stay out of the bathroom",))
    demo.choose_targets(out)
    assert alone.named["bathroom"]["kind"] == "room"
    assert len(alone.named["bathroom"]["corners_m"]) == 4
    with pytest.raises(OneMapError, match="no word that mini knows"):  # before any robot drives
        demo_of(tmp_path, alone, other).choose_targets(out)


def test_a_whole_run_ends_with_its_summary(
    router: Router, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A process that only sleeps, a real router, and a gateway with fixed replies."""
    sleeper = ProcessSpec("mapper", (sys.executable, "-c", "import time; time.sleep(600)"))
    report: dict[str, Any] = {
        "id": "s1",
        "state": "exploring",
        "objects": ["sofa"],
        "target": "sofa",
    }
    report |= {"reason": "driving", "results": [], "elapsed_s": 1.0, "path_length_m": 2.0}
    routes: Routes = {
        ("GET", "/readyz"): (200, {"status": "ok"}),
        ("POST", "/v1/searches"): (201, report),
        ("GET", "/v1/searches/s1"): (200, {**report, "state": "found", "results": [RESULT]}),
    }
    config, out = tmp_path / "config.yaml", console()
    with fake_gateway(routes) as url:
        setup = DemoSetup(
            router.endpoint, url, config, (sleeper,), dict(os.environ), (DemoRobot(),)
        )
        monkeypatch.setattr(start, "set_up", lambda _: setup)
        document = start.run(options(tmp_path, objects=("sofa",), time_limit_s=60.0), out)
    assert (document["worked"], document["judged"], document["seed"]) == (True, 0, 7)
    assert document["picture"] is None  # there is no map
    assert json.loads((tmp_path / "summary.json").read_text()) == document
    assert isinstance(out.file, io.StringIO)
    assert "Searching for sofa. Live page: http://" in out.file.getvalue()
    assert "1 of 1 found" in out.file.getvalue()
    assert (tmp_path / "logs" / "mapper.log").exists()


def test_what_the_bus_says_of_a_robot_is_kept() -> None:
    fake = FakeRobot()
    search, bus = fake.search(), fake.router.bus()
    odometry, revisions = bus.publish(keys.ROBOT_ODOMETRY), bus.publish(keys.MAP_REVISION)
    assert np.isnan(search.map_rate_hz)
    bus.publish(keys.heartbeat("simulator")).put(
        m.Heartbeat("simulator", "a", 1, 1, ready=True, metrics={"collisions": 2.0})
    )
    for now_s, frames in ((0.0, 1), (50.0, 100), (51.0, 105), (60.0, 150)):
        revisions.put(m.MapRevision(frames, frames, 1, "e", "t", frames, 10, 10, 1.0, 9.9))
        if now_s == 50.0:
            search.restart(now_s)
        search.update(now_s)
    assert search.map_rate_hz == 5.0  # since the restart
    assert search.contacts == 2
    for x_m in (0.0, 0.2):
        odometry.put(m.Odometry(1, 1, pose_2d(x_m, 0.0, 0.5), 0.0, 0.0))
    search.update(61.0)
    assert search.position_m == (0.2, 0.0)
