"""Checks of arrays, shares and texts; messages hold cleaned texts."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from onemap_shared.messages import (
    SearchRequest,
    SearchViewRequest,
    SimilarityRequest,
    TextRequest,
    check_text,
    expect,
    expect_finite,
    expect_share,
)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "empty"),
        ("  \n\t ", "empty"),
        ("a" * 10_000, "10000 characters; the limit is 200"),
        ("12 34", "no readable word"),
        ("so\x00fa", "no readable word"),
        ("\u202esofa", "no readable word"),
    ],
)
def test_texts_that_name_nothing_are_refused(text: str, reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        check_text(text)


def test_a_text_that_is_no_string_is_refused() -> None:
    with pytest.raises(ValueError, match="must be a string, not int"):
        check_text(7)  # type: ignore[arg-type]


@pytest.mark.parametrize("text", ["sofa", "  teddy\n bear ", "Kühlschrank", "冷蔵庫", "tv 2"])
def test_names_in_any_language_are_accepted(text: str) -> None:
    assert check_text(text) == " ".join(text.split())


@pytest.mark.parametrize(
    ("message", "field"),
    [
        (TextRequest((" red  sofa",)), "texts"),
        (SearchRequest(("red\tsofa ",)), "objects"),
        (SearchViewRequest("sofa", ("red  sofa",)), "rivals"),
    ],
)
def test_messages_hold_clean_texts(message: object, field: str) -> None:
    assert getattr(message, field) == ("red sofa",)


def test_the_text_of_a_query_is_clean() -> None:
    assert SimilarityRequest(" red  sofa ").text == "red sofa"
    assert SearchViewRequest("  sofa").text == "sofa"


@pytest.mark.parametrize(
    ("array", "reason"),
    [
        (np.zeros((2, 3)), "points has dtype float64; expected float32"),
        (np.zeros((2, 2), np.float32), r"points has shape \(2, 2\); expected \('any', 3\)"),
        (np.zeros(3, np.float32), r"points has shape \(3,\)"),
    ],
)
def test_arrays_of_another_dtype_or_shape_are_refused(array: Any, reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        expect(array, "points", np.float32, (None, 3))
    expect(np.zeros((0, 3), np.float32), "points", np.float32, (None, 3))


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_arrays_with_a_value_that_is_not_finite_are_refused(value: float) -> None:
    with pytest.raises(ValueError, match="points contains NaN or infinity"):
        expect_finite(np.array([1.0, value]), "points")


@pytest.mark.parametrize("value", [-0.01, 1.01, float("nan")])
def test_shares_outside_0_to_1_are_refused(value: float) -> None:
    with pytest.raises(ValueError, match="it must lie in"):
        expect_share(value, "floor")
    for inside in (0.0, 1.0):
        expect_share(inside, "floor")
