"""Changes of a view are checked when they are built."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from onemap_shared.grid import GridSpec
from onemap_shared.messages import ViewChanges, ViewChangesRequest, ViewKey
from tests.shared.messages.broken import assert_refused


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"tiles": np.zeros((1, 3), np.int32)}, "tiles has shape"),
        ({"cells": np.zeros((1, 500), np.uint8)}, "cells has shape"),
        ({"cells": np.zeros((1, 512), np.uint8)}, r"occupancy has shape \(2,\); expected \(0,\)"),
        ({"layers": np.zeros(3, np.uint8)}, "layers has shape"),
        ({"values": np.zeros((1, 1), np.float32)}, "values has 1 rows; expected 0, 2 or 3"),
        ({"values": np.zeros((3, 2), np.float32)}, "values has shape"),
        ({"rank_limits": np.zeros(0, np.float32)}, "rank_limits has shape"),
        ({"grid": GridSpec(0.1, (-60, 0), (128, 192))}, "is not of whole tiles of 64 cells"),
        ({"tiles": np.array([[0, 3]], np.int32)}, "outside of the grid's, 0 to 2 on axis 1"),
        ({"tiles": np.array([[-2, 1]], np.int32)}, "outside of the grid's, -1 to 0 on axis 0"),
        (
            {
                "tiles": np.zeros((2, 2), np.int32),
                "cells": np.pad(np.full((2, 1), 128, np.uint8), ((0, 0), (0, 511))),
            },
            "there twice",
        ),
    ],
)
def test_changes_that_cannot_be_are_refused(changes: dict[str, Any], reason: str) -> None:
    assert_refused(ViewChanges, reason, **changes)


def test_a_request_for_changes_is_checked_as_one_for_a_view() -> None:
    assert ViewChangesRequest("  sofa").text == "sofa"
    assert_refused(ViewChangesRequest, "rival is empty", rivals=("",))
    assert_refused(ViewChangesRequest, "at most 30", rivals=("bed",) * 31)


def test_a_key_is_short() -> None:
    with pytest.raises(ValueError, match="query has 401 characters; the limit is 400"):
        ViewKey(query="1" * 401)
    with pytest.raises(ValueError, match="number is -1"):
        ViewKey(number=-1)
