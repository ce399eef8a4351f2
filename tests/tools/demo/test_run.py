"""One demo run from its start to its summary, with processes and gateway in memory."""

from __future__ import annotations

import io
import json
import os
import sys
import threading
import time
from dataclasses import replace
from math import nan
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import httpx
import pytest
from rich.console import Console

from onemap import Client
from onemap_shared import keys
from onemap_shared.messages import Heartbeat, Truth
from onemap_tools.demo import run as module
from onemap_tools.demo.robot_search import RobotSearch, RunMonitor
from onemap_tools.demo.robots import DemoRobot
from onemap_tools.demo.run import DemoRun, DemoTargets, run_with_report
from onemap_tools.demo.setup import DemoSetup
from onemap_tools.demo.summary import DemoSummary
from onemap_tools.errors import EXIT_FAILED, EXIT_USAGE_ERROR, CliError
from onemap_tools.processes.launch import ProcessExit, ProcessSpec
from onemap_tools.progress import LineView
from tests.memory_bus import MemoryRouter
from tests.shared.test_bus import Router, router
from tests.tools.demo.test_setup import options
from tests.tools.fake_gateway import Routes, fake_gateway

__all__ = ["router"]  # the fixture

ALONE = DemoRobot("", "", "", "simulator")
TARGETS = DemoTargets(("sofa",), {"sofa": "sofa"})
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


def demo_of(folder: Path, *exits: ProcessExit, time_limit_s: float = 60.0) -> DemoRun:
    """A run whose processes exit like this."""
    processes: Any = SimpleNamespace(collect=lambda _: list(exits), folder=folder / "logs")
    setup: Any = SimpleNamespace(
        url="http://127.0.0.1:1", config_file="config.yaml", robots=(ALONE,)
    )
    limited = replace(options(folder), time_limit_s=time_limit_s)
    return DemoRun(limited, setup, processes, threading.Event())


def report(state: str, *results: dict[str, Any]) -> dict[str, Any]:
    return {
        "id": "s1",
        "state": state,
        "objects": ["sofa"],
        "target": "sofa",
        "reason": "the map was lost" if state == "failed" else "driving",
        "results": list(results),
        "elapsed_s": 1.0,
        "path_length_m": 2.0,
    }


def gateway_of(*replies: dict[str, Any]) -> tuple[Client, list[str]]:
    """A gateway with these replies, the last one for ever, and the methods it was called with."""
    waiting, methods = list(replies), []

    def handle(request: httpx.Request) -> httpx.Response:
        methods.append(request.method)
        return httpx.Response(200, json=waiting.pop(0) if len(waiting) > 1 else waiting[0])

    return Client(transport=httpx.MockTransport(handle)), methods


def searched(demo: DemoRun, gateway: Client) -> DemoSummary:
    return module._search(demo, [search_of(gateway)], TARGETS, LineView(console()))


def search_of(gateway: Client, robot: DemoRobot = ALONE) -> RobotSearch:
    """A robot whose bus is silent."""
    return RobotSearch(robot, gateway, RunMonitor(MemoryRouter().bus()))


def test_a_process_that_ends_ends_the_run(tmp_path: Path) -> None:
    ended = ProcessExit("mapper", 1, tmp_path / "mapper.log", "out of memory")
    with pytest.raises(CliError, match="mapper ended with code 1") as error:
        demo_of(tmp_path, ended).pause()
    assert "out of memory" in str(error.value)
    assert error.value.exit_code == EXIT_FAILED


def test_a_start_that_takes_too_long_names_the_missing_stage(tmp_path: Path) -> None:
    missing = {"detail": "The mapper is not running."}
    transport = httpx.MockTransport(lambda _: httpx.Response(503, json=missing))
    demo = demo_of(tmp_path, time_limit_s=0.0)
    search = search_of(Client(transport=transport))
    with pytest.raises(CliError, match=r"Not ready after 0 s\. The mapper is not running\."):
        module._wait_until_ready(demo, [search], LineView(console()))


def test_a_start_that_compiles_is_shown_and_waited_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    compiling = "Compiling the map's kernels, once; cached in /tmp."
    replies = [httpx.Response(503, json={"detail": compiling}), httpx.Response(200, json={})]
    transport = httpx.MockTransport(lambda _: replies.pop(0))
    bus_router = MemoryRouter()
    search = RobotSearch(ALONE, Client(transport=transport), RunMonitor(bus_router.bus()))
    metrics = {"start_s": 400.0}
    beat = Heartbeat("mapper", "a", 1, 1, ready=False, problem=compiling, metrics=metrics)
    bus_router.bus().publish(keys.heartbeat("mapper")).put(beat)
    demo = demo_of(tmp_path, time_limit_s=60.0)
    now_s = time.monotonic() + 400.0  # longer than the limit
    monkeypatch.setattr(f"{module.__name__}.time", SimpleNamespace(monotonic=lambda: now_s))
    assert demo.overdue
    output = io.StringIO()
    module._wait_until_ready(demo, [search], LineView(Console(file=output, width=200)))
    assert compiling in output.getvalue()
    assert not demo.overdue


