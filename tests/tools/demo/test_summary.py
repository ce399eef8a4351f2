"""Success, SPL and the JSON of values that are not finite."""

from __future__ import annotations

import json
from math import inf, nan

import pytest
from hypothesis import given
from hypothesis import strategies as st

from onemap_simulator.ground_truth import SUCCESS_TOLERANCE_M
from onemap_tools.demo.summary import (
    DemoSummary,
    ObjectSummary,
    RobotSummary,
    in_order,
    json_value,
    path_efficiency,
    total_contacts,
)

lengths = st.floats(min_value=0, max_value=1e4)


def item(
    *,
    outcome: str = "found",
    away_m: float = 0.0,
    driven_m: float = 10.0,
    shortest_m: float = 5.0,
    name: str = "sofa",
    judged: bool = True,
) -> ObjectSummary:
    return ObjectSummary(
        name,
        outcome,
        "because",
        (1.0, 2.0, 0.4),
        12.0,
        driven_m,
        shortest_m,
        0.9,
        away_m,
        judged=judged,
    )


def summary(*objects: ObjectSummary, wanted: int | None = None, failure: str = "") -> DemoSummary:
    others = max((wanted or 0) - len(objects), 0)
    names = (*(each.name for each in objects), *(f"object {n}" for n in range(others)))
    return DemoSummary(names, objects, 60.0, 50.0, 5.0, failure)


def test_found_and_near_enough_is_success() -> None:
    assert item(away_m=0.0).success
    assert item(away_m=SUCCESS_TOLERANCE_M).success
    assert not item(away_m=SUCCESS_TOLERANCE_M + 0.01).success
    assert not item(outcome="not_found", away_m=0.0).success


def test_without_ground_truth_there_is_no_success() -> None:
    assert not item(away_m=nan).success
    assert not item(away_m=inf).success


def test_spl_is_shortest_over_driven_for_successes_only() -> None:
    assert item(driven_m=10, shortest_m=5).spl == 0.5
    assert item(driven_m=4, shortest_m=5).spl == 1.0
    assert item(outcome="failed").spl == 0.0


def test_a_robot_that_starts_at_the_object_has_spl_1() -> None:
    assert path_efficiency(0.0, 0.0) == 1.0
    assert path_efficiency(0.0, 2.0) == 0.0


@given(shortest_m=lengths, driven_m=lengths)
def test_efficiency_is_in_0_to_1_and_falls_with_the_path(
    shortest_m: float, driven_m: float
) -> None:
    efficiency = path_efficiency(shortest_m, driven_m)
    assert 0 <= efficiency <= 1
    assert path_efficiency(shortest_m, driven_m + 1) <= efficiency


def test_the_sequence_counts_only_as_a_whole() -> None:
    good = summary(item(driven_m=10, shortest_m=5), item(driven_m=2, shortest_m=1))
    assert good.worked
    assert good.spl == pytest.approx(6 / 12)
    bad = summary(item(), item(outcome="not_found"), item())
    assert not bad.worked
    assert bad.spl == 0.0
    assert bad.found == 2
    assert bad.progress == pytest.approx(1 / 3)


def test_wrong_claims_are_counted() -> None:
    mixed = summary(item(), item(away_m=1.2), item(outcome="not_found", away_m=1.2))
    assert mixed.claimed_wrongly == 1
    document = mixed.document()
    assert document["claimed_wrongly"] == 1
    assert [entry["claimed_wrongly"] for entry in document["objects"]] == [False, True, False]


def test_without_ground_truth_claims_count_and_are_not_judged() -> None:
    unknown = item(away_m=inf, shortest_m=inf, judged=False)
    whole = summary(item(), unknown)
    assert whole.worked
    assert (whole.found, whole.judged, whole.claimed_wrongly) == (2, 1, 0)
    document = json.loads(json.dumps(whole.document(), allow_nan=False))
    assert document["spl"] is None
    assert [entry["success"] for entry in document["objects"]] == [True, None]
    assert [entry["spl"] for entry in document["objects"]] == [0.5, None]
    assert [entry["claimed_wrongly"] for entry in document["objects"]] == [False, None]


def test_without_ground_truth_a_failed_search_does_not_count() -> None:
    assert not summary(item(outcome="not_found", judged=False)).worked


def test_an_object_without_a_result_does_not_count() -> None:
    early = summary(item(), wanted=3, failure="cancelled")
    assert not early.worked
    assert early.progress == pytest.approx(1 / 3)


def test_a_failed_run_is_no_success() -> None:
    assert not summary(item(), failure="the planner died").worked
    assert not summary().worked


def test_results_of_several_robots_are_in_the_wanted_order() -> None:
    bed, desk, sofa = (item(name=name) for name in ("bed", "desk", "sofa"))
    robots = (robot(bed, sofa), robot(desk))
    assert in_order(("sofa", "desk", "bed"), robots) == (sofa, desk, bed)
    assert in_order(("sofa", "toilet", "desk", "bed"), robots) == (sofa, desk, bed)


def test_a_gap_in_the_results_ends_the_progress() -> None:
    """Another robot had gone on when the object in between was given up."""
    done = (item(name="bed"), item(name="sofa"))
    gap = DemoSummary(("bed", "desk", "sofa"), done, 60.0, 50.0, 5.0)
    assert gap.not_sought == ("desk",)
    assert gap.progress == pytest.approx(1 / 3)
    assert not gap.worked


def test_contacts_are_summed_if_all_robots_tell_theirs() -> None:
    assert total_contacts((robot(contacts=1), robot(contacts=2))) == 3
    assert total_contacts((robot(contacts=1), robot(contacts=None))) is None
    assert total_contacts(()) == 0


def test_the_document_of_a_robot_names_what_it_found() -> None:
    wrong = item(name="sofa", away_m=9.0)
    robots = (robot(item(name="bed"), wrong), robot())
    objects = in_order(("bed", "sofa"), robots)
    summed = DemoSummary(("bed", "sofa"), objects, 60.0, 50.0, 5.0, robots=robots)
    document = json.loads(json.dumps(summed.document(), allow_nan=False))
    assert document["robots"][0] == {
        "name": "r1",
        "objects": ["bed", "sofa"],
        "found": ["bed"],
        "path_length_m": 8.5,
        "search_s": 40.0,
        "contacts": 0,
    }
    assert document["closest_m"] is None  # nobody knows where they are


def robot(*objects: ObjectSummary, contacts: int | None = 0) -> RobotSummary:
    return RobotSummary("r1", objects, 8.5, 40.0, contacts)


def test_the_document_is_json_with_unknown_values() -> None:
    document = summary(item(away_m=nan, shortest_m=inf)).document()
    text = json.dumps(document, allow_nan=False)
    (only,) = json.loads(text)["objects"]
    assert only["goal_distance_m"] is None
    assert only["shortest_path_m"] is None
    assert only["position_m"] == [1.0, 2.0, 0.4]
    assert document["worked"] is False


def test_json_values_are_rounded_and_finite() -> None:
    assert json_value(1.23456789) == 1.2346
    assert json_value((1.0, nan)) == [1.0, None]
    assert json_value("text") == "text"
