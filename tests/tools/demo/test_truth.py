"""Results compared with the ground truth: category, positions and verdict."""

from __future__ import annotations

from dataclasses import replace
from math import inf, isnan
from typing import Any

import pytest

from onemap_perception.encoders.mini import SHIPPED
from onemap_perception.text.vocabulary import load_vocabulary
from onemap_shared.messages import Truth
from onemap_tools.demo.truth import Position, evaluate_result, scene_category

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


def test_without_positions_no_truth_is_requested() -> None:
    item = evaluate_result(
        result(start_xy_m=None, end_xy_m=None, position_m=None), "sofa", apartment_truth
    )
    assert isnan(item.shortest_path_m)
    assert isnan(item.goal_distance_m)
    assert item.nearest == ""


def test_a_claim_of_an_absent_object_is_wrong() -> None:
    assert evaluate_result(result(), "toilet", apartment_truth).claimed_wrongly


def test_an_unnamed_object_of_a_file_is_not_judged() -> None:
    item = evaluate_result(result(), "toilet", scene_file_truth)
    assert not item.judged
    assert item.counts_as_found
    assert not item.claimed_wrongly


def test_a_named_object_of_a_file_is_judged() -> None:
    assert evaluate_result(result(), "sofa", scene_file_truth).success
    assert evaluate_result(result(end_xy_m=[0.5, 0.0]), "sofa", scene_file_truth).claimed_wrongly


def test_without_a_reply_nothing_is_judged() -> None:
    item = evaluate_result(result(), "sofa", lambda name, place_m: None)
    assert not item.judged
    assert item.counts_as_found
    assert not evaluate_result(
        result(outcome="not_found"), "sofa", lambda name, place_m: None
    ).counts_as_found
