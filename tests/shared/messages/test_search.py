"""Requests, status and path of a search."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from onemap_shared.messages import (
    FINAL_STATES,
    PlannedPath,
    SearchList,
    SearchRequest,
    SearchStatus,
)
from tests.shared.messages.broken import assert_refused, sample


def test_a_search_has_1_to_20_readable_objects() -> None:
    assert_refused(SearchRequest, "between 1 and 20", objects=())
    assert_refused(SearchRequest, "between 1 and 20", objects=("sofa",) * 21)
    assert_refused(SearchRequest, "object name is empty", objects=("sofa", " "))


@pytest.mark.parametrize("patience_s", [0.0, -1.0, float("nan")])
def test_a_caller_waits_for_some_time(patience_s: float) -> None:
    assert_refused(SearchRequest, "patience_s", patience_s=patience_s)


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
    assert_refused(PlannedPath, "points_m contains", points_m=np.full((1, 2), np.nan, np.float32))
