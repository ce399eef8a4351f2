"""Messages as clients get them: replies, answers in words, the live document, metrics."""

from __future__ import annotations

import io
import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from prometheus_client.parser import text_string_to_metric_families

from onemap import replies
from onemap.replies import ObjectOutcome, Reply, SearchSnapshot
from onemap_gateway.bus.live_state import LiveState
from onemap_gateway.http.reply_docs import CLOSED_LISTS, EXAMPLES
from onemap_gateway.present.formats import finite, json_text
from onemap_gateway.present.live import build_overlay, live_document
from onemap_gateway.present.metrics import RequestCounter, exposition
from onemap_gateway.present.queries import no_match_message, query_result, verdict_sentence
from onemap_gateway.present.replies import (
    age_s,
    map_archive,
    map_object,
    map_statistics,
    search_snapshot,
)
from onemap_gateway.present.service_status import PipelineFault
from onemap_shared.messages import (
    NO_CHOICE,
    Coverage,
    FailureCode,
    MapVerdict,
    ObjectResult,
    SearchKind,
    SearchOrder,
    SearchState,
    SimilarityReply,
    SimilarityRequest,
    VelocityCommand,
    Verdict,
)
from onemap_shared.transport import Counters
from tests.gateway import fakes
from tests.gateway.fakes import STAMP_NS, FakeMapper, full_state, kept_object, search_view
from tests.memory_bus import MemoryRouter

FOUND = replace(
    fakes.find_result("sofa", 1, 2), frame_ns=2**60 + 1, box_px=(1.0, 2.0, 3.0, 4.0), cells=7
)
NUMBERS = st.floats(allow_nan=True, allow_infinity=True) | st.integers() | st.text() | st.none()
DOCUMENTS: st.SearchStrategy[Any] = st.recursive(
    NUMBERS, lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner) | st.tuples(inner)
)


def test_an_age_is_never_negative_and_never_of_nothing() -> None:
    assert age_s(STAMP_NS, STAMP_NS + 2_000_000_000) == 2.0
    assert age_s(STAMP_NS + 5, STAMP_NS) == 0.0
    assert age_s(0, STAMP_NS) is None


def test_the_clock_of_a_search_stops_at_its_end() -> None:
    later_ns = STAMP_NS + 60_000_000_000
    assert search_snapshot(fakes.search(), later_ns).elapsed_s == 60
    ended = fakes.search(state=SearchState.FOUND, updated_ns=STAMP_NS + 5_000_000_000)
    assert search_snapshot(ended, later_ns).elapsed_s == 5
    assert search_snapshot(ended, later_ns).target == ""


def test_the_times_of_a_search_lose_nothing_in_javascript() -> None:
    document = search_snapshot(
        fakes.search(updated_ns=STAMP_NS + 12_400_000_001), STAMP_NS
    ).document
    assert document["started_at"] == "2026-01-01T00:00:00.000Z"
    assert document["updated_at"] == "2026-01-01T00:00:12.400Z"
    assert document["started_ns"] == str(STAMP_NS)
    assert document["updated_ns"] == "1767225612400000001"


def test_lengths_are_rounded_to_millimetres() -> None:
    result = replace(
        fakes.find_result("sofa", float(np.float32(2.35)), -1.10004), path_length_m=3.14159
    )
    status = replace(fakes.search(), results=(result,), path_length_m=2.71828)
    report = search_snapshot(status, STAMP_NS)
    assert report.path_length_m == 2.718
    assert report.results[0].position_m == (2.35, -1.1, 0.4)
    assert report.results[0].end_xy_m == (2.35, -1.1)
    assert report.results[0].path_length_m == 3.142


def test_a_drive_has_a_place_and_a_result_without_name_and_object() -> None:
    here = (1.02, -2.49)
    result = ObjectResult("", SearchState.ARRIVED, "there", (), 0.0, 9.0, 4.0, (0.0, 0.0), here)
    status = replace(
        fakes.search(state=SearchState.ARRIVED, objects=()),
        kind=SearchKind.GO_TO,
        place_m=(1.0, -2.5),
        results=(result,),
    )
    report = search_snapshot(status, STAMP_NS)
    assert (report.kind, report.place_m, report.objects) == (SearchKind.GO_TO, (1.0, -2.5), ())
    (shown,) = report.results
    assert (shown.name, shown.outcome, shown.position_m) == ("", SearchState.ARRIVED, None)
    assert shown.end_xy_m == here


