"""Replies of older and newer gateways, and of the messages that the gateway makes them of."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from onemap import Choice, ObjectOutcome, QueryResult, SearchSnapshot
from onemap.replies import VERDICTS, moment, rfc3339
from onemap.search_replies import FINAL_STATES, REASONS, STATES
from onemap_shared import messages

OUTCOME = {"name": "sofa", "outcome": "not_found"}
REPORT = {"id": "s1", "state": "failed", "objects": ["sofa"], "results": []}
OPTION = {
    "kind": "frontier",
    "xy_m": [1, 2],
    "score": 0.5,
    "travel_m": 3,
    "utility": 0.4,
    "chosen": True,
}
CHOICE = {"number": 2, "sentence": "the only goal", "options": [OPTION]}
LATE_NS = 1767225612400000001  # more digits than a float has


def test_members_that_an_older_gateway_leaves_out_are_empty() -> None:
    snapshot = SearchSnapshot.of(REPORT)
    assert (snapshot.kind, snapshot.place_m, snapshot.choice) == ("find", None, None)
    assert (snapshot.reason_code, snapshot.updated_ns) == (None, 0)
    assert ObjectOutcome.of(OUTCOME).coverage is None
    result = QueryResult.of({"text": "yeti", "regions": []})
    assert (result.best_score, result.message) == (0.0, "")
    assert (result.verdict, result.found, result.calibrated) == ("", False, False)
    assert (result.looked.share, result.looked.frontier_m) == (0.0, None)
    old = {"rank": 1, "centre_m": [1, 2], "extent_m": [0, 1, 2, 3], "score": 0.5}
    (region,) = QueryResult.of({"text": "yeti", "regions": [old]}).regions
    assert (region.outline_m, region.last_seen_at, region.best_view) == ((), None, None)


def test_members_and_values_of_a_newer_gateway_do_no_harm() -> None:
    newer = {"text": "yeti", "regions": [], "colour": "white", "verdict": "perhaps"}
    result = QueryResult.of(newer)
    assert (result.verdict, result.document) == ("perhaps", newer)
    assert result == QueryResult.of({**newer, "colour": "black"})
    assert SearchSnapshot.of({**REPORT, "state": "dreaming"}).state == "dreaming"


def test_a_reply_is_the_same_after_a_round_trip() -> None:
    snapshot = SearchSnapshot.of({**REPORT, "choice": CHOICE, "updated_ns": str(LATE_NS)})
    assert snapshot.updated_ns == LATE_NS
    document = snapshot.model_dump(mode="json")
    assert document["updated_ns"] == str(LATE_NS)
    assert document["updated_at"] == "2026-01-01T00:00:12.400Z"
    assert SearchSnapshot.of(document) == snapshot
    assert snapshot.choice == Choice.of(CHOICE)


def test_the_closed_lists_are_those_of_the_services() -> None:
    assert set(FINAL_STATES) == {state.value for state in messages.FINAL_STATES}
    assert set(STATES) == {state.value for state in messages.SearchState}
    assert {*REASONS, ""} == {code.value for code in messages.FailureCode}
    assert set(VERDICTS) == {verdict.value for verdict in messages.Verdict}


@given(st.integers(0, 2**62))
def test_a_time_is_cut_to_milliseconds(time_ns: int) -> None:
    text = rfc3339(moment(time_ns))
    assert (len(text), text[-1]) == (24, "Z")
    assert int(text[20:23]) == time_ns // 10**6 % 1000
