"""Dashboard, alerts and their page name metrics that the gateway and the services report."""

from __future__ import annotations

import json
import re
import threading
from typing import Any

import pytest
import torch
import yaml

from onemap_gateway.present.metrics import RequestCounter, exposition
from onemap_mapper.belief.version import NO_FRAMES
from onemap_mapper.robots import MapRobot
from onemap_perception.service import PerceptionTelemetry
from onemap_planner.config import PlannerConfig
from onemap_planner.service import Planner
from onemap_shared.messages import Heartbeat
from onemap_shared.transport import Counters
from tests.gateway import fakes
from tests.memory_bus import MemoryRouter
from tests.structure import ROOT

ALERTS = ROOT / "deploy" / "prometheus" / "alerts.yaml"
DASHBOARD = ROOT / "deploy" / "grafana" / "onemap.json"
PAGE = ROOT / "docs" / "metrics.md"
NAME = re.compile(r"\bonemap_\w+")
SERIES = ("_bucket", "_count", "_sum")  # of a histogram


@pytest.fixture(scope="module")
def reported() -> set[str]:
    """Every name in /metrics of a gateway that hears perception, mapper and planner."""
    perception = PerceptionTelemetry(started_s=0.0)
    perception.frame_done(1.0, encode_ms=1.0)
    mapper = MapRobot(
        0, MemoryRouter().bus("mapper"), torch.device("cpu"), threading.Event(), lambda: ("", 0)
    )
    planner = Planner(MemoryRouter().bus("planner"), PlannerConfig())
    numbers = {
        "perception": perception.timings,
        "mapper": mapper.metrics(NO_FRAMES, 1.0),
        "planner": planner.health().metrics or {},
    }
    planner.close()
    state = fakes.full_state().with_message(fakes.revision(4), 1.0)  # the map went on
    for service, metrics in numbers.items():
        beat = Heartbeat(service, "i1", fakes.STAMP_NS, 1, True, "", dict(metrics))
        state = state.with_message(beat, 1.0)
    requests = RequestCounter()
    requests.count("GET", "/v1/map", 200)
    text = exposition(state, {"rgbd": Counters()}, requests, 2.0).decode()
    return {line.split("{")[0].split(" ")[0] for line in text.splitlines() if line[0] != "#"}


def expressions() -> list[str]:
    rules: list[dict[str, Any]] = yaml.safe_load(ALERTS.read_text())["groups"][0]["rules"]
    panels: list[dict[str, Any]] = json.loads(DASHBOARD.read_text())["panels"]
    shown = [target["expr"] for panel in panels for target in panel["targets"]]
    return [*(rule["expr"] for rule in rules), *shown]


def test_what_is_shown_and_watched_is_reported(reported: set[str]) -> None:
    named = {name for expression in expressions() for name in NAME.findall(expression)}
    assert len(named) > 10
    assert named - reported == set()


def test_the_page_explains_what_is_shown_and_watched(reported: set[str]) -> None:
    explained = {name for name in NAME.findall(PAGE.read_text()) if name != "onemap_"}
    histograms = {name.removesuffix("_bucket") for name in reported}
    assert explained - reported - histograms == set()
    named = {name for expression in expressions() for name in NAME.findall(expression)}
    series = {f"{name}{end}" for name in explained for end in SERIES}
    assert named <= explained | series