def test_results_are_in_the_order_of_the_request() -> None:
    results = tuple(
        ObjectResult(name, SearchState.FOUND, "", (1.0, 2.0, 0.5), 0.9, seconds, 1.0, (), ())
        for name, seconds in (("bed", 3.0), ("cup", 4.0))
    )
    status = replace(
        fakes.search(objects=("cup", "sofa", "bed")), order=SearchOrder.ANY, results=results
    )
    report = search_snapshot(status, STAMP_NS)
    assert [(each.name, each.duration_s) for each in report.results] == [("cup", 4.0), ("bed", 3.0)]
    assert report.order == "any"


def report(state: SearchState, *results: ObjectResult) -> SearchSnapshot:
    return search_snapshot(replace(fakes.search(state=state), results=results), fakes.STAMP_NS)


def only(state: SearchState, result: ObjectResult) -> ObjectOutcome:
    return report(state, result).results[0]


def test_a_failure_has_its_code() -> None:
    stuck = replace(FOUND, outcome=SearchState.FAILED, reason_code=FailureCode.STUCK)
    document = report(SearchState.FAILED, FOUND, stuck).model_dump(mode="json")
    assert document["reason_code"] == "stuck"
    assert [result["reason_code"] for result in document["results"]] == [None, "stuck"]
    assert report(SearchState.EXPLORING, stuck).reason_code is None


def test_not_found_says_what_was_covered() -> None:
    coverage = Coverage(8.12345, 10.0, 1.5, (1.0, 2.0), 0.4)
    missed = replace(FOUND, outcome=SearchState.NOT_FOUND, coverage=coverage)
    covered = only(SearchState.NOT_FOUND, missed).coverage
    assert covered is not None
    assert covered.model_dump() == {
        "explored_m2": 8.123,
        "free_m2": 10.0,
        "unreachable_m2": 1.5,
        "best_match_m": (1.0, 2.0),
        "best_score": 0.4,
    }
    blank = only(SearchState.NOT_FOUND, replace(missed, coverage=Coverage())).coverage
    assert blank is not None
    assert blank.best_match_m is None
    assert only(SearchState.FOUND, FOUND).coverage is None


def test_found_says_in_what() -> None:
    evidence = only(SearchState.FOUND, FOUND).evidence
    assert evidence is not None
    assert evidence.model_dump() == {
        "frame_ns": 2**60 + 1,
        "box_px": (1.0, 2.0, 3.0, 4.0),
        "cells": 7,
    }
    cancelled = replace(FOUND, outcome=SearchState.CANCELLED)
    assert only(SearchState.CANCELLED, cancelled).evidence is None


def test_a_choice_is_reported_in_decimals_that_people_read() -> None:
    report = search_snapshot(replace(fakes.search(), choice=fakes.CHOICE), fakes.STAMP_NS).choice
    assert report is not None
    assert (report.number, report.left_out) == (2, 3)
    assert report.document["options"][0] == {
        "kind": "frontier",
        "xy_m": [0.6, 0.4],
        "score": 0.556,
        "travel_m": 1.235,
        "utility": 0.52,
        "chosen": True,
    }
    undecided = replace(fakes.search(), choice=replace(NO_CHOICE, number=7))
    assert search_snapshot(undecided, fakes.STAMP_NS).choice is None


def test_areas_are_square_metres() -> None:
    info = map_statistics(search_view(), fakes.revision(7), STAMP_NS)
    assert np.isclose(info.free_m2, 3.0)
    assert np.isclose(info.occupied_m2, 0.15)
    assert np.isclose(info.observed_m2, 3.15)
    assert info.frames_fused == 7
    assert map_statistics(search_view(), None, STAMP_NS).encoder_id == ""


def test_the_archive_needs_no_pickle_and_keeps_every_value() -> None:
    view = search_view("sofa")
    with np.load(io.BytesIO(map_archive(view)), allow_pickle=False) as archive:
        np.testing.assert_array_equal(archive["occupancy"], view.occupancy)
        np.testing.assert_array_equal(archive["layers"], view.layers)
        np.testing.assert_array_equal(archive["similarity"], view.similarity)
        np.testing.assert_allclose(archive["origin_m"], (-1.0, -0.5))
        assert float(archive["cell_size_m"]) == 0.1
        assert int(archive["revision"]) == 7
        assert int(archive["stamp_ns"]) == STAMP_NS
        assert str(archive["text"]) == "sofa"