def test_a_finished_search_is_summarised(tmp_path: Path) -> None:
    gateway, methods = gateway_of(report("exploring"), report("exploring"), report("found", RESULT))
    summary = searched(demo_of(tmp_path), gateway)
    assert methods == ["POST", "GET", "GET"]
    assert (summary.found, summary.judged, summary.failure) == (1, 0, "")
    assert summary.worked
    assert summary.map_rate_hz != summary.map_rate_hz  # NaN: no map was published


def test_an_overdue_search_is_cancelled(tmp_path: Path) -> None:
    gateway, methods = gateway_of(report("exploring"), report("cancelled"))
    summary = searched(demo_of(tmp_path, time_limit_s=0.0), gateway)
    assert methods == ["POST", "DELETE"]
    assert summary.failure == "Cancelled after the time limit of 0 s."
    assert not summary.worked


def test_without_objects_the_demo_chooses_from_the_scene(tmp_path: Path) -> None:
    truth = Truth("apartment", 1, 1.0, 1.0, ("bed", "sofa", "wall"), "bed", names_complete=True)
    search: Any = SimpleNamespace(monitor=SimpleNamespace(truth=lambda *_: truth))
    targets = module._choose_targets(demo_of(tmp_path), [search], console())
    assert targets.objects == ("bed", "sofa")
    assert targets.scene_categories == {"bed": "bed", "sofa": "sofa"}


def test_without_a_map_the_summary_has_no_picture(tmp_path: Path) -> None:
    summary = DemoSummary(("sofa",), (), 1.0, 1.0, nan, "cancelled")
    searches = [search_of(Client())]
    document = module._write_results(demo_of(tmp_path), searches, summary)
    assert document["picture"] is None
    assert (document["seed"], document["trouble"]) == (7, "cancelled")
    assert json.loads((tmp_path / "summary.json").read_text()) == document


def test_a_run_that_cannot_start_has_a_summary(tmp_path: Path) -> None:
    scene = tmp_path / "flat.glb"
    scene.write_bytes(b"not a scene")
    with pytest.raises(CliError, match="cannot be read") as error:
        run_with_report(options(tmp_path / "run", scene=scene), console())
    assert error.value.exit_code == EXIT_USAGE_ERROR
    assert error.value.document["worked"] is False
    assert error.value.document["trouble"] == str(error.value)
    assert not (tmp_path / "run").exists()


def test_the_live_page_stays_until_ctrl_c(tmp_path: Path) -> None:
    demo = demo_of(tmp_path)
    demo.stop.set()
    module._stay_up(demo, console())
    crashed = demo_of(tmp_path, ProcessExit("gateway", 1, tmp_path / "gateway.log", "no memory"))
    with pytest.raises(CliError, match="gateway ended"):
        module._stay_up(crashed, console())


def test_a_whole_run_ends_with_its_summary(
    router: Router, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Processes that only sleep, a real router, and a gateway with fixed replies."""
    sleeper = ProcessSpec("mapper", (sys.executable, "-c", "import time; time.sleep(600)"))
    routes: Routes = {
        ("GET", "/readyz"): (200, {"status": "ok"}),
        ("POST", "/v1/searches"): (201, report("exploring")),
        ("GET", "/v1/searches/s1"): (200, report("found", RESULT)),
    }
    run_options = replace(options(tmp_path), objects=("sofa",), time_limit_s=60.0)
    out = console()
    with fake_gateway(routes) as url:
        setup = DemoSetup(
            router.endpoint,
            url,
            tmp_path / "config.yaml",
            (sleeper,),
            dict(os.environ),
            (ALONE,),
        )
        monkeypatch.setattr(module, "set_up", lambda _: setup)
        document = run_with_report(run_options, out)
    assert document["worked"] is True
    assert document["judged"] == 0
    assert json.loads((tmp_path / "summary.json").read_text()) == document
    assert isinstance(out.file, io.StringIO)
    assert "Searching for sofa. Live page: http://" in out.file.getvalue()
    assert "1 of 1 found" in out.file.getvalue()
    assert (tmp_path / "logs" / "mapper.log").exists()
