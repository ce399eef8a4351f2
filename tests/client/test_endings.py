"""How the search for an object ended, as the client gives it."""

from __future__ import annotations

from onemap import FindEvidence, ObjectOutcome, SearchCoverage, SearchSnapshot

COVERAGE = {
    "explored_m2": 8,
    "free_m2": 10,
    "unreachable_m2": 1.5,
    "best_match_m": [1, 2],
    "best_score": 0.4,
}
OUTCOME = {"name": "sofa", "outcome": "not_found"}
REPORT = {"id": "s1", "state": "failed", "objects": [], "results": []}


def test_an_object_that_was_not_found_has_its_coverage() -> None:
    outcome = ObjectOutcome.of({**OUTCOME, "coverage": COVERAGE, "evidence": None})
    assert outcome.coverage == SearchCoverage(8.0, 10.0, 1.5, (1.0, 2.0), 0.4)
    assert (outcome.evidence, outcome.reason_code) == (None, "")
    assert SearchCoverage.of({**COVERAGE, "best_match_m": None}).best_match_m is None
    assert ObjectOutcome.of(OUTCOME).coverage is None


def test_an_object_that_was_found_has_its_evidence() -> None:
    evidence = {"frame_ns": "1152921504606846977", "box_px": [1, 2, 3, 4], "cells": 7}
    found = ObjectOutcome.of({**OUTCOME, "outcome": "found", "evidence": evidence})
    assert found.evidence == FindEvidence(1152921504606846977, (1.0, 2.0, 3.0, 4.0), 7)
    assert FindEvidence.of({**evidence, "box_px": None}).box_px is None


def test_a_failure_has_its_code() -> None:
    assert ObjectOutcome.of({**OUTCOME, "reason_code": "stuck"}).reason_code == "stuck"
    assert SearchSnapshot.of({**REPORT, "reason_code": "stuck"}).reason_code == "stuck"
    assert SearchSnapshot.of(REPORT).reason_code == ""
