"""The state as one JSON document."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np

from onemap_gateway.bus.live_state import LiveState
from onemap_gateway.present.live import build_overlay, live_document
from onemap_gateway.present.service_status import PipelineFault
from tests.gateway import fakes
from tests.gateway.fakes import STAMP_NS, full_state


def test_the_live_document_is_json_and_whole() -> None:
    document = live_document(
        full_state(), PipelineFault("robot", "Silent."), now_s=1.5, now_ns=STAMP_NS, with_trail=True
    )
    assert json.loads(json.dumps(document, allow_nan=False)) == document
    assert document["ready"] is False
    assert document["problem"] == "Silent."
    assert document["robot"]["yaw_rad"] == 0.5
    assert document["trail_m"] == [[1.0, 2.0]]
    assert document["map"]["objects_version"] == 4
    assert document["camera"]["detections"][0]["name"] == "sofa"
    assert document["path"]["points_m"] == [[1, 2], [3, 4]]
    assert document["search"]["results"][0]["position_m"] == [1.0, 2.0, 0.4]


def test_nan_scores_do_not_break_the_live_document() -> None:
    path = replace(fakes.planned_path((0, 0)), frontier_scores=np.array([np.nan], np.float32))
    state = LiveState().with_message(path, 1.0)
    document = live_document(state, None, now_s=1.0, now_ns=STAMP_NS, with_trail=False)
    assert document["path"]["frontier_scores"] == [None]
    json.dumps(document, allow_nan=False)


def test_the_live_document_has_the_latencies_of_late() -> None:
    state = LiveState().with_message(fakes.rgbd(), 1.0).with_message(fakes.command(), 1.4)
    document = live_document(state, None, now_s=2.0, now_ns=STAMP_NS, with_trail=False)
    expected = {"stage": "command", "p50_s": 0.4, "p95_s": 0.4, "count": 1}
    assert document["latencies"] == [expected]


def test_the_live_document_of_nothing_says_what_is_missing() -> None:
    document = live_document(LiveState(), None, now_s=0.0, now_ns=STAMP_NS, with_trail=False)
    for part in ("robot", "map", "camera", "path", "search", "trail_m"):
        assert document[part] is None
    assert all(service["condition"] == "down" for service in document["services"])


def test_an_overlay_holds_what_the_state_has() -> None:
    overlay = build_overlay(full_state(), 1.0)
    np.testing.assert_allclose(overlay.robot, (1.0, 2.0, 0.5))
    np.testing.assert_allclose(overlay.path_m, [(1, 2), (3, 4)])
    assert overlay.found == (("sofa", 1.0, 2.0),)
    assert len(overlay.frontiers_m) == 1


def test_an_overlay_of_nothing_is_empty() -> None:
    overlay = build_overlay(LiveState(), 0.0)
    assert not overlay.robot
    assert not overlay.found
    assert len(overlay.path_m) == len(overlay.trail_m) == 0
