"""Requests, status and path of a search."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from onemap_shared.messages import (
    FINAL_STATES,
    PlannedPath,
    SearchKind,
    SearchList,
    SearchOrder,
    SearchRequest,
    SearchStatus,
    subject_of,
)
from tests.shared.messages.broken import assert_refused, sample


def test_a_search_has_1_to_20_readable_objects() -> None:
    assert_refused(SearchRequest, "between 1 and 20", objects=())
    assert_refused(SearchRequest, "between 1 and 20", objects=("sofa",) * 21)
    assert_refused(SearchRequest, "object name is empty", objects=("sofa", " "))


@pytest.mark.parametrize("patience_s", [0.0, -1.0, float("nan")])
def test_a_caller_waits_for_some_time(patience_s: float) -> None:
    assert_refused(SearchRequest, "patience_s", patience_s=patience_s)


@pytest.mark.parametrize("value", [-1.0, float("nan"), float("inf")])
@pytest.mark.parametrize("name", ["max_distance_m", "max_time_s"])
def test_a_limit_is_a_number_or_none(name: str, value: float) -> None:
    assert_refused(SearchRequest, f"{name} is {value}; it must be 0 or more", **{name: value})


def test_a_status_has_its_target_while_active() -> None:
    status = sample(SearchStatus)
    assert (status.active, status.target) == (True, "bed")
    for state in FINAL_STATES:
        ended = dataclasses.replace(status, state=state)
        assert (ended.active, ended.target) == (False, "")


def test_a_status_names_readable_objects() -> None:
    assert_refused(SearchStatus, "object name holds no readable word", objects=("12",))


def test_a_list_holds_each_search_once() -> None:
    status = sample(SearchStatus)
    assert_refused(SearchList, "listed twice", searches=(status, status))
    assert_refused(SearchList, "left_out is -1", left_out=-1)


def test_a_path_has_a_score_for_each_frontier_and_region() -> None:
    one = np.zeros(1, np.float32)
    assert_refused(PlannedPath, "frontier_scores has shape", frontier_scores=one)
    assert_refused(PlannedPath, "region_scores has shape", region_scores=one)
    nan = np.full((1, 2), np.nan, np.float32)
    assert_refused(PlannedPath, "points_m contains", points_m=nan)
    assert_refused(PlannedPath, "look_m is", look_m=(1.0,))
    assert_refused(PlannedPath, "look_m is", look_m=(1.0, float("inf")))
    assert_refused(PlannedPath, "motion is 'fly'", motion="fly")


PLACES = (SearchKind.GO_TO, SearchKind.LOOK_AT)


@pytest.mark.parametrize("kind", PLACES)
def test_a_drive_has_a_place_and_no_objects(kind: SearchKind) -> None:
    request = SearchRequest((), kind=kind, place_m=(1.0, -2.5))
    assert request.objects == ()
    with pytest.raises(ValueError, match="has objects; it has only a place"):
        SearchRequest(("sofa",), kind=kind, place_m=(1.0, -2.5))


@pytest.mark.parametrize(
    ("place_m", "reason"),
    [
        ((), "has 0 numbers"),
        ((1.0, 2.0, 3.0), "has 3 numbers"),
        ((float("nan"), 0.0), "within 100000 m"),
        ((0.0, float("-inf")), "within 100000 m"),
        ((1.1e5, 0.0), "are their units metres"),
    ],
)
def test_a_place_is_finite_and_not_far_from_the_origin(
    place_m: tuple[float, ...], reason: str
) -> None:
    with pytest.raises(ValueError, match=reason):
        SearchRequest((), kind=SearchKind.GO_TO, place_m=place_m)
    assert_refused(SearchStatus, reason, kind=SearchKind.LOOK_AT, place_m=place_m)


def test_a_search_for_objects_has_no_place() -> None:
    assert_refused(SearchRequest, "has only objects", place_m=(1.0, 2.0))


def test_a_drive_is_for_its_place() -> None:
    status = sample(SearchStatus)
    assert status.subject == "'bed'"
    drive = dataclasses.replace(status, objects=(), kind=SearchKind.GO_TO, place_m=(1.0, -2.5))
    assert (drive.target, drive.subject) == ("", "the place (1.00, -2.50)")
    assert subject_of("", (1.0, -2.5)) == drive.subject


def test_a_request_and_a_status_of_an_older_peer_are_in_the_given_order() -> None:
    assert SearchRequest(("sofa",)).order is sample(SearchStatus).order is SearchOrder.GIVEN


def test_each_object_has_its_own_result_in_whatever_order_they_ended() -> None:
    status = sample(SearchStatus)
    bed, first, second = (
        dataclasses.replace(status.results[0], name=name, reason=reason)
        for name, reason in (("bed", "1"), ("cup", "2"), ("cup", "3"))
    )
    objects = ("cup", "sofa", "bed", "cup")
    status = dataclasses.replace(status, objects=objects, index=1, results=(bed, first, second))
    assert [status.result_of(index) for index in range(4)] == [first, None, bed, second]
