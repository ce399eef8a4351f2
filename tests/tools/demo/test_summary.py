"""Success, SPL, the JSON of values that are not finite, and what is printed of a demo."""

from __future__ import annotations

import io
import json
from dataclasses import replace
from math import inf, nan
from typing import Any

import pytest
from rich.console import Console

from onemap_perception.config import SHIPPED
from onemap_perception.text.vocabulary import load_vocabulary
from onemap_shared.messages import Truth
from onemap_simulator.ground_truth import SUCCESS_TOLERANCE_M
from onemap_tools.demo.summary import (
    DemoSummary,
    ObjectSummary,
    RobotSummary,
    describe,
    evaluate_result,
    scene_category,
)

ITEM = ObjectSummary("sofa", "found", "because", (1.0, 2.0, 0.4), 12.0, 10.0, 5.0, 0.9, 0.0)
WRONG = replace(ITEM, goal_distance_m=1.2)
MISSED = replace(ITEM, outcome="not_found")
UNJUDGED = replace(ITEM, goal_distance_m=inf, shortest_path_m=inf, judged=False)


def summary(*objects: ObjectSummary, wanted: tuple[str, ...] = (), **others: Any) -> DemoSummary:
    robots = (RobotSummary("", objects, 8.5, 40.0, 0),)
    return DemoSummary(wanted or tuple(o.name for o in objects), robots, 60.0, 50.0, 5.0, **others)


def document_of(summary: DemoSummary) -> dict[str, Any]:
    document: dict[str, Any] = json.loads(json.dumps(summary.document(), allow_nan=False))
    return document


def test_found_and_near_enough_is_success_and_spl_is_shortest_over_driven() -> None:
    assert replace(ITEM, goal_distance_m=SUCCESS_TOLERANCE_M).success
    assert not replace(ITEM, goal_distance_m=SUCCESS_TOLERANCE_M + 0.01).success
    assert not MISSED.success
    assert ITEM.spl == 0.5
    assert replace(ITEM, path_length_m=4.0).spl == 1.0
    assert MISSED.spl == 0.0


def test_an_object_that_was_there_at_the_start_is_no_failure() -> None:
    """Its row has no SPL, and the mean is that of the other rows."""
    there = replace(ITEM, name="bed", shortest_path_m=0.0, path_length_m=0.4)
    assert there.document()["spl"] == 0.0  # a benchmark's record is a number
    both = summary(there, ITEM, replace(MISSED, name="desk"))
    assert both.object_spl == pytest.approx((0.5 + 0.0) / 2)
    assert document_of(both)["objects"][0]["spl"] is None
    (row,) = (line.split() for line in printed(both).splitlines() if line.startswith(" bed"))
    assert row[-3:] == ["-", "0.9", "m"]
    assert "SPL 0.25 per object" in flat(printed(both))
    assert "off by: straight from where the robot stopped to the nearest one" in flat(printed(both))
    assert document_of(summary(there))["object_spl"] is None


def test_wrong_claims_are_counted_and_what_is_not_finite_is_null() -> None:
    mixed = summary(ITEM, WRONG, replace(MISSED, goal_distance_m=nan, shortest_path_m=inf))
    document = document_of(mixed)
    assert document["claimed_wrongly"] == 1
    assert [entry["claimed_wrongly"] for entry in document["objects"]] == [False, True, False]
    assert document["objects"][2]["goal_distance_m"] is None
    assert document["objects"][2]["shortest_path_m"] is None
    assert document["objects"][2]["position_m"] == [1.0, 2.0, 0.4]


def test_without_ground_truth_claims_count_and_are_not_judged() -> None:
    whole = summary(ITEM, UNJUDGED)
    assert whole.worked
    assert (whole.found, whole.judged, whole.claimed_wrongly) == (2, 1, 0)
    document = document_of(whole)
    verdicts = [[o[k] for k in ("success", "spl", "claimed_wrongly")] for o in document["objects"]]
    assert verdicts == [[True, 0.5, False], [None, None, None]]


def two(contacts: int | None = 3) -> DemoSummary:
    bed = replace(ITEM, name="bed")
    robots = (
        RobotSummary("r1", (WRONG, bed), 8.5, 40.0, contacts=2),
        RobotSummary("r2", (), 22.0, 90.0, contacts),
    )
    return DemoSummary(("bed", "sofa"), robots, 60.0, 50.0, 5.0)


