"""Messages as clients get them: replies, answers in words, the live document, metrics."""

from __future__ import annotations

import json
from dataclasses import replace
from math import pi

import numpy as np
import pytest
from prometheus_client.parser import text_string_to_metric_families

from onemap.search_replies import ObjectOutcome, SearchSnapshot
from onemap_gateway.bus.live_state import LiveState
from onemap_gateway.present.live import live_document
from onemap_gateway.present.metrics import RequestCounter, exposition
from onemap_gateway.present.queries import verdict_sentence
from onemap_gateway.present.replies import search_snapshot
from onemap_gateway.present.service_status import PipelineFault
from onemap_shared import messages as m
from onemap_shared.camera import Intrinsics
from onemap_shared.transport import Counters
from tests.gateway import fakes
from tests.gateway.fakes import STAMP_NS, FakeMapper, full_state
from tests.memory_bus import MemoryRouter

FOUND = replace(
    fakes.find_result("sofa", 1, 2), frame_ns=2**60 + 1, box_px=(1.0, 2.0, 3.0, 4.0), cells=7
)


def report(state: m.SearchState, *results: m.ObjectResult) -> SearchSnapshot:
    return search_snapshot(replace(fakes.search(state=state), results=results))


def only(state: m.SearchState, result: m.ObjectResult) -> ObjectOutcome:
    return report(state, result).results[0]


def test_not_found_says_what_was_covered_and_found_in_what() -> None:
    coverage = m.Coverage(8.12345, 10.0, 1.5, (1.0, 2.0), 0.4)
    missed = replace(FOUND, outcome=m.SearchState.NOT_FOUND, coverage=coverage)
    covered = only(m.SearchState.NOT_FOUND, missed).coverage
    assert covered is not None
    assert covered.model_dump() == {
        "explored_m2": 8.123,
        "free_m2": 10.0,
        "unreachable_m2": 1.5,
        "best_match_m": (1.0, 2.0),
        "best_score": 0.4,
    }
    found = only(m.SearchState.FOUND, FOUND)
    assert found.coverage is None
    assert found.evidence is not None
    assert found.evidence.model_dump() == {
        "frame_ns": 2**60 + 1,
        "box_px": (1.0, 2.0, 3.0, 4.0),
        "cells": 7,
    }
    cancelled = only(m.SearchState.CANCELLED, replace(FOUND, outcome=m.SearchState.CANCELLED))
    assert (cancelled.coverage, cancelled.evidence) == (None, None)


@pytest.fixture
def sofa() -> m.SimilarityReply:
    return FakeMapper(MemoryRouter()).similarity(m.SimilarityRequest("sofa"))


@pytest.mark.parametrize(
    ("verdict", "said"),
    [
        (m.MapVerdict(m.Verdict.FOUND, 6, 2), "'sofa' is at (0.35, 1.15) m."),
        (
            m.MapVerdict(m.Verdict.NOT_HERE, 9.96, 0.04),
            "'sofa' is not here: 99 % of the reachable area was looked at.",
        ),
        (
            m.MapVerdict(m.Verdict.NOT_LOOKED_YET, 6, 2, 1, (1.5, 0.5)),
            "'sofa' was not seen, but only 75 % of the reachable area was looked at; look next "
            "beyond the edge of the map at (1.50, 0.50) m.",
        ),
        (
            m.MapVerdict(m.Verdict.NOT_LOOKED_YET),
            "'sofa' was not seen, but only 0 % of the reachable area was looked at.",
        ),
    ],
)
def test_a_verdict_in_words(sofa: m.SimilarityReply, verdict: m.MapVerdict, said: str) -> None:
    assert verdict_sentence(replace(sofa, verdict=verdict), "'sofa'") == said


def test_the_live_document_is_json_and_whole() -> None:
    document = live_document(
        full_state(), PipelineFault("robot", "Silent."), now_s=1.5, now_ns=STAMP_NS, with_trail=True
    )
    assert json.loads(json.dumps(document, allow_nan=False)) == document
    assert document["ready"] is False
    assert document["problem"] == "Silent."
    assert document["robot"]["yaw_rad"] == 0.5
    assert document["robot"]["linear_mps"] == 0.3
    assert document["trail_m"] == [[1.0, 2.0]]
    assert document["map"]["objects_version"] == 4
    assert document["camera"]["detections"][0]["name"] == "sofa"
    assert document["path"]["points_m"] == [[1, 2], [3, 4]]
    assert document["search"]["results"][0]["position_m"] == [1.0, 2.0, 0.4]


def test_a_robot_that_fell_silent_shows_no_speed() -> None:
    document = live_document(full_state(), None, now_s=3.5, now_ns=STAMP_NS, with_trail=False)
    assert document["robot"]["linear_mps"] is None


def test_the_live_document_says_what_the_camera_sees() -> None:
    """A camera at (1, 2) that looks along y, and has 90 degrees in its image."""
    T_map_camera = np.eye(4)
    T_map_camera[:3, :3] = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]])  # x right, y down
    T_map_camera[:3, 3] = (1.0, 2.0, 0.8)
    frame = replace(fakes.rgbd(), intrinsics=Intrinsics(16, 16, 16, 12), T_map_camera=T_map_camera)
    state = LiveState().with_message(frame, 1.0)
    document = live_document(state, None, now_s=1.0, now_ns=STAMP_NS, with_trail=False)
    view = {"x_m": 1.0, "y_m": 2.0, "left_rad": 3 * pi / 4, "right_rad": pi / 4}
    assert document["camera"]["view"] == pytest.approx(view, abs=1e-3)


def samples(state: LiveState) -> dict[str, float]:
    """Every sample by its name and labels, read as Prometheus would."""
    counters = {"rgbd": Counters(received=5, refused=1)}
    text = exposition(state, counters, RequestCounter(), 10.0).decode()
    return {
        " ".join([name, *(f"{key}={value}" for key, value in sorted(labels.items()))]): number
        for family in text_string_to_metric_families(text)
        for name, labels, number, *_ in family.samples
    }


def test_latencies_of_frames_are_a_histogram() -> None:
    state = LiveState().with_message(fakes.revision(3), 0.5)
    for message, now_s in ((fakes.rgbd(), 1.0), (fakes.revision(4), 1.25)):
        state = state.with_message(message, now_s)
    state = state.with_message(fakes.detections("sofa"), 1.5)
    for command in (m.VelocityCommand(1, 2, 0.1, 0.0), fakes.command(), fakes.command()):
        state = state.with_message(command, 1.75)
    found = samples(state)
    assert found["onemap_frame_latency_seconds_sum stage=command"] == 0.75
    assert found["onemap_frame_latency_seconds_count stage=command"] == 1
    assert found["onemap_frame_latency_seconds_bucket le=0.2 stage=map"] == 0
    assert found["onemap_frame_latency_seconds_bucket le=0.3 stage=map"] == 1
    assert found["onemap_frame_latency_seconds_count stage=detections"] == 1
    assert found["onemap_frame_latency_seconds_sum stage=detections"] == 0.5
