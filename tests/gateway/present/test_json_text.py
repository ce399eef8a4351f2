"""JSON without NaN."""

from __future__ import annotations

import json
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from onemap_gateway.present.formats import finite, json_text

NUMBERS = st.floats(allow_nan=True, allow_infinity=True) | st.integers() | st.text() | st.none()
DOCUMENTS: st.SearchStrategy[Any] = st.recursive(
    NUMBERS, lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner) | st.tuples(inner)
)


def refuse(constant: str) -> None:
    raise AssertionError(f"{constant} is no JSON")


@given(DOCUMENTS)
def test_every_document_becomes_json_that_every_reader_takes(document: Any) -> None:
    text = json_text(document)
    assert text.isascii()
    json.loads(text, parse_constant=refuse)


@pytest.mark.parametrize("value", [1.5, -2, "NaN", True, None, [1.0, {"a": 2.0}]])
def test_what_json_has_stays(value: object) -> None:
    assert finite(value) == value


def test_the_rest_is_null() -> None:
    assert finite({"a": (float("nan"), [float("-inf")])}) == {"a": [None, [None]]}
