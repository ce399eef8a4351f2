"""What is offered is what the layout shows."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from typing import Any

import pytest

pytest.importorskip("foxglove", reason="needs foxglove-sdk: pip install 'onemap[live]'")

from onemap_mapper.robots import MapperTelemetry
from onemap_perception.telemetry import PerceptionTelemetry
from onemap_planner.config import PlannerConfig
from onemap_planner.service import Planner
from onemap_shared.memory_bus import MemoryRouter
from onemap_shared.transport import Counters
from onemap_tools.viewers import foxglove_topics as topics
from tests.gateway import fakes
from tests.structure import ROOT

LAYOUT = ROOT / "deploy" / "foxglove" / "onemap.json"
PAGE = ROOT / "docs" / "viewers.md"
OFFERED = {*topics.TYPED, *topics.JSON}
TOPIC = re.compile(r"`(/[a-z_/]+)`")
STREAM = fakes.STAMP_NS


def layout() -> dict[str, Any]:
    document: dict[str, Any] = json.loads(LAYOUT.read_text(encoding="utf-8"))
    return document


def panels(node: Any) -> Iterator[str]:
    """The names of the panels in a tree of splits."""
    if isinstance(node, str):
        yield node
        return
    for part in ("first", "second"):
        yield from panels(node[part])


def paths() -> list[str]:
    configs = layout()["configById"].values()
    return [path["value"] for config in configs for path in config.get("paths", ())]


def test_the_layout_places_every_panel_that_it_configures() -> None:
    placed = list(panels(layout()["layout"]))
    assert sorted(placed) == sorted(layout()["configById"])


def test_the_layout_shows_topics_that_are_offered() -> None:
    configs = layout()["configById"]
    shown = {path.split(".")[0] for path in paths()}
    for config in configs.values():
        shown |= set(config.get("topics", ()))
        shown |= {config[key] for key in ("topicPath", "topicToRender") if key in config}
    image = configs["Image!camera"]["imageMode"]
    shown |= {image["imageTopic"], image["calibrationTopic"], *image["annotations"]}
    assert len(shown) > 12
    assert shown - OFFERED == set()


def test_the_plots_show_numbers_that_are_sent() -> None:
    planner = Planner(MemoryRouter().bus("planner"), PlannerConfig())
    perception = PerceptionTelemetry(started_s=0.0)
    perception.frame_done(1.0, encode_ms=1.0, frame_age_ms=2.0)
    perception.detection_done(1.0)
    metrics = {
        "perception": perception.timings,
        "mapper": MapperTelemetry().metrics(1.0, Counters()),
        "planner": planner.health().metrics or {},
    }
    planner.close()
    for path in paths():
        topic, *fields = path.split(".")
        assert fields[0] in topics.JSON[topic], path
        if fields[0] == "metrics":
            assert fields[1] in metrics[topic.rpartition("/")[2]], path


def test_the_page_names_what_is_offered() -> None:
    named = set(TOPIC.findall(PAGE.read_text(encoding="utf-8")))
    services = {topic for topic in OFFERED if topic.startswith("/services/")}
    assert OFFERED - services <= named
    assert named <= OFFERED | {"/services/"}


def test_json_messages_have_the_fields_of_their_schema() -> None:
    now_ns = STREAM + 2 * 10**9
    sent = {
        topics.MOTION: topics.speed(fakes.odometry(0.0, 0.0)),
        topics.MAP_STATE: topics.map_state(fakes.revision(3), now_ns),
        topics.SEARCH: topics.search_state(fakes.search()),
        topics.service_topic("mapper"): topics.service_state(fakes.heartbeat("mapper")),
    }
    for topic, document in sent.items():
        assert set(document) == set(topics.json_schema(topic)["properties"]), topic
        json.dumps(document)
    assert sent[topics.MAP_STATE]["age_s"] == 2.0
    assert sent[topics.SEARCH]["target"] == "sofa"