def test_an_object_has_its_place_in_millimetres_and_its_times_twice() -> None:
    kept = replace(kept_object(), position_m=(3.42049, -1.1499, 0.41), last_seen_ns=STAMP_NS + 1)
    assert map_object(kept).document == {
        "id": "3f9a12c4",
        "name": "bed",
        "position_m": [3.42, -1.15, 0.41],
        "extent_m": [2.5, -2.1, 4.4, -0.3],
        "height_m": [0.1, 0.7],
        "score": 0.93,
        "times_found": 2,
        "search_id": "s1",
        "first_found_at": "2026-01-01T00:00:00.000Z",
        "first_found_ns": "1767225600000000000",
        "last_seen_at": "2026-01-01T00:00:00.000Z",
        "last_seen_ns": "1767225600000000001",
        "box_px": [4.0, 6.0, 20.0, 18.0],
        "picture": "/v1/objects/3f9a12c4.jpg",
    }


@pytest.mark.parametrize("name", EXAMPLES)
def test_the_examples_of_the_documentation_are_replies(name: str) -> None:
    model: type[Reply] = getattr(replies, name)
    for example in EXAMPLES[name]:
        assert model.of(example).model_dump(mode="json") == example


def test_the_closed_lists_are_of_members_that_replies_have() -> None:
    for name, fields in CLOSED_LISTS.items():
        assert fields.keys() <= getattr(replies, name).model_fields.keys()


def refuse(constant: str) -> None:
    raise AssertionError(f"{constant} is no JSON")


@given(DOCUMENTS)
def test_every_document_becomes_json_that_every_reader_takes(document: Any) -> None:
    text = json_text(document)
    assert text.isascii()
    json.loads(text, parse_constant=refuse)


def test_what_json_lacks_is_null_and_the_rest_stays() -> None:
    assert finite({"a": (float("nan"), [float("-inf")])}) == {"a": [None, [None]]}
    assert finite([1.5, -2, "NaN", True, None]) == [1.5, -2, "NaN", True, None]


def nothing(floor: float, nearest: tuple[str, ...]) -> SimilarityReply:
    none = np.zeros((0, 4), np.float32)
    return SimilarityReply(
        text="yeti",
        revision=1,
        stamp_ns=1,
        encoder_id="e",
        centres_m=none[:, :2],
        extents_m=none,
        scores=none[:, 0],
        variances=none[:, 0],
        grid=fakes.GRID,
        scores_grid=np.zeros((0, 0), np.float32),
        floor=floor,
        nearest=nearest,
    )


def test_an_empty_reply_has_the_best_score_and_near_words() -> None:
    assert no_match_message(nothing(0.0, ())) == "Nothing on the map looks like 'yeti'."
    assert no_match_message(nothing(0.3, ())).endswith(
        "the best score is 0.00, and answers begin at 0.30."
    )
    assert no_match_message(nothing(0.0, ("bed",))).endswith("'yeti'. Did you mean 'bed'?")


@pytest.fixture
def sofa() -> SimilarityReply:
    return FakeMapper(MemoryRouter()).similarity(SimilarityRequest("sofa"))


def test_a_region_has_outline_view_and_time_or_null(sofa: SimilarityReply) -> None:
    first, second = query_result(sofa, STAMP_NS).regions
    assert first.outline_m == ((0.2, 1.0), (0.5, 1.0), (0.5, 1.3))
    assert first.last_seen_at == "2026-01-01T00:00:00.000Z"
    assert first.best_view is not None
    assert (first.best_view.x_m, first.best_view.yaw_rad) == (1.0, 0.5)
    assert (second.outline_m, second.last_seen_at, second.best_view) == ((), None, None)
    assert (first.height_m, second.height_m) == ((0.1, 0.9), None)


def test_a_verdict_says_how_much_was_looked_at(sofa: SimilarityReply) -> None:
    reply = query_result(sofa, STAMP_NS)
    assert reply.verdict == "found"
    assert reply.looked.share == 0.75
    assert (reply.looked.frontiers, reply.looked.frontier_m) == (1, (1.5, 0.5))


