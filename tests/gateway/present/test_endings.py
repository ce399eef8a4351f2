"""How the search for an object ended, as clients get it."""

from __future__ import annotations

from dataclasses import replace

from onemap_gateway.present.replies import ObjectReport, SearchReport
from onemap_gateway.present.views import search_report
from onemap_shared.messages import Coverage, FailureCode, ObjectResult, SearchState
from tests.gateway import fakes

FOUND = replace(
    fakes.find_result("sofa", 1, 2), frame_ns=2**60 + 1, box_px=(1.0, 2.0, 3.0, 4.0), cells=7
)


def report(state: SearchState, *results: ObjectResult) -> SearchReport:
    return search_report(replace(fakes.search(state=state), results=results), fakes.STAMP_NS)


def only(state: SearchState, result: ObjectResult) -> ObjectReport:
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
        "frame_ns": str(2**60 + 1),
        "box_px": (1.0, 2.0, 3.0, 4.0),
        "cells": 7,
    }
    cancelled = replace(FOUND, outcome=SearchState.CANCELLED)
    assert only(SearchState.CANCELLED, cancelled).evidence is None
