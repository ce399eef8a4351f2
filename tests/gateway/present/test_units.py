"""Times and lengths as clients get them."""

from __future__ import annotations

from datetime import datetime

import pytest
from hypothesis import given
from hypothesis import strategies as st

from onemap_gateway.present.formats import millimetres, rfc3339


@pytest.mark.parametrize(
    ("time_ns", "text"),
    [
        (0, "1970-01-01T00:00:00.000Z"),
        (1_767_225_612_400_999_999, "2026-01-01T00:00:12.400Z"),
        (1_767_225_612_007_000_000, "2026-01-01T00:00:12.007Z"),
        (-1, "1969-12-31T23:59:59.999Z"),
    ],
)
def test_a_time_is_utc_cut_to_milliseconds(time_ns: int, text: str) -> None:
    assert rfc3339(time_ns) == text


@given(st.integers(min_value=0, max_value=2**63 - 1))
def test_a_time_that_is_read_again_is_the_same_millisecond(time_ns: int) -> None:
    again = datetime.fromisoformat(rfc3339(time_ns).replace("Z", "+00:00"))
    assert round(again.timestamp() * 1000) == time_ns // 10**6


def test_lengths_are_rounded_to_millimetres() -> None:
    assert millimetres([2.3499999, -1.10004]) == (2.35, -1.1)
    assert millimetres(()) == ()
