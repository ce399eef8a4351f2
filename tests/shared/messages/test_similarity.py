"""Requests for similar regions and the replies are checked when they are built."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from onemap_shared.messages import AnsweredQuery, SimilarityReply, SimilarityRequest
from tests.shared.messages.broken import assert_refused


@pytest.mark.parametrize("count", [0, 101])
def test_a_query_asks_for_1_to_100_regions(count: int) -> None:
    assert_refused(SimilarityRequest, "max_regions", max_regions=count)


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"best_score": -0.1}, "best_score is -0.1"),
        ({"floor": 2.0}, "floor is 2.0"),
        ({"variances": np.zeros(3, np.float32)}, "variances has shape"),
        ({"last_seen_ns": np.zeros(3, np.int64)}, "last_seen_ns has shape"),
        ({"best_views": np.zeros((2, 2), np.float32)}, "best_views has shape"),
        ({"heights_m": np.zeros((2, 3), np.float32)}, "heights_m has shape"),
        ({"outline_points_m": np.zeros((3, 2), np.float32)}, "outline_points_m has shape"),
        ({"outline_owner": np.array([0, 1, 2, 2], np.int32)}, "beyond the 2 there are"),
    ],
)
def test_a_damaged_reply_is_refused(changes: dict[str, Any], reason: str) -> None:
    assert_refused(SimilarityReply, reason, **changes)


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"text": ""}, "text is empty"),
        ({"negatives": ("bed",) * 11}, "at most 10"),
        ({"area_m": (0.0, 1.0)}, "give x_min, y_min"),
        ({"best_score": 1.5}, "best_score is 1.5"),
        ({"centre_m": (1.0,)}, "centre_m"),
        ({"centre_m": (1.0, float("nan"))}, "centre_m"),
    ],
)
def test_a_damaged_record_of_a_query_is_refused(changes: dict[str, Any], reason: str) -> None:
    assert_refused(AnsweredQuery, reason, **changes)


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"negatives": ("",)}, "negative is empty"),
        ({"negatives": ("bed",) * 11}, "at most 10"),
        ({"area_m": (0.0, 1.0)}, "give x_min, y_min"),
        ({"area_m": (0.0, 0.0, 1.0, float("nan"))}, "give x_min, y_min"),
        ({"area_m": (0.0, 0.0, 1.0, 1e6)}, "give x_min, y_min"),
        ({"area_m": (1.0, 0.0, 1.0, 1.0)}, "x_min < x_max"),
        ({"robot_xy_m": (1.0,)}, "robot_xy_m"),
        ({"robot_xy_m": (1.0, float("inf"))}, "robot_xy_m"),
    ],
)
def test_a_request_that_cannot_be_answered_is_refused(changes: dict[str, Any], reason: str) -> None:
    assert_refused(SimilarityRequest, reason, **changes)