@pytest.mark.parametrize(
    ("verdict", "said"),
    [
        (MapVerdict(Verdict.FOUND, 6, 2), "'sofa' is at (0.35, 1.15) m, with the score 0.90."),
        (
            MapVerdict(Verdict.NOT_HERE, 9.96, 0.04),
            "'sofa' is not here: 99 % of the reachable area was looked at, and the best score is "
            "0.90.",
        ),
        (
            MapVerdict(Verdict.NOT_LOOKED_YET, 6, 2, 1, (1.5, 0.5)),
            "'sofa' was not seen, but only 75 % of the reachable area was looked at; look behind "
            "the frontier at (1.50, 0.50) m next.",
        ),
        (
            MapVerdict(Verdict.NOT_LOOKED_YET),
            "'sofa' was not seen, but only 0 % of the reachable area was looked at.",
        ),
    ],
)
def test_a_verdict_in_words(sofa: SimilarityReply, verdict: MapVerdict, said: str) -> None:
    assert verdict_sentence(replace(sofa, verdict=verdict)) == said


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


def samples(state: LiveState, requests: RequestCounter | None = None) -> dict[str, float]:
    """Every sample by its name and labels, read as Prometheus would."""
    counters = {"rgbd": Counters(received=5, refused=1)}
    text = exposition(state, counters, requests or RequestCounter(), 10.0).decode()
    return {
        " ".join([name, *(f"{key}={value}" for key, value in sorted(labels.items()))]): number
        for family in text_string_to_metric_families(text)
        for name, labels, number, *_ in family.samples
    }


def test_what_runs_and_what_not() -> None:
    state = LiveState().with_alive(frozenset({"mapper"}), 0.0)
    state = state.with_message(fakes.heartbeat("mapper"), 9.0)
    found = samples(state)
    assert found["onemap_up service=mapper"] == 1
    assert found["onemap_up service=planner"] == 0
    assert found["onemap_heartbeat_age_seconds service=mapper"] == 1


def test_a_services_own_metrics_carry_its_name() -> None:
    state = LiveState().with_message(fakes.heartbeat("mapper"), 9.0)
    assert samples(state)["onemap_mapper_frames_per_second"] == 9.5


def test_messages_are_counted_by_what_became_of_them() -> None:
    found = samples(LiveState())
    assert found["onemap_bus_messages_total outcome=received stream=rgbd"] == 5
    assert found["onemap_bus_messages_total outcome=refused stream=rgbd"] == 1


def test_requests_are_counted() -> None:
    requests = RequestCounter()
    requests.count("GET", "/healthz", 200)
    requests.count("GET", "/healthz", 200)
    found = samples(LiveState(), requests)
    assert found["onemap_http_requests_total method=GET route=/healthz status=200"] == 2


def test_the_map_in_numbers() -> None:
    state = LiveState().with_message(fakes.revision(3), 1.0)
    state = state.with_message(fakes.revision(4), 8.0)
    found = samples(state)
    assert found["onemap_map_idle_seconds"] == 2
    assert found["onemap_map_frames_fused"] == 4


def test_latencies_of_frames_are_a_histogram() -> None:
    state = LiveState().with_message(fakes.revision(3), 0.5)
    for message, now_s in ((fakes.rgbd(), 1.0), (fakes.revision(4), 1.25)):
        state = state.with_message(message, now_s)
    state = state.with_message(fakes.detections("sofa"), 1.5)
    for command in (VelocityCommand(1, 2, 0.1, 0.0), fakes.command(), fakes.command()):
        state = state.with_message(command, 1.75)
    found = samples(state)
    assert found["onemap_frame_latency_seconds_sum stage=command"] == 0.75
    assert found["onemap_frame_latency_seconds_count stage=command"] == 1
    assert found["onemap_frame_latency_seconds_bucket le=0.2 stage=map"] == 0
    assert found["onemap_frame_latency_seconds_bucket le=0.3 stage=map"] == 1
    assert found["onemap_frame_latency_seconds_count stage=detections"] == 1
    assert found["onemap_frame_latency_seconds_sum stage=detections"] == 0.5
