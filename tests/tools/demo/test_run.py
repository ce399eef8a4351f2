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
import pytest
from rich.console import Console

from onemap import Client
from onemap_perception.config import SHIPPED
from onemap_perception.text.vocabulary import load_vocabulary
from onemap_shared import keys
from onemap_shared import messages as m
from onemap_tools.demo import run as module
from onemap_tools.demo import start
from onemap_tools.demo.run import DemoRun, DemoTargets, SimulatedRobot, scene_category
from onemap_tools.demo.setup import DemoSetup
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
        if request.url.path.endswith("/status"):
            return httpx.Response(503, json={"detail": "not now"})
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

    def robot(self) -> SimulatedRobot:
        return SimulatedRobot(self.router.bus())

    def gateway(self) -> Client:
        return Client(transport=httpx.MockTransport(self.handle))


def demo_of(folder: Path, exits: tuple[ProcessExit, ...] = (), limit_s: float = 60.0) -> DemoRun:
    """A run whose processes exit like this."""
    processes: Any = SimpleNamespace(collect=lambda _: list(exits), folder=folder / "logs")
    setup = DemoSetup("tcp/127.0.0.1:1", "http://127.0.0.1:1", folder / "c.yaml", (), {})
    given = options(folder, time_limit_s=limit_s)
    began_s = time.monotonic() - 100.0  # the demo's imports took so long
    return DemoRun(given, setup, processes, threading.Event(), began_s)


def searched(demo: DemoRun, fake: FakeRobot, out: Console) -> dict[str, Any]:
    lines = ProgressLines(out)
    return demo.search(fake.robot(), fake.gateway(), TARGETS, lines, out)


def told(console: Console) -> str:
    assert isinstance(console.file, io.StringIO)
    return console.file.getvalue()


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
    for hint in ("onemap query sofa --url http://127.0.0.1:1\n", "doctor --config"):
        assert hint in told(out)


def test_a_start_that_takes_too_long_names_the_missing_stage(tmp_path: Path) -> None:
    fake = FakeRobot(missing=("The mapper is starting.",) * 9)
    demo = demo_of(tmp_path, limit_s=0.0)
    with pytest.raises(CliError, match=r"Not ready after 0 s\. The mapper .* The logs are in"):
        demo.wait_until_ready(fake.robot(), fake.gateway(), ProgressLines(console()))


def test_a_start_that_compiles_is_shown_and_waited_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    compiling = "Compiling kernels, once; cached in /tmp."
    fake = FakeRobot(missing=(compiling,))
    demo, robot = demo_of(tmp_path), fake.robot()
    metrics = {"start_s": 400.0}
    beat = m.Heartbeat("mapper", "a", 1, 1, ready=False, problem=compiling, metrics=metrics)
    fake.router.bus().publish(keys.heartbeat("mapper")).put(beat)
    now_s = time.monotonic() + 400.0  # longer than the limit
    monkeypatch.setattr(f"{module.__name__}.time", SimpleNamespace(monotonic=lambda: now_s))
    assert demo.overdue
    out = console()
    demo.wait_until_ready(robot, fake.gateway(), ProgressLines(out))
    assert compiling in told(out)
    assert not demo.overdue


def test_a_search_ends_with_what_the_simulator_says_of_it(tmp_path: Path) -> None:
    fake, out = FakeRobot(polls=2), console()
    document = searched(demo_of(tmp_path), fake, out)
    assert fake.sought == [list(NAMES)]
    assert (document["worked"], document["found"], document["judged"]) == (True, 3, 0)
    assert 100.0 < document["first_metre_s"] <= document["duration_s"] + 0.01
    assert "sofa: nobody can judge it" in told(out)
    disagrees = FakeRobot()
    truth = m.Truth("flat", 1, 3.0, 3.0, ("bed",), "desk", names_complete=True)
    disagrees.router.bus().serve(keys.ROBOT_TRUTH, lambda _: truth)
    out = console()
    document = searched(demo_of(tmp_path), disagrees, out)
    assert (document["worked"], document["found"], document["claimed_wrongly"]) == (False, 0, 3)
    assert "bed: the simulator disagrees; nearest to the place is desk." in told(out)
    assert "0 of 3 found in" in told(out)


