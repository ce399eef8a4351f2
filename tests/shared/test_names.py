from __future__ import annotations

from string import ascii_letters

import pytest
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


names = st.lists(st.text(ascii_letters, min_size=1), min_size=1).map(" ".join)


def test_different_names_are_different() -> None:
    assert not same_name("sofa", "sofa bed")
