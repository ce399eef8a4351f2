"""Success, SPL, the JSON of values that are not finite, and claims beside the ground truth."""

from __future__ import annotations

import json
from dataclasses import replace
from math import inf, nan

import pytest

from onemap_shared.messages import Truth
from onemap_simulator.ground_truth import SUCCESS_TOLERANCE_M
from onemap_tools.judgement import ObjectSummary, evaluate_result

ITEM = ObjectSummary("sofa", "found", "because", (1.0, 2.0, 0.4), 12.0, 10.0, 5.0, 0.9, 0.0)
WRONG = replace(ITEM, goal_distance_m=1.2)
MISSED = replace(ITEM, outcome="not_found")
APARTMENT = ("armchair", "sofa", "wall")


def test_found_and_near_enough_is_success_and_spl_is_shortest_over_driven() -> None:
    assert replace(ITEM, goal_distance_m=SUCCESS_TOLERANCE_M).success
    assert not replace(ITEM, goal_distance_m=SUCCESS_TOLERANCE_M + 0.01).success
    assert not MISSED.success
    assert ITEM.spl == 0.5
    assert replace(ITEM, path_length_m=4.0).spl == 1.0
    assert MISSED.spl == 0.0
    assert [item.claimed_wrongly for item in (ITEM, WRONG, MISSED)] == [False, True, False]


def test_what_is_not_finite_or_not_judged_is_null() -> None:
    far = replace(MISSED, goal_distance_m=nan, shortest_path_m=inf)
    document = json.loads(json.dumps(far.document(), allow_nan=False))
    assert (document["goal_distance_m"], document["shortest_path_m"]) == (None, None)
    assert document["position_m"] == [1.0, 2.0, 0.4]
    unjudged = replace(ITEM, goal_distance_m=inf, judged=False)
    assert unjudged.counts_as_found
    verdicts = [unjudged.document()[key] for key in ("success", "spl", "claimed_wrongly")]
    assert verdicts == [None, None, None]


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
