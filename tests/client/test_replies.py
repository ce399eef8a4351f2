"""Replies of older and newer gateways."""

from __future__ import annotations

from onemap.replies import FINAL_STATES, ObjectOutcome, SearchSnapshot
from onemap_shared import messages


def test_the_final_states_are_those_of_the_planner() -> None:
    assert set(FINAL_STATES) == {state.value for state in messages.FINAL_STATES}


def test_nanoseconds_may_be_a_string() -> None:
    report = {"id": "s1", "state": "found", "objects": [], "results": []}
    late = SearchSnapshot.of({**report, "updated_ns": "1767225612400000001"})
    assert late.updated_ns == 1767225612400000001


def test_a_search_is_complete_if_every_object_was_found() -> None:
    found = {"name": "sofa", "outcome": "found", "position_m": [1, 2, 0.5]}
    report = {"id": "s1", "state": "found", "objects": ["sofa"], "results": [found]}
    assert SearchSnapshot.of(report).all_found
    assert not SearchSnapshot.of({**report, "results": []}).all_found
    assert ObjectOutcome.of(found).position_m == (1.0, 2.0, 0.5)
    assert ObjectOutcome.of({**found, "position_m": None}).position_m is None


def test_a_gateway_without_kinds_only_finds() -> None:
    report = {"id": "s1", "state": "exploring", "objects": ["sofa"], "results": []}
    snapshot = SearchSnapshot.of(report)
    assert (snapshot.kind, snapshot.place_m, snapshot.arrived) == ("find", None, False)


def test_an_outcome_says_where_the_robot_stood() -> None:
    outcome = {"name": "", "outcome": "arrived", "end_xy_m": [1.5, -2.0]}
    assert ObjectOutcome.of(outcome).end_xy_m == (1.5, -2.0)
    assert ObjectOutcome.of({**outcome, "end_xy_m": None}).end_xy_m is None