def test_the_time_limit_ends_the_search(tmp_path: Path) -> None:
    out = console()
    document = searched(demo_of(tmp_path, limit_s=0.0), FakeRobot(polls=9), out)
    assert document["trouble"] == "Cancelled after the time limit of 0 s."
    assert document["trouble"] in told(out)
    assert not document["worked"]


def test_a_search_that_failed_says_why(tmp_path: Path) -> None:
    document = searched(demo_of(tmp_path), FakeRobot(ends="failed"), console())
    assert (document["worked"], document["trouble"]) == (False, "the map was lost")


def test_without_objects_the_demo_chooses_from_the_scene(tmp_path: Path) -> None:
    fake = FakeRobot()
    asked: list[m.TruthRequest] = []

    def truth(request: m.TruthRequest) -> m.Truth:
        asked.append(request)
        return m.Truth("flat", 1, 1.0, 1.0, ("bed", "sofa", "wall"), "bed", names_complete=True)

    fake.router.bus().serve(keys.ROBOT_TRUTH, truth)
    demo, out, robot = demo_of(tmp_path), console(), fake.robot()

    def chosen(*objects: str) -> DemoTargets:
        demo.options = replace(demo.options, objects=objects)
        return demo.choose_targets(robot, fake.gateway(), out)

    assert chosen() == DemoTargets(("bed", "sofa"), {"bed": "bed", "sofa": "sofa"})
    assert robot.truth("sofa", (1.0, 2.0)) is not None
    assert asked == [m.TruthRequest("", 0.0, 0.0), m.TruthRequest("sofa", 1.0, 2.0)]
    assert chosen("Elephant").objects == ("Elephant",)
    assert "flat has nothing that is called 'Elephant'" in told(out)
    described = "the bed next to the sofa"
    assert chosen(described) == DemoTargets((described,), {"bed": "bed"})
    assert "any object of that name counts" in told(out)
    assert not fake.named
    demo.setup.config_file.write_text("simulator: {seed: 3}\n")
    chosen("the bed, stay out of the bathroom")
    assert fake.named["bathroom"]["kind"] == "room"
    assert len(fake.named["bathroom"]["corners_m"]) == 4


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
        setup = DemoSetup(router.endpoint, url, config, (sleeper,), dict(os.environ))
        monkeypatch.setattr(start, "set_up", lambda _: setup)
        document = start.run(options(tmp_path, objects=("sofa",), time_limit_s=60.0), out)
    assert (document["worked"], document["judged"], document["seed"]) == (True, 0, 7)
    assert json.loads((tmp_path / "summary.json").read_text()) == document
    assert "Searching for sofa. Live page: http://" in told(out)
    assert "1 of 1 found" in told(out)
    assert (tmp_path / "logs" / "mapper.log").exists()


def test_what_the_bus_says_of_a_robot_is_kept() -> None:
    fake = FakeRobot()
    robot = fake.robot()
    fake.router.bus().publish(keys.heartbeat("simulator")).put(
        m.Heartbeat("simulator", "a", 1, 1, ready=True, metrics={"collisions": 2.0})
    )
    robot.update()
    assert robot.contacts == 2


VOCABULARY = load_vocabulary(SHIPPED)
APARTMENT = ("armchair", "sofa", "wall")


@pytest.mark.parametrize(
    ("word", "categories", "name"),
    [
        ("sofa", APARTMENT, "sofa"),
        ("couch", APARTMENT, "sofa"),  # an alias
        ("Sectional  Sofa", APARTMENT, "sofa"),  # a held-out synonym
        ("sofa", ("couch",), "couch"),  # a file that uses another word than mini's
        ("couch", ("couch", "sofa"), "couch"),  # the person's own word first
        ("chaise longue", APARTMENT, "sofa"),  # an alias of queries alone
        ("bed", APARTMENT, "bed"),
        ("Elephant", APARTMENT, "elephant"),
    ],
)
def test_a_word_has_a_category_of_the_scene(
    word: str, categories: tuple[str, ...], name: str
) -> None:
    assert scene_category(word, categories, VOCABULARY) == name