def test_the_document_of_a_robot_names_what_it_found() -> None:
    document = document_of(two())
    assert [item["name"] for item in document["objects"]] == ["bed", "sofa"]
    assert document["robots"][0] == {
        "name": "r1",
        "objects": ["sofa", "bed"],
        "found": ["bed"],
        "path_length_m": 8.5,
        "search_s": 40.0,
        "contacts": 2,
    }
    assert document["contacts"] == 5
    assert document_of(two(contacts=None))["contacts"] is None
    assert document_of(summary(ITEM))["robots"] == []


def printed(summary: DemoSummary, picture: str | None = None) -> str:
    console = Console(file=(output := io.StringIO()), width=80)
    describe(summary, picture, console)
    assert "…" not in output.getvalue()
    return output.getvalue()


def flat(text: str) -> str:
    return " ".join(text.split())


def test_a_row_per_object_fits_eighty_columns_and_failures_have_their_reason() -> None:
    fridge = replace(ITEM, name="refrigerator", position_m=(10.11, 10.43, 1.0), time_s=112.4)
    wrong = replace(WRONG, reason="seen [3] times", nearest="armchair")
    toilet = replace(MISSED, name="toilet", reason="searched it all", position_m=())
    wanted = ("refrigerator", "sofa", "toilet", "desk")
    text = printed(summary(fridge, wrong, toilet, wanted=wanted, failure="It ended."), "map.png")
    (row,) = (line for line in text.splitlines() if line.strip().startswith("refrigerator"))
    for part in ("found", "(10.1, 10.4)", "112 s", "10.0 m", "5.0 m", "0.50", "0.9 m"):
        assert part in row
    assert "wrong one" in text
    assert "sofa: seen [3] times (nearest to the claimed place: armchair)" in text
    assert "toilet: searched it all\n" in text
    assert "desk not sought" in flat(text)
    totals = "1 of 4 found in 50 s (60 s with starting up), 1 claimed wrongly, SPL 0.17 per object"
    assert f"{totals}, 5.0 map" in flat(text)
    assert "It ended." in text
    assert "Map, path and finds: map.png" in text


VOCABULARY = load_vocabulary(SHIPPED)
APARTMENT = ("armchair", "sofa", "wall")


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


@pytest.mark.parametrize(
    ("category", "complete", "end_x_m", "verdict"),
    [
        ("sofa", True, 2.0, "right"),
        ("sofa", True, 0.5, "wrong"),
        ("toilet", False, 2.0, "unjudged"),  # perhaps an unnamed object of a scene file
        ("sofa", False, 2.0, "right"),
        ("sofa", False, 0.5, "wrong"),
    ],
)
def test_a_claim_is_judged_by_the_truth_of_its_category(
    category: str, complete: bool, end_x_m: float, verdict: str
) -> None:
    """One sofa, with success places at x >= 2; an armchair stands beside it."""

    def truth(name: str, place_m: tuple[float, ...]) -> Truth:
        count, way_m = (1, max(2.0 - place_m[0], 0.0)) if name == "sofa" else (0, inf)
        away_m = way_m + 1.0 if count else inf
        return Truth("flat", count, away_m, way_m, APARTMENT, "armchair", complete)

    result = {
        "name": "couch",
        "outcome": "found",
        "reason": "seen",
        "position_m": [3.0, 2.0, 0.4],
        "duration_s": 12.0,
        "path_length_m": 5.0,
        "start_xy_m": [0.0, 0.0],
        "end_xy_m": [end_x_m, 2.0],
    }
    item = evaluate_result(result, category, truth)
    assert (item.name, item.nearest, item.judged) == ("couch", "armchair", verdict != "unjudged")
    assert item.counts_as_found is (verdict != "wrong")
    assert item.claimed_wrongly is (verdict == "wrong")
    if category == "sofa":
        assert (item.shortest_path_m, item.true_distance_m) == (2.0, 3.0 - end_x_m)
    assert not evaluate_result(result, category, lambda *_: None).judged
    description = evaluate_result(result, "something to sit on", truth)
    assert (description.judged, description.nearest) == (False, item.nearest)
    assert f"nearest to the claimed place: {item.nearest}" in flat(printed(summary(description)))
