from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from onemap_shared.names import normalised, same_name


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("The  Sofa", "sofa"),
        ("an\tarmchair", "armchair"),
        (" a bed ", "bed"),
        ("theatre seat", "theatre seat"),
        ("a the thing", "the thing"),  # one article, not all of them
        ("the", "the"),
        ("STRASSE", "strasse"),
    ],
)
def test_case_article_and_spaces_do_not_count(name: str, expected: str) -> None:
    assert normalised(name) == expected


@given(st.text())
def test_names_are_one_whatever_their_case(name: str) -> None:
    assert same_name(name, f"  {name.upper().lower()} ") == same_name(name.upper().lower(), name)


def test_different_names_are_different() -> None:
    assert not same_name("sofa", "sofa bed")
