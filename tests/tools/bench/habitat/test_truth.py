"""What counts as found in Habitat, under both rules."""

from __future__ import annotations

import numpy as np
import pytest

from onemap_shared.messages import ObjectResult, SearchState
from onemap_tools.bench.habitat.choices import SuccessRule
from onemap_tools.bench.habitat.coordinates import Point
from onemap_tools.bench.habitat.episode_layout import CategoryGoals
from onemap_tools.bench.habitat.truth import (
    CategoryTruth,
    SearchPlaces,
    horizontal_m,
    is_instance,
)
from onemap_tools.bench.habitat.world import AnnotatedBox
from onemap_tools.demo.summary import ObjectSummary
from tests.tools.bench.habitat.fake_world import FLOOR_Y_M, SOFA, FakeWorld

BED = AnnotatedBox(9, "bed", (1.0, FLOOR_Y_M, -1.0), (2.0, FLOOR_Y_M + 0.5, 0.0))
VIEW_POINT = (-0.5, FLOOR_Y_M, -2.6)  # 0.9 m from the sofa
GOALS = CategoryGoals(frozenset(), np.array([VIEW_POINT]))
START = (0.0, FLOOR_Y_M, 0.0)


def truth(rule: SuccessRule) -> CategoryTruth:
    return CategoryTruth.of("sofa", GOALS, (BED, SOFA), rule)


def judged(rule: SuccessRule, end: Point, claimed: Point | None = SOFA.upper) -> ObjectSummary:
    outcome = SearchState.FOUND if claimed else SearchState.NOT_FOUND
    result = ObjectResult("sofa", outcome, "", (1.0, 2.0, 0.4), 0.9, 12.0, 6.0, (0.0, 0.0), ())
    return truth(rule).judged(result, SearchPlaces(START, end, claimed), FakeWorld())


def at(x: float, z: float) -> Point:
    return (x, FLOOR_Y_M, z)


@pytest.mark.parametrize(
    ("place", "distance_m"),
    [(at(-1.0, -3.8), 0.0), (at(-1.0, -2.5), 1.0), (at(0.3, -3.1), 0.5), (at(-4.5, -3.6), 3.0)],
)
def test_distances_to_a_box_are_seen_from_above(place: Point, distance_m: float) -> None:
    assert horizontal_m(SOFA, place) == pytest.approx(distance_m)


@pytest.mark.parametrize(
    ("z", "paper", "habitat"),
    [
        (-2.6, True, True),  # on the view point
        (-2.3, True, False),  # 1.2 m from the sofa, 0.3 m from the view point
        (-2.01, True, False),  # 1.49 m
        (-1.99, False, False),  # 1.51 m
    ],
)
def test_the_paper_measures_to_the_box_and_habitat_to_a_view_point(
    z: float, *, paper: bool, habitat: bool
) -> None:
    for rule, success in ((SuccessRule.PAPER, paper), (SuccessRule.HABITAT, habitat)):
        item = judged(rule, at(-0.5, z))
        assert item.success is success
        assert item.claimed_wrongly is not success
        assert item.shortest_path_m == pytest.approx(np.hypot(0.5, 2.6))
        assert item.spl == (pytest.approx(np.hypot(0.5, 2.6) / 6) if success else 0.0)
        assert item.true_distance_m == pytest.approx(z + 3.5)


def test_a_claim_far_from_any_instance_names_what_stands_there() -> None:
    wrong = judged(SuccessRule.PAPER, at(1.5, -1.5), BED.lower)
    assert (wrong.claimed_wrongly, wrong.nearest) == (True, "bed")
    short = judged(SuccessRule.PAPER, at(-0.5, -1.5))
    assert (short.claimed_wrongly, short.nearest) == (True, "sofa")  # stopped 2 m before it
    unnoticed = judged(SuccessRule.PAPER, at(-0.5, -2.6), None)
    assert (unnoticed.success, unnoticed.claimed_wrongly, unnoticed.nearest) == (False, False, "")
    alone = CategoryTruth.of("sofa", GOALS, (SOFA,), SuccessRule.PAPER)
    assert alone._nearest("sofa", (9.0, 0.0, 9.0)) == ""


@pytest.mark.parametrize(
    ("name", "category", "counts"),
    [
        ("couch", "sofa", True),
        ("Sofa set", "sofa", True),
        ("tv", "tv_monitor", True),
        ("flower vase", "plant", True),
        ("flower vase", "bed", False),
        ("armchair", "chair", True),  # as the released evaluation compares
        ("", "chair", False),
        ("wall", "chair", False),
    ],
)
def test_names_of_annotators_count_as_in_the_released_evaluation(
    name: str, category: str, *, counts: bool
) -> None:
    box = AnnotatedBox(1, name, (0, 0, 0), (1, 1, 1))
    assert is_instance(box, category, GOALS) is counts
    assert is_instance(box, category, CategoryGoals(frozenset({1}), GOALS.view_points))


def test_without_annotations_only_habitat_s_rule_applies() -> None:
    with pytest.raises(ValueError, match=r"no annotated object .* 'sofa'.*--success habitat"):
        CategoryTruth.of("sofa", GOALS, (BED,), SuccessRule.PAPER)
    bare = CategoryTruth.of("sofa", GOALS, (), SuccessRule.HABITAT)
    assert bare.distance_m(START) == float("inf")
    assert truth(SuccessRule.HABITAT).semantic_ids == {SOFA.semantic_id}
