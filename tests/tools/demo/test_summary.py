"""Success, SPL and the JSON of values that are not finite."""

from __future__ import annotations

import json
from dataclasses import replace
from math import inf, nan
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from onemap_perception.encoders.mini import SHIPPED
from onemap_perception.text.vocabulary import load_vocabulary
from onemap_shared.messages import Truth
from onemap_simulator.ground_truth import SUCCESS_TOLERANCE_M
from onemap_tools.demo.summary import (
    DemoSummary,
    ObjectSummary,
    RobotSummary,
    in_order,
    path_efficiency,
)
from onemap_tools.demo.truth import Position, evaluate_result, scene_category

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


def test_spl_is_shortest_over_driven_for_successes_only() -> None:
    assert item(driven_m=10, shortest_m=5).spl == 0.5
    assert item(driven_m=4, shortest_m=5).spl == 1.0
    assert item(outcome="failed").spl == 0.0


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


def test_a_failed_run_is_no_success() -> None:
    assert not summary(item(), failure="the planner died").worked
    assert not summary().worked


def test_a_gap_in_the_results_ends_the_progress() -> None:
    """Another robot had gone on when the object in between was given up."""
    done = (item(name="bed"), item(name="sofa"))
    gap = DemoSummary(("bed", "desk", "sofa"), done, 60.0, 50.0, 5.0)
    assert gap.not_sought == ("desk",)
    assert gap.progress == pytest.approx(1 / 3)
    assert not gap.worked


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


VOCABULARY = load_vocabulary(SHIPPED)
APARTMENT = ("armchair", "sofa", "wall")


def result(**changes: Any) -> dict[str, Any]:
    return {
        "name": "couch",
        "outcome": "found",
        "reason": "seen",
        "position_m": [3.0, 2.0, 0.4],
        "duration_s": 12.0,
        "path_length_m": 5.0,
        "start_xy_m": [0.0, 0.0],
        "end_xy_m": [2.0, 2.0],
        **changes,
    }


def apartment_truth(name: str, place_m: Position) -> Truth:
    """One sofa, with success places at x >= 2; an armchair stands beside it."""
    count, way_m = (1, max(2.0 - place_m[0], 0.0)) if name == "sofa" else (0, inf)
    away_m = way_m + 1.0 if count else inf
    return Truth("flat", count, away_m, way_m, APARTMENT, "armchair", names_complete=True)


def scene_file_truth(name: str, place_m: Position) -> Truth:
    return replace(apartment_truth(name, place_m), names_complete=False)


@pytest.mark.parametrize(
    ("word", "categories", "name"),
    [
        ("sofa", APARTMENT, "sofa"),
        ("couch", APARTMENT, "sofa"),  # an alias
        ("Sectional  Sofa", APARTMENT, "sofa"),  # a held-out synonym
        ("sofa", ("couch",), "couch"),  # a file that uses another word than mini's
        ("couch", ("couch", "sofa"), "couch"),  # the person's own word first
        ("chaise longue", APARTMENT, "sofa"),  # an alias of queries alone
        ("bed", APARTMENT, "bed"),
        ("Elephant", APARTMENT, "elephant"),
    ],
)
def test_a_word_has_a_category_of_the_scene(
    word: str, categories: tuple[str, ...], name: str
) -> None:
    assert scene_category(word, categories, VOCABULARY) == name


def test_a_synonym_is_judged_by_its_category() -> None:
    item = evaluate_result(
        result(), scene_category("couch", APARTMENT, VOCABULARY), apartment_truth
    )
    assert item.name == "couch"
    assert item.success
    assert item.shortest_path_m == 2.0
    assert item.true_distance_m == 1.0


def test_a_wrong_claim_names_the_nearest_thing() -> None:
    item = evaluate_result(result(end_xy_m=[0.5, 0.0]), "sofa", apartment_truth)
    assert item.claimed_wrongly
    assert item.goal_distance_m == 1.5
    assert item.nearest == "armchair"


def test_an_unnamed_object_of_a_file_is_not_judged() -> None:
    item = evaluate_result(result(), "toilet", scene_file_truth)
    assert not item.judged
    assert item.counts_as_found
    assert not item.claimed_wrongly


def test_a_named_object_of_a_file_is_judged() -> None:
    assert evaluate_result(result(), "sofa", scene_file_truth).success
    assert evaluate_result(result(end_xy_m=[0.5, 0.0]), "sofa", scene_file_truth).claimed_wrongly
