"""Finds and kept objects are checked when they are built."""

from __future__ import annotations

from typing import Any

import pytest

from onemap_shared.messages import (
    MAX_LISTED_OBJECTS,
    MAX_PICTURE_BYTES,
    KeptObject,
    ObjectFind,
    ObjectId,
    ObjectList,
    PicturedObject,
)
from onemap_shared.wire import decode, encode
from tests.shared.messages.broken import assert_refused, sample

NAN = float("nan")


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"name": " "}, "object name is empty"),
        ({"position_m": (NAN, 0.0, 0.0)}, "position_m contains NaN"),
        ({"extent_m": (0.0, 0.0, 0.0, float("inf"))}, "extent_m contains NaN or infinity"),
        ({"box_px": (1.0, 2.0)}, "box_px has 2 numbers"),
        ({"box_px": (1.0, 2.0, 3.0, NAN)}, "box_px contains NaN"),
        ({"score": 1.5}, "score is 1.5"),
        ({"search_id": "x" * 65}, "search_id has 65 characters"),
    ],
)
def test_a_wrong_find_is_refused(changes: dict[str, Any], reason: str) -> None:
    assert_refused(ObjectFind, reason, **changes)
    assert_refused(KeptObject, reason, **changes)


def test_stamps_are_nanoseconds_since_1970() -> None:
    assert_refused(ObjectFind, "stamp_ns is -1", stamp_ns=-1)
    assert_refused(KeptObject, "last_seen_ns", last_seen_ns=2**63)
    assert_refused(KeptObject, "first_found_ns", first_found_ns=-1)


def test_pictures_have_a_limit() -> None:
    huge = bytes(MAX_PICTURE_BYTES + 1)
    assert_refused(ObjectFind, "make it smaller", picture=huge)
    assert_refused(PicturedObject, "make it smaller", picture=huge)
    assert len(sample(ObjectFind).picture) > 0


def test_a_kept_object_has_an_id_and_counts() -> None:
    assert_refused(KeptObject, "no id", object_id="")
    assert_refused(ObjectId, "object_id has 65 characters", object_id="x" * 65)
    assert_refused(KeptObject, "times_found is -1", times_found=-1)
    assert_refused(KeptObject, "picture_bytes is -1", picture_bytes=-1)
    assert_refused(KeptObject, "needs 2, or none", height_m=(0.5,))
    assert_refused(KeptObject, "NaN or infinity", height_m=(0.5, float("inf")))


def test_a_list_is_limited_and_travels_with_the_longest_names() -> None:
    wordy = KeptObject(
        "f" * 64, "\U00010348" * 200, (1.5, 2.5, 3.5), (1.5, 2.5, 3.5, 4.5), 0.5, 10**9,
        "s" * 64, 2**62, 2**62, (0.5, 0.5, 0.5, 0.5), 10**6, (0.5, 0.5),
    )  # fmt: skip
    full = ObjectList((wordy,) * MAX_LISTED_OBJECTS)
    assert decode(ObjectList, encode(full)) == full
    assert_refused(ObjectList, "at most 150", objects=(wordy,) * (MAX_LISTED_OBJECTS + 1))
    assert_refused(ObjectList, "left_out is -1", left_out=-1)
