"""Requests to the map and its replies are checked when they are built."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from onemap_shared.messages import (
    MAX_FILE_TEXT_CHARS,
    MAX_LISTED_MAPS,
    MAX_RIVALS,
    MapList,
    SavedMap,
    SearchView,
    SearchViewRequest,
)
from onemap_shared.wire import decode, encode
from tests.shared.messages.broken import assert_refused, sample


def test_a_view_without_text_is_of_the_layers_alone() -> None:
    assert SearchViewRequest().text == ""
    assert_refused(SearchViewRequest, "text is empty", text="  ")


def test_the_number_of_rivals_is_limited() -> None:
    names = tuple(f"name {letter}" for letter in "abcdefghijklmnopqrstuvwxyzäöüß€")
    assert len(SearchViewRequest("sofa", names[:MAX_RIVALS]).rivals) == MAX_RIVALS
    assert_refused(SearchViewRequest, "at most 30", rivals=names)


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"name": ""}, "no name"),
        ({"problem": "x" * (MAX_FILE_TEXT_CHARS + 1)}, "problem has 256 characters"),
        ({"file_bytes": -1}, "file_bytes is -1"),
        ({"cells_observed": -1}, "cells_observed is -1"),
    ],
)
def test_a_saved_map_that_cannot_be_is_refused(changes: dict[str, Any], reason: str) -> None:
    assert_refused(SavedMap, reason, **changes)


def test_the_longest_list_of_maps_fits_into_one_message() -> None:
    text = "x" * MAX_FILE_TEXT_CHARS
    longest = SavedMap(text, 2**62, 2**62, text, text, 0.1, 2**62, 2**62, text)
    full = MapList((longest,) * MAX_LISTED_MAPS, 9)
    assert decode(MapList, encode(full)) == full
    assert_refused(MapList, "at most 200", maps=(sample(SavedMap),) * (MAX_LISTED_MAPS + 1))
    assert_refused(MapList, "left_out is -1", left_out=-1)


def test_all_layers_of_a_view_have_the_shape_of_its_grid() -> None:
    small = np.zeros((1, 1), np.uint8)
    assert_refused(SearchView, "occupancy has shape", occupancy=small)
    assert_refused(SearchView, "layers has shape", layers=small)
